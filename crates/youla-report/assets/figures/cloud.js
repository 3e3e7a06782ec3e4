// Clouds of points: filled marks, and strips at the edges for what has no place within the axis. In a strip each cloud has a row
// of its own: triangles for values beyond the range of the axis, crosses at the lower edge where there is no value.

const STRIP_ROW = 11, STRIP_GAP = 4, POINT = 2.6;

// Where a value stands in respect of the limits of an axis.
function placeOf(value, [low, high], log) {
  if (value == null || Number.isNaN(value)) return "missing";
  if (value < low || log && !(value > 0)) return "below";
  return value > high ? "above" : "inside";
}

// Limits of the values of a vertical axis: its range, or all that is visible.
function limitsOf(axis, everything, values) {
  if (axis.range && !everything) return axis.range;
  let low = Infinity, high = -Infinity;
  for (const v of values) if (v != null && !(axis.log && v <= 0)) { low = Math.min(low, v); high = Math.max(high, v); }
  return padded(low, high, { log: axis.log });
}

// Ends of an axis of so many pixels that leave room for strips beyond its limits.
function withStrips([low, high], log, height, below, above) {
  const to = log ? Math.log : x => x, from = log ? Math.exp : x => x;
  const perPixel = (to(high) - to(low)) / Math.max(40, height - below - above);
  return [from(to(low) - below * perPixel), from(to(high) + above * perPixel)];
}

const stripHeight = rows => rows ? rows * STRIP_ROW + STRIP_GAP : 0;

// Gives a panel of a stack its clouds. `state` says whether everything is shown, `hidden` which curves are not.
function addClouds(panel, axis, state, hidden) {
  const clouds = panel.curves.filter(curve => curve.cloud), now = {};
  const visible = () => clouds.filter(curve => !hidden.has(curve.id));
  const place = value => placeOf(value, now.limits, axis.log);
  const rows = (...places) => visible().filter(curve => curve.y.some(value => places.includes(place(value))));

  panel.ends = (u, low, high) => {
    const lines = panel.curves.some(curve => !curve.cloud) ? [low, high] : [];
    now.limits = limitsOf(axis, state.everything, [...lines, ...visible().flatMap(curve => curve.y)]);
    now.below = rows("below", "missing");
    now.above = rows("above");
    const room = axis.range && !state.everything ? 5 : 0;
    return withStrips(now.limits, axis.log, panel.height, stripHeight(now.below.length) || room, stripHeight(now.above.length) || room);
  };
  const within = splits => splits.map(v => v == null || place(v) !== "inside" ? null : v);
  panel.ticks = () => ({ filter: (u, splits) => within(splits), grid: { stroke: colour("--grid"), width: 1, filter: (u, splits) => within(splits) },
    ticks: { stroke: colour("--soft"), width: 1, size: 4, filter: (u, splits) => within(splits) } });

  // Position in pixels from the corner of the axes.
  const spot = (u, curve, k) => {
    const where = place(curve.y[k]), height = u.bbox.height / uPlot.pxRatio;
    const row = where === "above" ? STRIP_ROW * (now.above.indexOf(curve) + 0.5)
      : height - STRIP_ROW * (now.below.length - now.below.indexOf(curve) - 0.5);
    return { where, x: u.valToPos(curve.x[k], "x"), y: where === "inside" ? u.valToPos(curve.y[k], "y") : row };
  };
  const marks = (u, curve, shapes) => {
    const paths = new Map(), { left, top, width } = u.bbox, ratio = uPlot.pxRatio, { ctx } = u;
    curve.x.forEach((_, k) => {
      const { where, x, y } = spot(u, curve, k), shape = shapes[where];
      if (shape && x >= -0.5 && x * ratio <= width + 0.5) paths.set(shape, (paths.get(shape) ?? "") + markerPath(shape, left + x * ratio, top + y * ratio, POINT * ratio));
    });
    ctx.save();
    ctx.strokeStyle = ctx.fillStyle = colour(curve.style.colour);
    ctx.lineWidth = 1.3 * ratio;
    ctx.setLineDash([]);
    for (const [shape, path] of paths) isFilled(shape) ? ctx.fill(new Path2D(path)) : ctx.stroke(new Path2D(path));
    ctx.restore();
  };
  for (const curve of clouds) curve.draw = u => { u.ctx.globalAlpha = 0.62; marks(u, curve, { inside: curve.style.point }); u.ctx.globalAlpha = 1; };
  panel.over = u => {
    const { left, top, width, height } = u.bbox, ratio = uPlot.pxRatio;
    const below = stripHeight(now.below.length) * ratio, above = stripHeight(now.above.length) * ratio;
    u.ctx.fillStyle = colour("--shade");
    if (above) u.ctx.fillRect(left, top, width, above - 2 * ratio);
    if (below) u.ctx.fillRect(left, top + height - below + 2 * ratio, width, below - ratio);
    for (const curve of visible()) marks(u, curve, { below: "triangle-down", above: "triangle", missing: "cross" });
    frame(u, colour("--soft"));
  };
  panel.nearest = (u, px, py) => {
    let best = null, distance = 12;
    for (const curve of visible()) {
      curve.x.forEach((x, k) => {
        const { x: sx, y: sy, where } = spot(u, curve, k), d = Math.hypot(sx - px, sy - py);
        if (d < distance) [best, distance] = [{ curve, x, value: curve.y[k], where, at: [sx, sy] }, d];
      });
    }
    return best;
  };
}

// What lies under the pointer, in words.
function readClouds(stacked, panels, spec) {
  const tip = tooltip(stacked.root);
  stacked.plots.forEach((plot, k) => {
    const panel = panels[k];
    if (!panel.nearest) return;
    plot.over.addEventListener("mousemove", event => {
      const found = event.buttons ? null : panel.nearest(plot, event.offsetX, event.offsetY);
      if (!found) return tip.hide();
      const value = found.where === "missing" ? "no value" : `${readOut(found.value)} ${prettyUnit(panel.unit)}` + (found.where === "inside" ? "" : `, ${found.where} the axis`);
      const over = plot.over.getBoundingClientRect(), root = stacked.root.getBoundingClientRect();
      tip.show(`${found.curve.name}\n${spec.x.label} ${readOut(found.x)} ${prettyUnit(spec.x.unit)}\n${panel.label} ${value}`,
        found.at[0] + over.left - root.left, found.at[1] + over.top - root.top);
    });
    plot.over.addEventListener("mouseleave", () => tip.hide());
  });
}
