// Box plots: median, quartiles, whiskers to the last value within 1.5 quartile ranges, values beyond as points.

const BOX_HEIGHT = 300, BOX_LEFT = 62, BOX_WIDEST = 46;

// Quartiles are interpolated linearly between the sorted values (definition 7 of Hyndman and Fan 1996).
function spread(values) {
  const sorted = values.filter(v => v != null).sort((a, b) => a - b);
  if (!sorted.length) return null;
  const at = share => {
    const place = share * (sorted.length - 1), k = Math.floor(place);
    return place === k ? sorted[k] : sorted[k] + (place - k) * (sorted[k + 1] - sorted[k]);
  };
  const [q1, median, q3] = [0.25, 0.5, 0.75].map(at), reach = 1.5 * (q3 - q1);
  const inner = sorted.filter(v => v >= q1 - reach && v <= q3 + reach);
  return { q1, median, q3, low: Math.min(q1, inner[0] ?? q1), high: Math.max(q3, inner[inner.length - 1] ?? q3),
    beyond: sorted.filter(v => v < q1 - reach || v > q3 + reach) };
}

function boxes(host, panel, state) {
  const samples = panel.content.boxes.map(sample => ({ ...sample, ...methodOf(sample.method), spread: spread(sample.values) }));
  const { y } = panel, counts = samples.map(() => element("span", { class: "counts" }));
  const plot = element("div", { class: "boxes" });
  const names = element("div", { class: "box-names" }, ...samples.map((sample, k) =>
    element("div", { "aria-hidden": "true" }, element("span", { class: "name" }, sample.label), sample.note ? element("span", { class: "name" }, sample.note) : null, counts[k])));
  host.replaceChildren(...(panel.title ? [element("p", { class: "panel-title" }, panel.title)] : []), plot, names);
  names.style.setProperty("--boxes", samples.length);
  const observer = new ResizeObserver(draw);
  observer.observe(host);
  draw();
  return { destroy() { observer.disconnect(); host.replaceChildren(); }, refit: draw };

  function draw() {
    const width = Math.max(200, host.clientWidth), frame = { x: BOX_LEFT, y: 8, w: width - BOX_LEFT - RIGHT, h: BOX_HEIGHT };
    const limits = limitsOf(y, state.everything, samples.flatMap(sample => sample.values));
    const count = (sample, where) => sample.values.filter(v => placeOf(v, limits, y.log) === where).length;
    const any = where => samples.some(sample => count(sample, where));
    const strip = where => any(where) ? stripHeight(1) : y.range && !state.everything ? 5 : 0;
    const [below, above] = [strip("below"), strip("above")];
    const [low, high] = withStrips(limits, y.log, frame.h, below, above);
    const to = y.log ? Math.log : v => v;
    const py = v => frame.y + (to(high) - to(Math.min(Math.max(v, limits[0]), limits[1]))) / (to(high) - to(low)) * frame.h;
    const slot = frame.w / samples.length;
    const shade = (top, height) => `<rect x="${frame.x}" y="${top}" width="${frame.w}" height="${height}" fill="var(--shade)"/>`;
    plot.innerHTML = `<svg width="${width}" height="${frame.h + 16}" role="group">
      ${any("above") ? shade(frame.y, above - 2) : ""}${any("below") ? shade(frame.y + frame.h - below + 2, below - 2) : ""}
      ${boxAxis(y, limits, py, frame)}
      ${samples.map((sample, k) => `<g class="box" tabindex="0" role="img">${boxMarks(sample, frame.x + (k + 0.5) * slot, slot)}</g>`).join("")}
      <rect x="${frame.x}" y="${frame.y}" width="${frame.w}" height="${frame.h}" fill="none" stroke="var(--soft)"/></svg>`;
    plot.querySelector(".axis-name").textContent = withUnit(y.label, y.unit);
    const tip = tooltip(plot);
    plot.querySelectorAll(".box").forEach((node, k) => {
      const text = inWords(samples[k]);
      node.setAttribute("aria-label", text.replaceAll("\n", ", "));
      const show = () => tip.show(text, frame.x + (k + 0.5) * slot + Math.min(BOX_WIDEST, 0.56 * slot) / 2 - 6, 16);
      node.addEventListener("pointerenter", show);
      node.addEventListener("focus", show);
      node.addEventListener("pointerleave", () => tip.hide());
      node.addEventListener("blur", () => tip.hide());
    });
    samples.forEach((sample, k) => { counts[k].textContent = countsOf(sample); });

    function countsOf(sample) {
      const [missing, outside] = [count(sample, "missing"), count(sample, "below") + count(sample, "above")];
      return [missing ? `${missing} of ${sample.values.length} failed` : "", outside ? `${outside} outside` : ""].filter(Boolean).join("\n");
    }

    function boxMarks(sample, x, slot) {
      const half = Math.min(BOX_WIDEST, 0.56 * slot) / 2, parts = [];
      const area = `<rect x="${x - slot / 2}" y="${frame.y}" width="${slot}" height="${frame.h}" fill="transparent"/>`;
      const edge = (where, shape, y) => count(sample, where) ? `<path d="${markerPath(shape, x, y, 4)}" fill="var(${sample.style.colour})"/>` : "";
      const edges = edge("above", "triangle", frame.y + STRIP_ROW / 2 + 1) + edge("below", "triangle-down", frame.y + frame.h - STRIP_ROW / 2 - 1);
      if (!sample.spread) return area + edges;
      const { q1, median, q3, low, high, beyond } = sample.spread;
      const inside = v => placeOf(v, limits, y.log) === "inside";
      for (const [quartile, whisker] of [[q1, low], [q3, high]]) {
        parts.push(`M${x} ${py(quartile)}V${py(whisker)}` + (inside(whisker) ? `M${x - half / 2} ${py(whisker)}h${half}` : ""));
      }
      const body = py(q1) > py(q3) || inside(q1) ? `<rect x="${x - half}" y="${py(q3)}" width="${2 * half}" height="${py(q1) - py(q3)}" fill="var(${sample.style.colour})" fill-opacity=".22"/>` : "";
      const line = inside(median) ? `<path d="M${x - half} ${py(median)}h${2 * half}" stroke-width="3"/>` : "";
      const points = beyond.filter(inside).map(v => `<circle cx="${x}" cy="${py(v).toFixed(1)}" r="2.1"/>`).join("");
      return `${area}<g stroke="var(${sample.style.colour})" stroke-width="1.4" fill="none">${body}<path d="${parts.join("")}"/>${line}${points}</g>${edges}`;
    }
  }

  function inWords(sample) {
    const name = [sample.label, sample.note].filter(Boolean).join(", "), failed = sample.values.filter(v => v == null).length;
    const value = v => `${readOut(v)}${y.unit ? ` ${prettyUnit(y.unit)}` : ""}`;
    const s = sample.spread;
    const lines = s ? [`upper whisker ${value(s.high)}`, `upper quartile ${value(s.q3)}`, `median ${value(s.median)}`, `lower quartile ${value(s.q1)}`, `lower whisker ${value(s.low)}`] : [];
    const rest = `${sample.values.length - failed} values` + (s?.beyond.length ? `, ${s.beyond.length} beyond the whiskers` : "") + (failed ? `, ${failed} failed` : "");
    return [name, ...lines, rest].join("\n");
  }
}

// Grid, labels and name of the vertical axis.
function boxAxis(axis, limits, py, frame) {
  const splits = axis.log ? logSplits(...limits) : linearSplits(...limits, frame.h / 45);
  const labels = axis.log ? logLabels(splits) : tickLabels(splits);
  const rows = splits.map((v, k) => `<path d="M${frame.x} ${py(v)}h${frame.w}" stroke="var(--grid)"/><path d="M${frame.x} ${py(v)}h-4" stroke="var(--soft)"/>` +
    `<text x="${frame.x - 8}" y="${py(v)}" text-anchor="end" dominant-baseline="central">${labels[k]}</text>`);
  return rows.join("") + `<text class="axis-name" transform="translate(10 ${frame.y + frame.h / 2}) rotate(-90)" text-anchor="middle" dominant-baseline="central"></text>`;
}

function linearSplits(low, high, count) {
  const step = niceStep((high - low) / count), splits = [];
  for (let v = Math.ceil(low / step - 1e-9) * step; v <= high + step * 1e-9; v += step) splits.push(v);
  return splits;
}
