// Stacked plots over one common axis: linked zoom and cursor, one legend that reads out and hides.
//
// spec = {
//   label,                                   what the figure shows, for those who cannot see it
//   x: { label, unit, log },
//   panels: [{ title, label, unit, height, log, steps, limits, curves: [{ id, x, y, style, opacity, chosen, draw }] }],
//                                            a curve with `draw` draws itself; a panel may choose the `ends` of its vertical
//                                            axis and its `ticks`, and draw `over` the curves
//   legend: [{ id, name, style, swatch }],   or `shared`, a legend that other stacks show too
//   shades: [[from, to]],                    bands of the common axis that are shaded
//   detail: [from, to],                      window in which every sample is drawn, shaded until it fills the view
//   view: [from, to],                        what is shown first; all where it is absent
// }

const LEFT = 66, RIGHT = 14, FONT = 12;
const figures = [];
let figureCount = 0;

// Keeps a figure on the page: draws it again when the theme changes or the page is printed.
function mount(host, build) {
  const figure = { host, draw: () => { figure.plot?.destroy(); figure.plot = build(host); } };
  figures.push(figure);
  figure.draw();
  return figure;
}

function stack(host, spec) {
  const key = `figure-${figureCount++}`;
  const [xMin, xMax] = extent(spec);
  const legend = spec.shared ?? makeLegend(spec.legend);
  const { hidden } = legend;
  const where = element("span", { class: "where" });
  const root = element("div", { class: "stack", tabindex: 0, role: "img", "aria-label": spec.label, onkeydown: pressed });
  root.append(where);
  host.replaceChildren(...(spec.shared || !spec.legend.length ? [root] : [legend.node, root]));
  if (!spec.shared) legend.node.style.setProperty("--entry", spec.panels.some(panel => panel.curves.length > 1) ? "208px" : "158px");
  legend.listeners.push(toggled);
  const width = () => Math.max(240, root.clientWidth);
  let linking = false, lastX = null;

  const plots = spec.panels.map((panel, k) => {
    if (panel.title) root.append(element("p", { class: "panel-title" }, panel.title));
    return new uPlot(options(panel, k === spec.panels.length - 1), table(panel.curves, xMin, xMax), root);
  });
  zoom(...(spec.view ?? [xMin, xMax]));
  const observer = new ResizeObserver(() => {
    plots.forEach(plot => { if (Math.abs(plot.width - width()) > 1) plot.setSize({ width: width(), height: plot.height }); });
  });
  observer.observe(root);
  tellWhere(null);
  return { destroy() { observer.disconnect(); plots.forEach(plot => plot.destroy()); host.replaceChildren(); }, zoom, reset, root, plots };

  function options(panel, last) {
    const ink = colour("--ink"), soft = colour("--soft"), grid = colour("--grid");
    const font = `${FONT}px ${colour("--sans")}`;
    const axis = { stroke: ink, font, labelFont: font, grid: { stroke: grid, width: 1 }, ticks: { stroke: soft, width: 1, size: 4 }, gap: 4 };
    const logarithmic = log => log && { splits: (u, k, low, high) => logSplits(low, high), filter: (u, splits) => splits, values: (u, splits) => logLabels(splits) };
    return {
      width: width(), height: panel.height + (last ? 46 : 10), padding: [8, RIGHT, last ? 0 : 2, 0],
      legend: { show: false },
      cursor: {
        y: false, sync: { key, setSeries: false, scales: ["x", null] }, drag: { x: true, y: false, dist: 4 },
        points: { size: 6, width: 0, fill: (u, k) => u.series[k].stroke(u, k) }, focus: { prox: -1 },
      },
      scales: {
        x: { time: false, distr: spec.x.log ? 3 : 1, range: (u, low, high) => [low, high] },
        y: { distr: panel.log ? 3 : 1, range: (u, low, high) => panel.ends?.(u, low, high) ?? padded(low, high, panel) },
      },
      axes: [
        { ...axis, space: 64, size: last ? 26 : 4, label: last ? withUnit(spec.x.label, spec.x.unit) : null, labelSize: 20,
          values: (u, splits) => last ? tickLabels(splits) : splits.map(() => ""), ...logarithmic(spec.x.log),
          ...(spec.x.log && !last ? { values: (u, splits) => splits.map(() => "") } : {}), ...(spec.x.whole ? { incrs: [1, 2, 5, 10, 20, 50] } : {}) },
        { ...axis, space: panel.height < 120 ? 18 : 30, size: LEFT - 18, labelSize: 18, labelGap: 0, label: withUnit(panel.label, panel.axisUnit ?? panel.unit),
          values: (u, splits) => tickLabels(splits), ...logarithmic(panel.log), ...(panel.steps ? { incrs: panel.steps } : {}), ...panel.ticks?.() },
      ],
      series: [{}, ...panel.curves.map(curve => ({
        label: curve.id, show: !hidden.has(curve.id), stroke: colour(curve.style.colour), width: curve.style.width,
        dash: curve.style.dash, alpha: curve.style.points ? 0.45 : 1, points: { show: false },
        ...(curve.chosen === undefined && !curve.draw ? {} : { paths: () => null }),
      }))],
      hooks: {
        drawClear: [u => { spec.shades?.forEach(band => shade(u, band)); if (spec.detail && !fills(u, spec.detail)) shade(u, spec.detail); }],
        drawAxes: [u => frame(u, soft)],
        drawSeries: [(u, k) => {
          const curve = panel.curves[k - 1];
          if (curve?.style.points) scatter(u, curve);
          if (curve?.chosen !== undefined) stems(u, curve);
          curve?.draw?.(u);
        }],
        draw: [u => panel.over?.(u)],
        setScale: [(u, scale) => { if (scale === "x" && !linking) link(u); }],
        setCursor: [u => { if (u === plots?.[0]) tellWhere(u.cursor.left >= 0 ? u.posToVal(u.cursor.left, "x") : null); }],
      },
    };
  }

  function link(source) {
    linking = true;
    const { min, max } = source.scales.x;
    plots?.forEach(plot => { if (plot !== source && (plot.scales.x.min !== min || plot.scales.x.max !== max)) plot.setScale("x", { min, max }); });
    linking = false;
    requestAnimationFrame(readAgain);
  }

  // The cursor stays where it is while the scale under it changes.
  function readAgain() {
    const { left, top } = plots?.[0]?.cursor ?? {};
    if (left >= 0 && root.isConnected) plots.forEach(plot => plot.setCursor({ left, top }));
  }

  function zoom(min, max) {
    plots.forEach(plot => plot.setScale("x", { min: Math.max(min, xMin), max: Math.min(max, xMax) }));
  }

  function reset() { zoom(xMin, xMax); }

  function toggled(id) {
    plots.forEach((plot, k) => spec.panels[k].curves.forEach((curve, i) => {
      if (curve.id === id) plot.setSeries(i + 1, { show: !hidden.has(id) }, false);
    }));
    tellWhere(lastX);
  }

  function tellWhere(x) {
    lastX = x;
    where.textContent = x == null ? "" : `${spec.x.label.length > 16 ? "" : spec.x.label} ${readOut(spec.x.whole ? Math.round(x) : x)} ${prettyUnit(spec.x.unit)}`;
    for (const id of legend.ids) {
      const parts = x == null || hidden.has(id) ? [] : spec.panels.map((panel, k) => read(panel, plots[k], id)).filter(Boolean);
      legend.say(id, parts.join(", "));
    }
  }

  function read(panel, plot, id) {
    const k = panel.curves.findIndex(curve => curve.id === id) + 1;
    const row = k > 0 ? plot.cursor.idxs?.[k] : null;
    if (row == null) return "";
    return (panel.short ? panel.short + " " : "") + readOut(plot.data[k][row]) + (panel.unit === "deg" ? "°" : panel.unit ? "\u00a0" + prettyUnit(panel.unit) : "");
  }

  function pressed(event) {
    const plot = plots[0], { min, max } = plot.scales.x;
    const toAxis = spec.x.log ? Math.log : x => x, fromAxis = spec.x.log ? Math.exp : x => x;
    const [a, b] = [toAxis(min), toAxis(max)];
    const inner = plot.over.clientWidth;
    const left = plot.cursor.left >= 0 ? plot.cursor.left : inner / 2;
    const centre = a + (b - a) * left / inner;
    const scaled = factor => zoom(fromAxis(centre - (centre - a) * factor), fromAxis(centre + (b - centre) * factor));
    const move = step => plots.forEach(p => p.setCursor({ left: Math.min(inner, Math.max(0, left + step * inner)), top: 10 }));
    const step = event.shiftKey ? 0.05 : 0.005;
    const action = {
      ArrowLeft: () => move(-step), ArrowRight: () => move(step), "+": () => scaled(0.5), "=": () => scaled(0.5),
      "-": () => scaled(2), 0: reset, Escape: reset,
    }[event.key];
    if (action && !event.ctrlKey && !event.metaKey && !event.altKey) { action(); event.preventDefault(); }
  }
}

// Names that read out and hide; whoever draws under them listens.
function makeLegend(entries, hidden = new Set()) {
  const listeners = [];
  const items = new Map(entries.map(entry => {
    const value = element("span", { class: "value" });
    const button = element("button", { type: "button", "aria-pressed": !hidden.has(entry.id), title: "Show or hide", onclick: () => toggle(entry.id) },
      element("span", { class: "swatch", html: entry.swatch ?? swatch(entry.style) }), element("span", {}, entry.name), value);
    return [entry.id, { value, button }];
  }));
  function toggle(id) {
    hidden.has(id) ? hidden.delete(id) : hidden.add(id);
    items.get(id).button.setAttribute("aria-pressed", !hidden.has(id));
    listeners.forEach(listener => listener(id));
  }
  const node = element("div", { class: "legend" }, ...[...items.values()].map(item => item.button));
  return { node, hidden, listeners, ids: [...items.keys()], say(id, text) { items.get(id).value.textContent = text; } };
}

function extent(spec) {
  let low = Infinity, high = -Infinity;
  for (const { curves } of spec.panels) {
    for (const { x } of curves) {
      if (x.length) { low = Math.min(low, x[0]); high = Math.max(high, x[x.length - 1]); }
    }
  }
  if (spec.x.whole) return [low - 0.6, high + 0.6];
  if (spec.view) [low, high] = [Math.min(low, spec.view[0]), Math.max(high, spec.view[1])];
  if (low === high) return [low - 0.5, high + 0.5];
  return low < high ? [low, high] : [0, 1];
}

// One table with a common first column; rows that a curve does not have stay undefined and make no gap.
function table(curves, xMin, xMax) {
  const joined = uPlot.join([...curves.map(({ x, y }) => [x, y]), [[xMin, xMax], [null, null]]]);
  return joined.slice(0, -1);
}

// The range of the visible values with a margin, kept within the limits of the panel.
function padded(low, high, panel) {
  if (low == null || !Number.isFinite(low) || !Number.isFinite(high)) return panel.log ? [0.1, 1] : [0, 1];
  if (panel.log) {
    const decade = 0.06 * Math.max(1, Math.log10(high / low));
    return [low / 10 ** (2 * decade), high * 10 ** decade];
  }
  if (panel.fixed) return panel.fixed;
  if (panel.limits) [low, high] = [Math.max(low, panel.limits[0]), Math.min(high, panel.limits[1])];
  if (!(high > low)) [low, high] = [low - (Math.abs(low) * 0.1 || 1), low + (Math.abs(low) * 0.1 || 1)];
  const margin = 0.06 * (high - low);
  return [low - margin, high + margin];
}

function logSplits(low, high) {
  const decades = Math.log10(high / low), splits = [];
  if (decades < 0.7) {
    const step = niceStep((high - low) / 6);
    for (let v = Math.ceil(low / step) * step; v <= high * (1 + 1e-9); v += step) splits.push(v);
    return splits;
  }
  const first = Math.floor(Math.log10(low)), every = Math.ceil(decades / 9);
  for (let k = first; 10 ** k <= high; k++) {
    for (let m = 1; m < 10; m++) {
      const v = m * 10 ** k;
      if (v >= low * (1 - 1e-9) && v <= high * (1 + 1e-9) && (decades < 5 || m === 1 && k % every === 0)) splits.push(v);
    }
  }
  return splits;
}

function logLabels(splits) {
  if (splits.length < 2) return splits.map(readOut);
  const decades = Math.log10(splits[splits.length - 1] / splits[0]);
  if (decades < 0.7) return tickLabels(splits);
  const plain = splits[0] >= 1e-2 * (1 - 1e-9) && splits[splits.length - 1] < 1e5;
  const shown = decades > 2.2 ? [1] : decades > 1.2 ? [1, 2, 5] : [1, 2, 3, 5, 7];
  return splits.map(v => {
    const exponent = Math.floor(Math.log10(v) + 1e-9), mantissa = Math.round(v / 10 ** exponent);
    if (!shown.includes(mantissa)) return "";
    if (plain) return String(Number((mantissa * 10 ** exponent).toPrecision(3)));
    return (mantissa === 1 ? "" : mantissa + "×") + "10" + superscript(exponent);
  });
}

function niceStep(rough) {
  const power = 10 ** Math.floor(Math.log10(rough)), mantissa = rough / power;
  return (mantissa < 1.5 ? 1 : mantissa < 3.5 ? 2 : mantissa < 7.5 ? 5 : 10) * power;
}

const fills = (u, [from, to]) => from <= u.scales.x.min && to >= u.scales.x.max;

function shade(u, [from, to]) {
  const { left, top, width, height } = u.bbox;
  const a = Math.max(left, u.valToPos(from, "x", true)), b = Math.min(left + width, u.valToPos(to, "x", true));
  if (b <= a) return;
  u.ctx.fillStyle = colour("--shade");
  u.ctx.fillRect(a, top, b - a, height);
}

function frame(u, stroke) {
  const { left, top, width, height } = u.bbox;
  u.ctx.save();
  u.ctx.strokeStyle = stroke;
  u.ctx.lineWidth = uPlot.pxRatio;
  u.ctx.setLineDash([]);
  u.ctx.strokeRect(left, top, width, height);
  u.ctx.restore();
}

function clipped(u, draw) {
  const { left, top, width, height } = u.bbox;
  u.ctx.save();
  u.ctx.beginPath();
  u.ctx.rect(left, top, width, height);
  u.ctx.clip();
  draw(u.ctx);
  u.ctx.restore();
}

// Points of a measured response, the fainter the lower their coherence.
function scatter(u, curve) {
  clipped(u, ctx => {
    ctx.fillStyle = colour(curve.style.colour);
    curve.x.forEach((x, k) => {
      if (curve.y[k] == null) return;
      ctx.globalAlpha = curve.opacity?.[k] ?? 1;
      ctx.beginPath();
      ctx.arc(u.valToPos(x, "x", true), u.valToPos(curve.y[k], "y", true), 1.7 * uPlot.pxRatio, 0, 7);
      ctx.fill();
    });
  });
}

// Stems of singular values: those kept in colour, those left out in grey, and a line where the order ends.
function stems(u, curve) {
  const ratio = uPlot.pxRatio, { top, height } = u.bbox;
  clipped(u, ctx => {
    curve.x.forEach((x, k) => {
      if (!(curve.y[k] > 0)) return;
      const px = u.valToPos(x, "x", true), py = u.valToPos(curve.y[k], "y", true);
      ctx.strokeStyle = ctx.fillStyle = x <= curve.chosen ? colour(curve.style.colour) : colour("--nominal");
      ctx.lineWidth = (x <= curve.chosen ? 1.8 : 1.1) * ratio;
      ctx.beginPath();
      ctx.moveTo(px, top + height);
      ctx.lineTo(px, py);
      ctx.stroke();
      ctx.beginPath();
      ctx.arc(px, py, (x <= curve.chosen ? 3.4 : 2.4) * ratio, 0, 7);
      ctx.fill();
    });
    const end = u.valToPos(curve.chosen + 0.5, "x", true);
    ctx.strokeStyle = ctx.fillStyle = colour("--ink");
    ctx.lineWidth = ratio;
    ctx.setLineDash([4 * ratio, 3 * ratio]);
    ctx.beginPath();
    ctx.moveTo(end, top);
    ctx.lineTo(end, top + height);
    ctx.stroke();
    ctx.font = `${FONT * ratio}px ${colour("--sans")}`;
    ctx.textAlign = "left";
    ctx.fillText(`order ${curve.chosen}`, end + 6 * ratio, top + 16 * ratio);
  });
}
