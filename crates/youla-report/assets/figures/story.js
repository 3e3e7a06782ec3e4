// The figures of a story: panels of curves, boxes or cells, below or beside each other, under one legend.

const FURTHER_DASHES = [[2.4, 2.4], [8, 2, 2, 2], [14, 4]];
const BESIDE_HEIGHT = 260, HEIGHTS = [330, 240, 180];
const PLACES = [...methods.keys()];

const kindOf = panel => Object.keys(panel.content)[0];
const nameOf = ({ method, note }) => [methodOf(method).label, note].filter(Boolean).join(", ");
const idOf = curve => JSON.stringify([curve.method, curve.note, curve.drawn]);
const placeInList = ({ method }) => { const place = PLACES.indexOf(method); return place < 0 ? PLACES.length : place; };
const inOrder = list => [...list].sort((a, b) => placeInList(a) - placeInList(b));

function storyFigure(host, figure) {
  // What the reader has chosen outlives drawing again for another theme or for paper.
  const state = { everything: false, hidden: new Set(), views: new Map() };
  const controls = element("div", { class: "controls" }), body = element("div");
  host.append(controls, body);
  const drawing = mount(body, () => parts(body, figure, state));
  const each = what => drawing.plot.list.forEach(what);
  if (hiddenByRange(figure)) {
    const ranges = figure.panels.map(panel => panel.y.range && rangeText(panel.y)).filter(Boolean);
    const same = new Set(ranges).size === 1;
    const choice = chooser("Vertical axis", [same ? ranges[0] : "as chosen", "everything"], k => { state.everything = k === 1; each(part => part.refit?.()); });
    controls.append(choice);
    host.addEventListener("keydown", event => {
      if (event.key === "e" && !event.ctrlKey && !event.metaKey && !event.altKey) choice.querySelectorAll("button")[state.everything ? 0 : 1].click();
    });
  }
  if (figure.panels.some(goesOn)) {
    const button = (name, what) => element("button", { type: "button", class: "action", onclick: () => each(what) }, name);
    controls.append(element("span", {}, button("First view", part => part.first?.()), " ", button("Everything", part => part.reset?.())));
  }
  controls.hidden = !controls.children.length;
  host.parentElement.querySelector("figcaption .counts").textContent = countsInWords(figure);
}

function parts(body, figure, state) {
  const legend = makeLegend(legendOf(figure), state.hidden), beside = figure.layout === "beside" && figure.panels.length > 1;
  const grid = element("div", { class: beside ? "columns" : "rows" });
  const named = legend.ids.length > 0, maps = figure.panels.every(panel => kindOf(panel) === "cells");
  if (maps) {
    legend.node.classList.add("of-maps");
    for (const button of legend.node.children) button.disabled = true;
  }
  legend.node.style.setProperty("--entry", maps ? "0" : `${readWidth(figure)}px`);
  body.replaceChildren(...(named ? [legend.node] : []), grid);
  if (beside) grid.style.setProperty("--least", `${Math.max(...figure.panels.map(leastWidth))}px`);
  // All stand on the page before the first is drawn, so that each knows its width.
  const stands = groups(figure.panels, beside).map(panels => ({ panels, cell: element("div") }));
  grid.append(...stands.map(({ cell }) => cell));
  const list = stands.map(({ panels, cell }) => {
    const kind = kindOf(panels[0]);
    if (kind === "boxes") return boxes(cell, panels[0], state);
    if (kind === "cells") return cells(cell, panels[0]);
    return curves(cell, panels, { figure, state, legend, beside });
  });
  return { list, destroy() { list.forEach(part => part.destroy()); body.replaceChildren(); } };
}

// Panels of curves that stand below each other share one axis; all others stand alone.
function groups(panels, beside) {
  const list = [];
  for (const panel of panels) {
    const last = list[list.length - 1];
    if (!beside && last && kindOf(panel) === "curves" && kindOf(last[0]) === "curves") last.push(panel);
    else list.push([panel]);
  }
  return list;
}

function curves(host, panels, { figure, state, legend, beside }) {
  const { x } = panels[panels.length - 1];
  const height = beside ? BESIDE_HEIGHT : HEIGHTS[Math.min(panels.length, HEIGHTS.length) - 1];
  const spec = {
    label: [figure.title, figure.caption, panels.map(panel => panel.title).filter(Boolean).join(", ")].filter(Boolean).map(text => text.replace(/\.$/, "")).join(". "),
    x, legend: [], shared: legend, view: x.range ?? undefined,
    panels: panels.map(panel => {
      const dashOf = dashes(), drawn = inOrder(panel.content.curves).map(curve => curveOf(curve, dashOf));
      const made = { title: panel.title, label: panel.y.label, unit: panel.y.unit, log: panel.y.log, height,
        curves: [...drawn.filter(curve => curve.cloud), ...drawn.filter(curve => !curve.cloud)] };
      if (panel.y.range || drawn.some(curve => curve.cloud)) addClouds(made, panel.y, state, legend.hidden);
      return made;
    }),
  };
  const stacked = stack(host, spec);
  readClouds(stacked, spec.panels, spec);
  if (state.views.has(panels[0])) stacked.zoom(...state.views.get(panels[0]));
  const destroy = () => {
    const { min, max } = stacked.plots[0].scales.x;
    if (max > min) state.views.set(panels[0], [min, max]); // Not so before the first drawing is done.
    stacked.destroy();
  };
  return { ...stacked, destroy, refit() { stacked.plots.forEach(plot => plot.redraw()); }, first() { stacked.zoom(...(spec.view ?? [-Infinity, Infinity])); } };
}

// Dash of each line: the first of a method has that of the method, those with another note their own.
function dashes() {
  const seen = new Map();
  return curve => {
    const dash = methodOf(curve.method).style.dash;
    const notes = seen.get(curve.method) ?? [];
    seen.set(curve.method, notes);
    if (!notes.includes(curve.note)) notes.push(curve.note);
    const nth = notes.indexOf(curve.note);
    return nth ? FURTHER_DASHES[(nth - 1) % FURTHER_DASHES.length] : dash;
  };
}

function curveOf(curve, dashOf) {
  const { style } = methodOf(curve.method), common = { id: idOf(curve), name: nameOf(curve) };
  if (curve.drawn === "line") return { ...common, x: curve.x, y: curve.y, style: { ...style, dash: dashOf(curve) } };
  const order = curve.x.map((_, k) => k).sort((a, b) => curve.x[a] - curve.x[b]);
  return { ...common, x: order.map(k => curve.x[k]), y: order.map(k => curve.y[k]), style, cloud: true };
}

// Boxes bear their names below; maps name the winners.
function legendOf(figure) {
  const entries = new Map();
  for (const panel of figure.panels) {
    const { content } = panel, dashOf = dashes();
    for (const curve of inOrder(content.curves ?? [])) {
      const { style } = methodOf(curve.method), line = { ...style, dash: curve.drawn === "line" ? dashOf(curve) : [] };
      entries.set(idOf(curve), { id: idOf(curve), name: nameOf(curve), method: curve.method, swatch: curve.drawn === "line" ? swatch(line) : pointSwatch(style) });
    }
    for (const { method } of content.cells?.cells ?? []) {
      if (method) entries.set(method, { id: method, name: methodOf(method).label, method, swatch: areaSwatch(methodOf(method).style) });
    }
  }
  return inOrder(entries.values());
}

// Room for what the legend reads out, one value per stacked panel, so that names do not move.
function readWidth({ layout, panels }) {
  const read = layout === "beside" ? panels.slice(0, 1) : panels;
  return Math.max(150, 52 + read.reduce((sum, panel) => sum + 6.2 * (prettyUnit(panel.y.unit).length + 8), 0));
}

// Panels beside each other become no narrower than this; paper is narrower than most screens.
function leastWidth(panel) {
  const { boxes, cells } = panel.content, printing = document.documentElement.classList.contains("printing");
  if (boxes) return BOX_LEFT + RIGHT + (printing ? 48 : 62) * boxes.length;
  if (cells) return 78 + (printing ? 22 : 40) * cells.columns.length;
  return printing ? 290 : 330;
}

const rangeText = ({ range, unit }) => `${inProse(range[0])} to ${inProse(range[1])}${unit ? ` ${prettyUnit(unit)}` : ""}`;

const valuesOf = panel => (panel.content.curves ?? panel.content.boxes ?? []).flatMap(list => list.y ?? list.values);
const outside = (panel, values) => panel.y.range ? values.filter(v => ["below", "above"].includes(placeOf(v, panel.y.range, panel.y.log))).length : 0;
const goesOn = ({ content, x }) => x.range && content.curves?.some(curve => curve.x.some(v => v < x.range[0] || v > x.range[1]));
const hiddenByRange = figure => figure.panels.some(panel => kindOf(panel) !== "cells" && outside(panel, valuesOf(panel)) > 0);

// How many points of the clouds stand at the edges.
function countsInWords(figure) {
  const told = figure.panels.map(panel => {
    const clouds = inOrder((panel.content.curves ?? []).filter(curve => curve.drawn === "points")).map(curve => {
      const missing = curve.y.filter(v => v == null).length, beyond = outside(panel, curve.y);
      const said = [beyond ? `${beyond} beyond the axis` : "", missing ? `${missing} without a value` : ""].filter(Boolean).join(" and ");
      return said && `${nameOf(curve)} ${said}, of ${curve.y.length}`;
    }).filter(Boolean).join("; ");
    return clouds && (panel.title ? `${panel.title}: ${clouds}` : clouds);
  }).filter(Boolean);
  return told.length ? `At the edges, triangles stand for values beyond the axis and crosses for none. ${told.map(text => text[0].toUpperCase() + text.slice(1)).join(". ")}.` : "";
}

for (const host of document.querySelectorAll("[data-figure]")) {
  const figure = report.figures.find(f => f.key === host.dataset.figure);
  if (figure) storyFigure(host, figure);
}
