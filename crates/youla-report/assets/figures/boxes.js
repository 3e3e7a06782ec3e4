// Boxes: median, quartiles, whiskers to the last value within 1.5 quartile ranges, values beyond as points.

// The samples of a panel with what is drawn of them. Quartiles are interpolated linearly (definition 7 of Hyndman and Fan 1996).
function boxesOf({ content, y }) {
  return content.boxes?.map(sample => {
    const sorted = sample.values.filter(v => v != null).sort((a, b) => a - b), failed = sample.values.length - sorted.length;
    const at = share => { const place = share * (sorted.length - 1), k = Math.floor(place); return place === k ? sorted[k] : sorted[k] + (place - k) * (sorted[k + 1] - sorted[k]); };
    const [q1, median, q3] = [0.25, 0.5, 0.75].map(at), reach = 1.5 * (q3 - q1), inner = sorted.filter(v => v >= q1 - reach && v <= q3 + reach);
    const spread = sorted.length ? { q1, median, q3, low: Math.min(q1, inner[0] ?? q1), high: Math.max(q3, inner[inner.length - 1] ?? q3), beyond: sorted.filter(v => v < q1 - reach || v > q3 + reach) } : null;
    const said = spread ? [["upper whisker", "high"], ["upper quartile", "q3"], ["median", "median"], ["lower quartile", "q1"], ["lower whisker", "low"]].map(([name, key]) => `${name} ${valued(spread[key], y.unit)}`) : [];
    const rest = `${sorted.length} values` + (spread?.beyond.length ? `, ${spread.beyond.length} beyond the whiskers` : "") + (failed ? `, ${failed} failed` : "");
    return { ...sample, y: sample.values, spread, failed, words: [nameOf(sample), ...said, rest].join("\n") };
  });
}

function drawBox(ctx, { spread, y }, { centre, half, at, place, ink, ratio, edges }) {
  const line = (...points) => { ctx.beginPath(); points.forEach(([x, y], k) => k ? ctx.lineTo(x, y) : ctx.moveTo(x, y)); ctx.stroke(); };
  const inside = v => place(v) === "inside";
  ctx.strokeStyle = ctx.fillStyle = ink;
  ctx.lineWidth = 1.4 * ratio;
  for (const [edge, marker] of [["below", "down"], ["above", "up"]]) if (y.some(v => place(v) === edge)) ctx.fill(new Path2D(markerPath(marker, centre, edges[edge], 4 * ratio)));
  if (!spread) return;
  for (const [quartile, whisker] of [[spread.q1, spread.low], [spread.q3, spread.high]]) {
    line([centre, at(quartile)], [centre, at(whisker)]);
    if (inside(whisker)) line([centre - half / 2, at(whisker)], [centre + half / 2, at(whisker)]);
  }
  const box = [centre - half, at(spread.q3), 2 * half, at(spread.q1) - at(spread.q3)];
  if (box[3] > 0 || inside(spread.q1)) {
    ctx.globalAlpha = 0.22;
    ctx.fillRect(...box);
    ctx.globalAlpha = 1;
    ctx.strokeRect(...box);
  }
  for (const v of spread.beyond.filter(inside)) ctx.stroke(new Path2D(markerPath("circle", centre, at(v), 2.1 * ratio)));
  ctx.lineWidth = 3 * ratio;
  if (inside(spread.median)) line([centre - half, at(spread.median)], [centre + half, at(spread.median)]);
}

// Names below the boxes, and what is not drawn of them; each can have the focus and is then read.
function boxNames(plot, boxes, limits, log) {
  const names = element("div", { class: "box-names" }, ...boxes.map(sample => {
    const outside = sample.values.filter(v => ["below", "above"].includes(placeOf(v, limits, log))).length;
    const counts = [sample.failed ? `${sample.failed} of ${sample.values.length} failed` : "", outside ? `${outside} outside` : ""].filter(Boolean).join("\n");
    const node = element("div", { tabindex: 0, role: "img", "aria-label": sample.words.replaceAll("\n", ", "), onfocus: () => plot.tip.show(sample.words, node.offsetLeft, 16), onblur: () => plot.tip.hide() },
      element("span", {}, styleOf(sample.method).label), sample.note ? element("span", {}, sample.note) : null, element("span", { class: "counts" }, counts));
    return node;
  }));
  names.style.setProperty("--boxes", boxes.length);
  return names;
}
