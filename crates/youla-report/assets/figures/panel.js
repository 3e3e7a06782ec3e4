// One pair of axes. Lines that rise along the horizontal axis are those of uPlot; areas, guides, loci, points, marks and boxes are
// drawn on its canvas. What a cloud has beyond the vertical range stands in a strip at that edge, a row for each cloud: triangles for
// values beyond, crosses at the lower edge where there is no value.

const LEFT = 86, RIGHT = 20, FONT = 12, STRIP = 11, GAP = 4, MARKS = { points: 2.3, dots: 3.6, marks: 3.6 };
const rising = list => list.every((v, k) => k === 0 || v >= list[k - 1]);
const isWhole = lists => lists.every(list => list.every(v => v == null || Number.isInteger(v)));

// Smallest and largest value, with a margin; of a logarithmic axis in decades.
function padded(values, log, share = 0.06) {
  let low = Infinity, high = -Infinity;
  for (const v of values) if (v != null && Number.isFinite(v) && !(log && v <= 0)) { if (v < low) low = v; if (v > high) high = v; }
  if (low > high) return log ? [0.1, 1] : [0, 1];
  if (log) { const room = share * Math.max(1, Math.log10(high / low)); return [low / 10 ** room, high * 10 ** room]; }
  const room = high > low ? share * (high - low) : Math.abs(low) * 0.1 || 1;
  return [low - room, high + room];
}

function placeOf(value, [low, high], log) {
  if (value == null || Number.isNaN(value)) return "missing";
  if (value < low || log && !(value > 0)) return "below";
  return value > high ? "above" : "inside";
}

// Whether the name of a vertical axis is longer than the axis.
const ruler = document.createElement("canvas").getContext("2d");
function isTooLong(axis, height) {
  ruler.font = `${FONT}px ${colour("--sans")}`;
  return ruler.measureText(withUnit(axis)).width > height;
}

// Places of neighbouring points where an area is, one list for each piece without a gap.
function pieces({ high }) {
  const found = [];
  high.forEach((v, k) => {
    if (v == null) return;
    k > 0 && high[k - 1] != null ? found[found.length - 1].push(k) : found.push([k]);
  });
  return found;
}

// `at` says how the panel stands: { last, named, x, extent, width, height, key, legend, state, view, zoomed, moved }.
function makePlot(root, panel, at) {
  const { y } = panel, { legend, state, height } = at, curves = panel.content.curves ?? [], boxes = boxesOf(panel);
  const lines = curves.filter(c => c.drawn === "line"), plain = lines.filter(c => !panel.equal && rising(c.x)), traced = lines.filter(c => !plain.includes(c));
  const clouds = boxes ?? curves.filter(c => c.drawn === "points"), marks = curves.filter(c => c.drawn === "dots" || c.drawn === "marks");
  const shown = list => list.filter(item => !legend.hidden.has(idOf(item)));
  const place = value => placeOf(value, now.limits, y.log), ink = item => colour(styleOf(item.method).colour);
  const now = { limits: [0, 1], below: [], above: [] };
  const ratio = () => uPlot.pxRatio, bounded = v => Math.max(-1e5, Math.min(1e5, v)), X = v => bounded(u.valToPos(v, "x", true)), Y = v => bounded(u.valToPos(v, "y", true));
  const u = new uPlot(options(), uPlot.join([...plain.map(c => [c.x, c.y]), [at.extent, [null, null]]]), root), tip = tooltip(root);
  u.over.addEventListener("mousemove", hover);
  u.over.addEventListener("mouseleave", tip.hide);
  return { u, plain, tip, value: (curve, row) => u.data[plain.indexOf(curve) + 1][row] };

  function options() {
    const soft = colour("--soft"), font = `${FONT}px ${colour("--sans")}`, label = axis => withUnit(axis);
    const inside = (u, splits) => splits.map(v => v == null || clouds.length && place(v) !== "inside" ? null : v);
    const axis = { stroke: colour("--ink"), font, labelFont: font, grid: { stroke: colour("--grid"), width: 1 }, ticks: { stroke: soft, width: 1, size: 4 }, gap: 4 };
    const log = { splits: (u, k, low, high) => logSplits(low, high), filter: (u, splits) => splits, values: (u, splits) => logLabels(splits) };
    const steps = whole => whole ? { incrs: [1, 2, 5, 10, 20, 50, 100, 200, 500, 1000, 5000, 20000] } : {};
    const { also } = panel.x, other = also && { ...axis, scale: "x", side: 0, space: 64, size: 26, label: withUnit(also), labelSize: 20, grid: { show: false }, filter: (u, splits) => splits,
      splits: (u, k, low, high) => logSplits(low * also.factor, high * also.factor).map(v => v / also.factor), values: (u, splits) => logLabels(splits.map(v => v * also.factor)) };
    return {
      width: at.width, height: height + (at.last ? 46 : 10) + (also ? 46 : 0), padding: [also ? 0 : 8, RIGHT, at.last ? 0 : 2, 0], legend: { show: false },
      cursor: {
        y: false, points: { size: 6, width: 0, fill: (u, k) => u.series[k].stroke(u, k) }, focus: { prox: -1 },
        drag: { x: !boxes, y: !!panel.equal, dist: 4, setScale: !panel.equal },
        ...(panel.equal ? { x: false, bind: { dblclick: () => () => at.zoomed() } } : { sync: { key: at.key, setSeries: false, scales: ["x", null] } }),
      },
      scales: { x: { time: false, distr: at.x.log ? 3 : 1, range: (u, low, high) => [low, high] }, y: { distr: y.log ? 3 : 1, range: (u, low, high) => ends(low, high) } },
      axes: [
        { ...axis, space: 64, size: at.last ? 26 : 4, label: at.last && !boxes ? label(at.x) : null, labelSize: boxes ? 0 : 20, ...steps(at.whole), ...(at.x.log ? log : {}),
          values: (u, splits) => !at.last || boxes ? splits.map(() => "") : at.x.log ? logLabels(splits) : tickLabels(splits), ...(boxes ? { grid: { show: false }, ticks: { show: false } } : {}) },
        { ...axis, space: height < 120 ? 18 : 30, size: LEFT - 18, labelSize: 18, labelGap: 0, label: at.named ? prettyUnit(y.unit) || null : label(y), values: (u, splits) => tickLabels(splits),
          ...steps(curves.length && isWhole(curves.map(c => c.y))), ...(y.unit === "deg" ? { incrs: [5, 15, 30, 45, 90, 180, 360, 720] } : {}), ...(y.log ? log : {}),
          ...(clouds.length ? { filter: inside, grid: { ...axis.grid, filter: inside }, ticks: { ...axis.ticks, filter: inside } } : {}) },
        ...(other ? [other] : []),
      ],
      series: [{}, ...plain.map(c => ({ show: !legend.hidden.has(idOf(c)), stroke: ink(c), width: 2 * styleOf(c.method).width, dash: (legend.entry(c)?.dash ?? []).map(d => 2 * d), points: { show: false } }))],
      hooks: { drawClear: [shades], drawAxes: [behind], draw: [above], setScale: [(u, scale) => { if (scale === "x") at.moved(u); }], setCursor: [at.read], setSelect: [selected] },
    };
  }

  // Ends of the vertical axis: its range, or all that is shown, and room for the strips.
  function ends(low, high) {
    if (panel.equal) return now.limits = at.view.y;
    const given = y.range && !state.everything, rest = [...shown(clouds), ...shown(marks), ...shown(traced)].map(c => c.y);
    const areas = shown(panel.regions ?? []).flatMap(r => [r.low, r.high]);
    now.limits = given ? y.range : padded([low, high, ...[...rest, ...areas].flat()], y.log);
    const rows = (...places) => shown(clouds).filter(c => c.y.some(v => places.includes(place(v))));
    [now.below, now.above] = [rows("below", boxes ? "below" : "missing"), rows("above")];
    const [to, from] = y.log ? [Math.log, Math.exp] : [v => v, v => v], [below, above] = [strip(now.below), strip(now.above)];
    const perPixel = (to(now.limits[1]) - to(now.limits[0])) / Math.max(40, height - below - above);
    return [from(to(now.limits[0]) - below * perPixel), from(to(now.limits[1]) + above * perPixel)];
  }
  function strip(rows) { return rows.length ? (boxes ? 1 : rows.length) * STRIP + GAP : clouds.length && y.range && !state.everything ? 5 : 0; }

  function clipped(draw) {
    const { left, top, width, height } = u.bbox, { ctx } = u;
    ctx.save();
    ctx.beginPath();
    ctx.rect(left, top, width, height);
    ctx.clip();
    draw(ctx);
    ctx.restore();
  }

  function shades(u) {
    const { left, top, width, height } = u.bbox;
    for (const [from, to] of panel.shades ?? []) {
      const a = Math.max(left, X(from)), b = Math.min(left + width, X(to));
      u.ctx.fillStyle = colour("--shade");
      if (b > a) u.ctx.fillRect(a, top, b - a, height);
    }
  }

  function stroke(ctx, xs, ys, style, width, dash = []) {
    let pen = false;
    ctx.beginPath();
    xs.forEach((x, k) => {
      const there = x != null && ys[k] != null;
      if (there) pen ? ctx.lineTo(X(x), Y(ys[k])) : ctx.moveTo(X(x), Y(ys[k]));
      pen = there;
    });
    Object.assign(ctx, { strokeStyle: style, lineWidth: width * ratio() });
    ctx.setLineDash(dash.map(d => d * ratio()));
    ctx.stroke();
  }

  // Areas, guides, clouds and loci: beneath the lines.
  function behind() {
    clipped(ctx => {
      for (const region of shown(panel.regions ?? [])) {
        Object.assign(ctx, { fillStyle: ink(region), globalAlpha: styleOf(region.method).order ? 0.24 : 0.12 });
        ctx.beginPath();
        for (const piece of pieces(region)) {
          piece.forEach((k, n) => ctx[n ? "lineTo" : "moveTo"](X(region.x[k]), Y(region.high[k])));
          // An area without a lower edge is open: it ends at the frame.
          piece.reverse().forEach(k => ctx.lineTo(X(region.x[k]), region.low[k] == null ? ctx.canvas.height : Y(region.low[k])));
          ctx.closePath();
        }
        ctx.fill();
      }
      ctx.globalAlpha = 1;
      for (const { kind, x, y } of panel.guides ?? []) stroke(ctx, x, y, colour({ boundary: "--ink", level: "--soft" }[kind] ?? "--rule"), kind === "boundary" ? 1.3 : 1, kind === "level" ? [5, 4] : []);
      if (!boxes) for (const cloud of shown(clouds)) scatter(ctx, cloud, legend.entry(cloud)?.hollow);
      for (const c of shown(traced)) stroke(ctx, c.x, c.y, ink(c), 2 * styleOf(c.method).width * (c.drawn === "line" && c.note ? 0.6 : 1), (legend.entry(c)?.dash ?? []).map(d => 2 * d));
      names(ctx, guide => guide.kind === "grid");
    });
    frame();
  }

  // Position in pixels of the canvas, and where the value lies.
  function spot(curve, k) {
    const inPlot = curve.drawn !== "points" || panel.equal, where = inPlot ? "inside" : place(curve.y[k]), { top, height } = u.bbox;
    const row = where === "above" ? top + STRIP * (now.above.indexOf(curve) + 0.5) * ratio() : top + height - STRIP * (now.below.length - now.below.indexOf(curve) - 0.5) * ratio();
    return { where, x: X(curve.x[k]), y: where === "inside" ? Y(curve.y[k]) : row };
  }

  function scatter(ctx, curve, hollow) {
    const { marker } = styleOf(curve.method), shapes = { inside: curve.drawn === "dots" ? solid(marker) : marker, below: "down", above: "up", missing: "cross" };
    const paths = { inside: [], below: [], above: [], missing: [] }, fine = curve.drawn === "points", size = MARKS[curve.drawn] * (curve.x.length > 1000 ? 0.8 : 1) * ratio();
    curve.x.forEach((x, k) => {
      const { where, x: px, y: py } = spot(curve, k);
      if (x != null && (where !== "inside" || curve.y[k] != null)) paths[where].push(markerPath(shapes[where], px, py, size));
    });
    Object.assign(ctx, { strokeStyle: ink(curve), fillStyle: ink(curve), lineWidth: (fine ? 1.1 : 1.4) * ratio(), globalAlpha: fine ? 0.7 : 1 });
    ctx.setLineDash([]);
    for (const [where, list] of Object.entries(paths)) {
      const path = new Path2D(list.join("")), filled = isFilled(shapes[where]) && curve.drawn !== "marks" && !hollow;
      filled ? ctx.fill(path) : ctx.stroke(path);
      if (curve.drawn === "dots") ctx.stroke(path);
    }
    ctx.globalAlpha = 1;
  }

  // Marks, boxes, strips and names of guides: above the lines.
  function above() {
    const { left, top, width, height } = u.bbox, [below, over] = [strip(now.below) * ratio(), strip(now.above) * ratio()];
    clipped(ctx => {
      Object.assign(ctx, { strokeStyle: colour("--grid"), lineWidth: ratio() });
      ctx.setLineDash([]);
      for (const edge of [now.above.length && top + over, now.below.length && top + height - below]) if (edge) ctx.strokeRect(left - 9, edge, width + 18, 0);
      for (const curve of shown(marks)) scatter(ctx, curve, false);
      boxes?.forEach((sample, k) => drawBox(ctx, sample, { centre: X(k), half: Math.min(46 * ratio(), 0.56 * (X(1) - X(0))) / 2, at: v => Y(Math.min(Math.max(v, now.limits[0]), now.limits[1])),
        place, ink: ink(sample), ratio: ratio(), edges: { below: top + height - STRIP / 2 * ratio(), above: top + STRIP / 2 * ratio() } }));
      names(ctx, guide => guide.kind !== "grid");
    });
    frame();
  }

  function names(ctx, wanted) {
    const { left, top, width, height } = u.bbox, taken = [], middle = [left + width / 2, top + height / 2];
    const seen = ([x, y]) => x >= left && x <= left + width && y >= top && y <= top + height;
    Object.assign(ctx, { font: `${11 * ratio()}px ${colour("--sans")}`, textAlign: "center", textBaseline: "middle" });
    for (const { kind, label, at: [ax, ay], x, y } of (panel.guides ?? []).filter(guide => guide.label && wanted(guide))) {
      const places = [[X(ax), Y(ay)], ...(kind === "grid" ? x.map((v, k) => [X(v), Y(y[k])]).sort((a, b) => Math.hypot(a[0] - middle[0], a[1] - middle[1]) - Math.hypot(b[0] - middle[0], b[1] - middle[1])) : [])];
      const found = places.find(seen), half = ctx.measureText(label).width / 2 + 3 * ratio(), dot = kind === "point", tall = 7 * ratio();
      if (!found) continue;
      const px = Math.min(Math.max(found[0] + (dot ? half + 4 * ratio() : 0), left + half), left + width - half), py = Math.max(found[1] - (dot ? tall : 0), top + tall);
      if (taken.some(([a, b, h]) => Math.abs(a - px) < half + h && Math.abs(b - py) < 2 * tall)) continue;
      taken.push([px, py, half]);
      Object.assign(ctx, { lineWidth: 3 * ratio(), strokeStyle: colour("--paper"), fillStyle: colour("--soft") });
      ctx.strokeText(label, px, py);
      ctx.fillText(label, px, py);
      ctx.fillStyle = colour("--ink");
      if (dot) ctx.fill(new Path2D(markerPath("circle", ...found, 2.6 * ratio())));
    }
  }

  function frame() {
    const { left, top, width, height } = u.bbox, { ctx } = u;
    Object.assign(ctx, { strokeStyle: colour("--soft"), lineWidth: ratio() });
    ctx.setLineDash([]);
    ctx.strokeRect(left, top, width, height);
  }

  function selected(u) {
    const { left, top, width, height } = u.select;
    if (!panel.equal || width <= 5 || height <= 5) return;
    at.zoomed([u.posToVal(left, "x"), u.posToVal(left + width, "x")], [u.posToVal(top + height, "y"), u.posToVal(top, "y")]);
    u.setSelect({ left: 0, top: 0, width: 0, height: 0 }, false);
  }

  // What lies nearest to the pointer, in words.
  function hover(event) {
    const [px, py] = [event.offsetX * ratio() + u.bbox.left, event.offsetY * ratio() + u.bbox.top];
    const box = boxes && !event.buttons ? boxes[Math.round(u.posToVal(event.offsetX, "x"))] : null;
    let best = box ? { text: box.words, x: px, y: py } : null, distance = 13 * ratio();
    if (!boxes && !event.buttons) for (const curve of [...shown(clouds), ...shown(marks), ...(panel.equal ? shown(traced) : [])]) curve.x.forEach((x, k) => {
      const { where, x: sx, y: sy } = spot(curve, k), d = Math.hypot(sx - px, sy - py);
      if (d < distance && (where !== "inside" || curve.y[k] != null)) [best, distance] = [{ curve, k, where, x: sx, y: sy }, d];
    });
    if (!best) return tip.hide();
    const over = u.over.getBoundingClientRect(), host = root.getBoundingClientRect();
    tip.show(best.text ?? inWords(best), (best.x - u.bbox.left) / ratio() + over.left - host.left, (best.y - u.bbox.top) / ratio() + over.top - host.top);
  }

  function inWords({ curve, k, where }) {
    const value = where === "missing" ? "no value" : valued(curve.y[k], y.unit) + (where === "inside" ? "" : `, ${where} the axis`);
    const along = panel.along && curve.along?.[k] != null ? `${panel.along.label} ${valued(curve.along[k], panel.along.unit)}` : null;
    return [nameOf(curve), ...(curve.details?.[k] ? [curve.details[k]] : [along, `${at.x.label} ${valued(curve.x[k], at.x.unit)}`, `${y.label} ${value}`])].filter(Boolean).join("\n");
  }
}
