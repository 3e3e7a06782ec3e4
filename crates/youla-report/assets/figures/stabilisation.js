// Stabilisation diagram: poles of the models of all orders over frequency, beneath them their damping ratios.

const DIAGRAM = { width: 980, left: 62, right: 16, top: 36, orders: 330, gap: 18, damping: 190, bottom: 44 };
const STANDINGS = [
  { key: "settled", name: "settled", marker: "circle", colour: null, filled: true, size: 3.6 },
  { key: "frequency", name: "frequency repeats", marker: "circle", colour: null, filled: false, size: 3.1 },
  { key: "new", name: "new", marker: "plus", colour: "--soft", filled: false, size: 2.6 },
  { key: "unstable", name: "unstable", marker: "cross", colour: "--bad", filled: false, size: 3.2 },
];

// All diagrams of a run, one at a time.
function stabilisation(host) {
  const diagrams = report.stabilisation, body = element("div"), range = element("span");
  const tables = [...document.querySelectorAll("[data-clusters]")];
  const show = k => {
    drawDiagram(body, range, diagrams[k]);
    tables.forEach((table, i) => { table.hidden = i !== k; });
  };
  const which = diagrams.length > 1 ? chooser("Poles of", diagrams.map(d => d.label), show) : null;
  host.append(element("div", { class: "controls" }, which, range), body);
  show(0);
  addEventListener("beforeprint", () => tables.forEach(table => { table.hidden = false; }));
}

function drawDiagram(host, range, diagram) {
  const { style } = methodOf(diagram.method);
  const nyquist = report.sample_time != null ? 0.5 / report.sample_time : Infinity;
  const poles = diagram.poles.filter(p => p.hz > 0 && p.hz <= nyquist * (1 + 1e-9)).map(p => ({ ...p, kind: p.stable ? p.standing : "unstable" }));
  const views = diagramViews(diagram, poles, nyquist);
  const hidden = new Set();
  let preset = views[0], view = preset.view;
  const dampings = dampingRange(diagram, poles);
  const away = poles.filter(p => p.zeta < dampings[0] || p.zeta > dampings[1]).length;
  const inner = DIAGRAM.width - DIAGRAM.left - DIAGRAM.right;
  const height = DIAGRAM.top + DIAGRAM.orders + DIAGRAM.gap + DIAGRAM.damping + DIAGRAM.bottom;
  const last = Math.max(...diagram.orders), first = Math.min(...diagram.orders);
  const upper = { y: DIAGRAM.top, h: DIAGRAM.orders, low: first - 1, high: last + 1 };
  const lower = { y: DIAGRAM.top + DIAGRAM.orders + DIAGRAM.gap, h: DIAGRAM.damping, low: dampings[0], high: dampings[1] };
  const px = hz => DIAGRAM.left + Math.log(hz / view[0]) / Math.log(view[1] / view[0]) * inner;
  const toHz = x => view[0] * (view[1] / view[0]) ** ((x - DIAGRAM.left) / inner);
  const py = (panel, value) => panel.y + (panel.high - value) / (panel.high - panel.low) * panel.h;
  const seen = p => !hidden.has(p.kind) && p.hz >= view[0] && p.hz <= view[1];

  const map = element("div", { class: "pole-map diagram", tabindex: 0, role: "img", onkeydown: pressed,
    "aria-label": `Stabilisation diagram of ${diagram.label}: ${poles.length} poles of models of order ${first} to ${last} over frequency, and their damping ratios. The ${diagram.clusters.length} clusters are in the table beneath.` });
  const kinds = STANDINGS.filter(kind => poles.some(p => p.kind === kind.key));
  const legend = element("div", { class: "legend" }, ...kinds.map(kind => {
    const count = poles.filter(p => p.kind === kind.key).length;
    const button = element("button", { type: "button", "aria-pressed": true, title: "Show or hide", onclick: () => {
      hidden.has(kind.key) ? hidden.delete(kind.key) : hidden.add(kind.key);
      button.setAttribute("aria-pressed", !hidden.has(kind.key));
      draw();
    } }, element("span", { class: "swatch", html: `<svg width="30" height="10" aria-hidden="true">${mark(kind, 15, 5)}</svg>` }), element("span", {}, `${kind.name}, ${count}`));
    return button;
  }));
  range.replaceChildren(...(views.length > 1 ? [chooser("Range", views.map(v => v.name), k => { preset = views[k]; view = preset.view; draw(); })] : []));
  host.replaceChildren(legend, map, element("p", { class: "caption" },
    "Poles of the models of all orders. Settled: the next lower order has a pole of the same frequency, damping ratio and mode shape. " +
    `Bands: clusters that are settled at enough orders, with their frequency. Dashed: the order of the model, ${diagram.chosen}.` +
    (poles.some(p => p.hz_deviation != null) ? " Lines through settled poles: two standard deviations to either side." : "") +
    (away ? ` ${away} poles lie beyond the axis of damping ratios.` : "") +
    (diagram.method === "hansen" ? " The poles of S are those of the loop of the plant and the controller, not those of the plant alone." : "") + " Drag to zoom, double-click to return."));
  const tip = tooltip(map);
  draw();
  map.addEventListener("pointermove", hover);
  map.addEventListener("pointerleave", leave);
  map.addEventListener("pointerdown", drag);
  map.addEventListener("dblclick", () => { view = preset.view; draw(); });

  function mark(kind, x, y, grow = 0) {
    const ink = `var(${kind.colour ?? style.colour})`;
    return `<path d="${markerPath(kind.marker, x, y, kind.size + grow)}" fill="${kind.filled ? ink : "none"}" stroke="${ink}" stroke-width="1.4"/>`;
  }

  function draw() {
    const clip = panel => `<clipPath id="clip-${panel === upper ? "orders" : "damping"}"><rect x="${DIAGRAM.left}" y="${panel.y}" width="${inner}" height="${panel.h}"/></clipPath>`;
    const bodyOf = (panel, value, name) => `<g clip-path="url(#clip-${name})">${bands(panel)}${panel === upper ? orderLine() : zeroLine()}` +
      whiskers(panel, value) +
      [...STANDINGS].reverse().map(kind => poles.filter(p => p.kind === kind.key && seen(p)).map(p => mark(kind, px(p.hz), py(panel, value(p)))).join("")).join("") + "</g>" +
      `<rect x="${DIAGRAM.left}" y="${panel.y}" width="${inner}" height="${panel.h}" fill="none" stroke="var(--soft)"/>`;
    const svg = `<svg viewBox="0 0 ${DIAGRAM.width} ${height}" aria-hidden="true"><defs>${clip(upper)}${clip(lower)}</defs>${grid()}` +
      bodyOf(upper, p => p.order, "orders") + bodyOf(lower, p => p.zeta, "damping") + bandLabels() + `<g class="pointed"></g>` +
      `<rect class="selection" y="${upper.y}" height="${lower.y + lower.h - upper.y}" width="0" fill="var(--link)" fill-opacity=".15"/></svg>`;
    map.querySelector("svg")?.remove();
    map.insertAdjacentHTML("afterbegin", svg);
    tip.hide();
  }

  // Two standard deviations to either side, of the frequency above, of the damping ratio below, where they are known.
  function whiskers(panel, value) {
    const shown = poles.filter(p => p.kind === "settled" && seen(p) && (panel === upper ? p.hz_deviation : p.zeta_deviation) != null);
    const ends = p => panel === upper
      ? `M${px(Math.max(p.hz - 2 * p.hz_deviation, view[0] * 1e-3)).toFixed(1)} ${py(panel, value(p)).toFixed(1)}H${px(p.hz + 2 * p.hz_deviation).toFixed(1)}`
      : `M${px(p.hz).toFixed(1)} ${py(panel, p.zeta - 2 * p.zeta_deviation).toFixed(1)}V${py(panel, p.zeta + 2 * p.zeta_deviation).toFixed(1)}`;
    return `<path d="${shown.map(ends).join("")}" stroke="var(${style.colour})" stroke-width="1.2" stroke-opacity=".45" fill="none"/>`;
  }

  function bands(panel) {
    return diagram.clusters.map(c => {
      const half = Math.max(c.hz_spread, 0);
      const a = px(Math.max(c.hz - half, view[0] * 1e-3)), b = px(c.hz + half), middle = (a + b) / 2, wide = Math.max(b - a, 10);
      return `<rect x="${(middle - wide / 2).toFixed(1)}" y="${panel.y}" width="${wide.toFixed(1)}" height="${panel.h}" fill="var(--link)" fill-opacity=".13"/>`;
    }).join("");
  }

  // The frequency above each band, in one of two rows, where there is room.
  function bandLabels() {
    const free = [-Infinity, -Infinity];
    return diagram.clusters.filter(c => c.hz >= view[0] && c.hz <= view[1]).map(c => {
      const x = px(c.hz), text = `${readOut(c.hz)} Hz`, half = 3.3 * text.length;
      const row = free.findIndex(end => x - half >= end);
      if (row < 0) return "";
      free[row] = x + half + 6;
      return `<text x="${x.toFixed(1)}" y="${DIAGRAM.top - 10 - 14 * row}" text-anchor="middle" dominant-baseline="middle" fill="var(--link)">${text}</text>`;
    }).join("");
  }

  function orderLine() {
    const y = py(upper, diagram.chosen).toFixed(1);
    return `<path d="M${DIAGRAM.left} ${y}h${inner}" stroke="var(--ink)" stroke-width="1" stroke-dasharray="4 3" opacity=".7"/>`;
  }

  function zeroLine() {
    const y = py(lower, 0).toFixed(1);
    return lower.low < 0 ? `<path d="M${DIAGRAM.left} ${y}h${inner}" stroke="var(--ink)" stroke-width="1"/>` : "";
  }

  function grid() {
    const out = [], text = (x, y, t, anchor) => out.push(`<text x="${x.toFixed(1)}" y="${y.toFixed(1)}" text-anchor="${anchor}" dominant-baseline="middle" fill="var(--ink)" font-size="12">${t}</text>`);
    const splits = logSplits(...view), names = logLabels(splits), bottom = lower.y + lower.h;
    let free = -Infinity;
    splits.forEach((hz, k) => {
      const x = px(hz);
      for (const panel of [upper, lower]) out.push(`<path d="M${x.toFixed(1)} ${panel.y}v${panel.h}" stroke="var(--grid)"/>`);
      if (!names[k] || x - 4 * names[k].length < free) return;
      free = x + 4 * names[k].length;
      text(x, bottom + 14, names[k], "middle");
    });
    for (const [panel, count, whole] of [[upper, 9, true], [lower, 5, false]]) {
      const step = Math.max(niceStep((panel.high - panel.low) / count), whole ? 1 : 0), at = [];
      for (let v = Math.ceil(panel.low / step) * step; v <= panel.high * (1 + 1e-9); v += step) if (!whole || v > 0) at.push(v);
      tickLabels(at).forEach((t, k) => {
        const y = py(panel, at[k]);
        out.push(`<path d="M${DIAGRAM.left} ${y.toFixed(1)}h${inner}" stroke="var(--grid)"/>`);
        text(DIAGRAM.left - 8, y, t, "end");
      });
    }
    text(DIAGRAM.left + inner / 2, height - 9, "Frequency (Hz)", "middle");
    for (const [panel, name] of [[upper, "Order"], [lower, "Damping ratio ζ"]]) {
      out.push(`<text transform="translate(13 ${panel.y + panel.h / 2}) rotate(-90)" text-anchor="middle" dominant-baseline="middle" fill="var(--ink)" font-size="12">${name}</text>`);
    }
    return out.join("");
  }

  function toMap(event) {
    const box = map.querySelector("svg").getBoundingClientRect();
    return [(event.clientX - box.left) * DIAGRAM.width / box.width, (event.clientY - box.top) * height / box.height];
  }

  function hover(event) {
    if (event.buttons) return leave();
    const [x, y] = toMap(event), panel = y < lower.y - DIAGRAM.gap / 2 ? upper : lower;
    let nearest = null, distance = 12;
    for (const p of poles.filter(seen)) {
      const d = Math.hypot(px(p.hz) - x, py(panel, panel === upper ? p.order : p.zeta) - y);
      if (d < distance) [nearest, distance] = [p, d];
    }
    if (!nearest) return leave();
    const kind = STANDINGS.find(k => k.key === nearest.kind), deviation = (value, unit) => value == null ? "" : ` ± ${readOut(value)}${unit}`;
    map.querySelector(".pointed").innerHTML = mark(kind, px(nearest.hz), py(upper, nearest.order), 2) +
      (nearest.zeta >= lower.low && nearest.zeta <= lower.high ? mark(kind, px(nearest.hz), py(lower, nearest.zeta), 2) : "");
    const box = map.getBoundingClientRect();
    const cluster = nearest.cluster == null ? "" : `\ncluster ${nearest.cluster + 1} at ${readOut(diagram.clusters[nearest.cluster].hz)} Hz`;
    tip.show(`order ${nearest.order}, ${kind.name}\n${readOut(nearest.hz)} Hz${deviation(nearest.hz_deviation, " Hz")}\nζ = ${minus(nearest.zeta.toFixed(4))}${deviation(nearest.zeta_deviation, "")}${cluster}`,
      event.clientX - box.left, event.clientY - box.top);
  }

  function leave() {
    tip.hide();
    map.querySelector(".pointed").innerHTML = "";
  }

  function drag(event) {
    if (event.button !== 0) return;
    const [start] = toMap(event), selection = map.querySelector(".selection");
    map.setPointerCapture(event.pointerId);
    const clamp = x => Math.min(DIAGRAM.left + inner, Math.max(DIAGRAM.left, x));
    const follow = move => {
      const [a, b] = [start, toMap(move)[0]].map(clamp).sort((a, b) => a - b);
      selection.setAttribute("x", a);
      selection.setAttribute("width", b - a);
    };
    map.addEventListener("pointermove", follow);
    map.addEventListener("pointerup", up => {
      map.removeEventListener("pointermove", follow);
      const [a, b] = [start, toMap(up)[0]].map(clamp).sort((a, b) => a - b);
      if (b - a > 6) view = [toHz(a), toHz(b)];
      draw();
    }, { once: true });
  }

  function pressed(event) {
    const ratio = view[1] / view[0];
    const moved = part => view.map(hz => hz * ratio ** part), scaled = part => [view[0] * ratio ** part, view[1] / ratio ** part];
    const next = { ArrowLeft: () => moved(-0.1), ArrowRight: () => moved(0.1), "+": () => scaled(0.2), "=": () => scaled(0.2),
      "-": () => scaled(-0.4), 0: () => preset.view, Escape: () => preset.view }[event.key];
    if (next && !event.ctrlKey && !event.metaKey && !event.altKey) { view = next(); draw(); event.preventDefault(); }
  }
}

// Around the clusters, and everything.
function diagramViews(diagram, poles, nyquist) {
  const all = poles.map(p => p.hz), top = Number.isFinite(nyquist) ? nyquist : Math.max(...all, 1) * 1.1;
  const whole = { name: "all frequencies", view: [Math.min(Math.max(Math.min(...all, top / 2) / 1.1, top / 2000), top / 2), top] };
  const modes = diagram.clusters.map(c => c.hz);
  if (!modes.length) return [whole];
  const near = [Math.max(Math.min(...modes) / 2.5, whole.view[0]), Math.min(Math.max(...modes) * 2.5, top)];
  return near[1] / near[0] > 0.8 * whole.view[1] / whole.view[0] ? [whole] : [{ name: "around the clusters", view: near }, whole];
}

// Up to well above the clusters; without any, all but the strongest damping.
function dampingRange(diagram, poles) {
  const known = diagram.clusters.length ? diagram.clusters.map(c => c.zeta + 2 * c.zeta_spread) : poles.filter(p => p.zeta < 0.9).map(p => p.zeta);
  const least = Math.min(0, ...diagram.clusters.map(c => c.zeta - 2 * c.zeta_spread));
  const top = Math.min(1.02, Math.max(0.02, 1.8 * Math.max(0, ...known)));
  return [least < 0 ? 1.5 * least : -0.06 * top, top];
}
