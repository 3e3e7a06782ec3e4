// Any figure: panels below each other with one common axis, or beside each other, under one legend.

const mounted = [];
let stacks = 0;

// The figures of one place of the page, one at a time, told apart by their choices.
function show(host, figures) {
  const options = new Map();
  for (const figure of figures) for (const [name, value] of figure.choice ?? []) options.set(name, [...new Set([...(options.get(name) ?? []), value])]);
  const wanted = new Map(figures[0].choice), hidden = new Set(), states = new Map(figures.map(figure => [figure, { everything: false, hidden, views: new Map() }]));
  const controls = element("div", { class: "controls" }), extra = element("span", { class: "controls" }), body = element("div");
  const own = host.closest("figure") ? null : element("p", { class: "caption" }), said = own ?? host.parentElement.querySelector("figcaption .counts");
  const choosers = [...options].filter(([, values]) => values.length > 1)
    .map(([name, values]) => ({ name, node: chooser(name, values, k => { wanted.set(name, values[k]); pick(name); }) }));
  let now = figures[0];
  controls.append(...choosers.map(c => c.node), extra);
  host.append(controls, body, ...(own ? [own] : []));
  const drawing = { draw() { drawing.parts?.forEach(part => part.destroy()); drawing.parts = parts(body, now, states.get(now)); } };
  mounted.push(drawing);
  pick();

  // The figure with the choice just made and most of the others.
  function pick(name) {
    const score = figure => (figure.choice ?? []).reduce((sum, [n, value]) => sum + (wanted.get(n) === value ? n === name ? 100 : 1 : 0), 0);
    now = figures.reduce((best, figure) => score(figure) > score(best) ? figure : best);
    drawing.draw();
    describe();
  }

  function describe() {
    for (const { name, node } of choosers) node.hidden = !(now.choice ?? []).some(([n]) => n === name);
    const state = states.get(now), ranges = [...new Set(now.panels.filter(hides).map(({ y }) => `${rough(y.range[0])} to ${rough(y.range[1])}${y.unit ? ` ${prettyUnit(y.unit)}` : ""}`))];
    const each = what => drawing.parts.forEach(part => part[what]?.());
    const button = (name, what) => element("button", { type: "button", class: "action", onclick: () => each(what) }, name);
    extra.replaceChildren(...(ranges.length ? [chooser("Vertical axis", [ranges.length === 1 ? ranges[0] : "as chosen", "everything"], k => { state.everything = k === 1; each("refit"); }, state.everything ? 1 : 0)] : []),
      ...(now.panels.some(goesOn) ? [element("span", {}, button("First view", "first"), " ", button("Everything", "reset"))] : []));
    controls.hidden = !choosers.length && !extra.children.length;
    said.textContent = [own ? now.caption : "", countsInWords(now)].filter(Boolean).join(" ");
    for (const node of document.querySelectorAll("[data-with]")) if (figures.some(f => f.key === node.dataset.with)) node.hidden = node.dataset.with !== now.key;
  }
}

const rough = value => inProse(Number(value.toPrecision(2)));
const valuesOf = ({ content }) => (content.curves ?? content.boxes ?? []).flatMap(list => list.y ?? list.values);
const hides = panel => panel.y.range && !panel.equal && !panel.content.cells && valuesOf(panel).some(v => ["below", "above"].includes(placeOf(v, panel.y.range, panel.y.log)));
const goesOn = ({ content, x, y, equal }) => content.curves?.some(c => x.range && c.x.some(v => v < x.range[0] || v > x.range[1]) || equal && y.range && c.y.some(v => v < y.range[0] || v > y.range[1]));

// How many points of clouds are at the edges; in a plane those beyond the view are not drawn.
function countsInWords(figure) {
  const said = figure.panels.filter(panel => !panel.equal).flatMap(panel => {
    const clouds = inOrder((panel.content.curves ?? []).filter(curve => curve.drawn === "points")).map(curve => {
      const count = (...places) => curve.y.filter(v => places.includes(placeOf(v, panel.y.range ?? [-Infinity, Infinity], panel.y.log))).length, [beyond, missing] = [count("below", "above"), count("missing")];
      const words = [beyond ? `${beyond} beyond the axis` : "", missing ? `${missing} without a value` : ""].filter(Boolean).join(" and ");
      return words && `${nameOf(curve)} ${words}, of ${curve.y.length}`;
    }).filter(Boolean).join("; ");
    return clouds ? [panel.title ? `${panel.title}: ${clouds}` : clouds] : [];
  });
  return said.length ? `At the edges: triangles for values beyond the axis, crosses for missing values. ${said.map(text => text[0].toUpperCase() + text.slice(1)).join(". ")}.` : "";
}

function parts(body, figure, state) {
  const legend = makeLegend(figure, state.hidden), beside = figure.layout === "beside" && figure.panels.length > 1, printing = document.documentElement.classList.contains("printing");
  const grid = element("div", { class: beside ? "columns" : "rows" }), groups = [];
  for (const panel of figure.panels) {
    const last = groups[groups.length - 1];
    !beside && last && panel.content.curves && last[0].content.curves && !panel.equal && !last[0].equal ? last.push(panel) : groups.push([panel]);
  }
  const least = ({ content: { boxes, cells } }) => boxes ? LEFT + RIGHT + (printing ? 48 : 62) * boxes.length : cells ? 78 + (printing ? 22 : 40) * cells.columns.length : printing ? 290 : 318;
  if (beside) grid.style.setProperty("--least", `${Math.max(...figure.panels.map(least))}px`);
  const units = (beside ? figure.panels.slice(0, 1) : figure.panels).filter(panel => (panel.content.curves ?? []).some(c => c.drawn === "line"));
  legend.node.style.setProperty("--entry", units.length ? `${Math.max(150, 52 + 50 * Math.min(3, units.length))}px` : "0");
  legend.node.classList.toggle("unread", !units.length);
  body.replaceChildren(...(legend.ids.length ? [legend.node] : []), grid);
  const cellsOf = groups.map(() => element("div"));
  grid.append(...cellsOf); // All before the first is drawn, so that each knows its width.
  return groups.map((panels, k) => panels[0].content.cells ? cells(cellsOf[k], panels[0]) : stack(cellsOf[k], panels, { figure, legend, state, beside, place: k }));
}

// Both ends of all values of an axis, a little wider where values are counts or both axes have one scale.
function extent(panels, axis, whole) {
  const values = panels.flatMap(({ content, regions = [] }) => [...(content.curves ?? []), ...regions].flatMap(c => axis === "x" || c.y ? c[axis] : []));
  if (panels[0].content.boxes) return [-0.5, panels[0].content.boxes.length - 0.5];
  const [low, high] = padded(values, panels.some(panel => panel[axis].log), panels[0].equal ? 0.06 : 0);
  return whole ? [low - 0.6, high + 0.6] : [low, high];
}

function stack(host, panels, { figure, legend, state, beside, place }) {
  const [first] = panels, { x } = panels[panels.length - 1], key = `stack-${stacks++}`, equal = !!first.equal, { boxes } = first.content;
  const whole = !boxes && !x.range && !x.log && isWhole(panels.flatMap(panel => panel.content.curves.map(c => c.x))), all = extent(panels, "x", whole), given = x.range ?? all;
  const reach = equal ? all : [Math.min(all[0], given[0]), Math.max(all[1], given[1])], view = equal ? {} : null;
  const where = element("span", { class: "where" }), root = element("div", { class: "stack", tabindex: 0, role: "img", onkeydown: pressed,
    "aria-label": [figure.title, figure.caption, panels.map(panel => panel.title).filter(Boolean).join(", ")].filter(Boolean).map(text => text.replace(/\.$/, "")).join(". ") });
  host.replaceChildren(root);
  const width = () => Math.max(240, root.clientWidth), shares = panels.map(panel => panel.height ?? 1), sum = shares.reduce((a, b) => a + b);
  const printing = document.documentElement.classList.contains("printing"), heights = shares.map(share => (printing ? 0.72 : 1) * (equal ? Math.min(520, Math.max(280, 0.72 * width())) : beside || boxes ? 270 : Math.max(80, Math.min(700, 240 + 95 * panels.length) * share / sum)));
  if (equal) fit(first.x.range ?? all, first.y.range ?? extent(panels, "y"));
  let linking = false, plots = [];
  panels.forEach((panel, k) => {
    // A name that has no room beside the axis stands above it.
    const named = isTooLong(panel.y, heights[k]), title = [panel.title, named ? panel.y.label : ""].filter(Boolean).join(": ");
    if (title) root.append(element("p", { class: "panel-title" }, title));
    plots.push(makePlot(root, panel, { named, last: k === panels.length - 1, x, whole, extent: equal ? view.x : reach, width: width(), height: heights[k], key, legend, state, view, zoomed: (a, b) => a ? zoom(a, b) : home(), moved: link, read: u => { if (u === plots[0]?.u) read(); } }));
  });
  if (boxes) host.append(boxNames(plots[0], boxesOf(first), first.y.range ?? [-Infinity, Infinity], first.y.log));
  root.append(where);
  state.views.has(place) ? zoom(...state.views.get(place)) : zoom(given, first.y.range);
  const observer = new ResizeObserver(() => plots.forEach(({ u }) => { if (Math.abs(u.width - width()) > 1) u.setSize({ width: width(), height: u.height }); }));
  observer.observe(root);
  legend.listeners.push(toggled);
  return { refit: () => plots.forEach(({ u }) => u.redraw()), first: () => zoom(given, first.y.range), reset: () => zoom(all, equal ? extent(panels, "y") : null), destroy() { observer.disconnect(); keep(); plots.forEach(({ u }) => u.destroy()); host.replaceChildren(); } };

  // What the reader has chosen remains when the figure is drawn again for another theme or for paper.
  function keep() {
    const { min, max } = plots[0].u.scales.x;
    if (max > min) state.views.set(place, equal ? [view.x, view.y] : [[min, max]]);
  }

  // The smallest view of the shape of the frame that holds both intervals.
  function fit([x0, x1], [y0, y1]) {
    const aspect = (width() - LEFT - RIGHT) / (heights[0] - 8), w = Math.max(x1 - x0, (y1 - y0) * aspect), h = w / aspect, [cx, cy] = [(x0 + x1) / 2, (y0 + y1) / 2];
    Object.assign(view, { x: [cx - w / 2, cx + w / 2], y: [cy - h / 2, cy + h / 2] });
  }

  function zoom([low, high], vertical) {
    if (equal) fit([low, high], vertical ?? view.y);
    const [min, max] = equal ? view.x : [Math.max(low, reach[0]), Math.min(high, reach[1])];
    plots.forEach(({ u }) => u.setScale("x", { min, max }));
  }
  function home() { zoom(given, first.y.range ?? extent(panels, "y")); }

  function link(source) {
    if (linking) return;
    linking = true;
    const { min, max } = source.scales.x;
    plots.forEach(({ u }) => { if (u !== source && (u.scales.x.min !== min || u.scales.x.max !== max)) u.setScale("x", { min, max }); });
    linking = false;
    // The cursor stays where it is while the scale under it changes.
    requestAnimationFrame(() => { const { left, top } = plots[0]?.u.cursor ?? {}; if (left >= 0 && root.isConnected) plots.forEach(({ u }) => u.setCursor({ left, top })); });
  }

  function toggled() {
    for (const { u, plain } of plots) { plain.forEach((c, k) => u.setSeries(k + 1, { show: !legend.hidden.has(idOf(c)) }, false)); u.redraw(); }
    read();
  }

  function read() {
    const [{ u }] = plots, at = !equal && !boxes && u.cursor.left >= 0 ? u.posToVal(u.cursor.left, "x") : null;
    where.textContent = at == null ? "" : `${x.label} ${readOut(whole ? Math.round(at) : at)} ${prettyUnit(x.unit)}${x.unit === "Hz" ? ` (${readOut(2 * Math.PI * at)} rad/s)` : ""}`;
    const own = new Set(plots.flatMap(({ plain }) => plain.map(idOf)));
    for (const id of own) legend.read(id, at == null || legend.hidden.has(id) ? "" : plots.map((plot, k) => {
      const curve = plot.plain.find(c => idOf(c) === id), row = curve && plot.u.cursor.idxs?.[plot.plain.indexOf(curve) + 1];
      return row == null ? "" : readOut(plot.value(curve, row));
    }).filter(Boolean).join(", "));
  }

  function pressed(event) {
    if (!plainKey(event) || boxes) return;
    const { u } = plots[0], { min, max } = u.scales.x, [to, from] = x.log ? [Math.log, Math.exp] : [v => v, v => v], [a, b] = [to(min), to(max)];
    const inner = u.over.clientWidth, left = u.cursor.left >= 0 ? u.cursor.left : inner / 2, centre = a + (b - a) * left / inner;
    const scaled = factor => equal ? around(factor) : zoom([from(centre - (centre - a) * factor), from(centre + (b - centre) * factor)]);
    const around = factor => zoom(...[view.x, view.y].map(([low, high]) => [(low + high) / 2 - factor * (high - low) / 2, (low + high) / 2 + factor * (high - low) / 2]));
    const pan = (dx, dy) => zoom(view.x.map(v => v + dx * (view.x[1] - view.x[0])), view.y.map(v => v + dy * (view.y[1] - view.y[0])));
    const move = sign => equal ? pan(0.1 * sign, 0) : plots.forEach(p => p.u.setCursor({ left: Math.min(inner, Math.max(0, left + sign * (event.shiftKey ? 0.05 : 0.005) * inner)), top: 10 }));
    const action = { ArrowLeft: () => move(-1), ArrowRight: () => move(1), "+": () => scaled(0.5), "=": () => scaled(0.5), "-": () => scaled(2), 0: equal ? home : () => zoom(reach), Escape: equal ? home : () => zoom(reach),
      ...(equal ? { ArrowUp: () => pan(0, 0.1), ArrowDown: () => pan(0, -0.1) } : {}) }[event.key];
    if (action) { action(); event.preventDefault(); }
  }
}
