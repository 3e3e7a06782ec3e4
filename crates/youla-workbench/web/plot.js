// Curves on uPlot, drawn once and fed anew: for signals and for the predicted loop.

/**
 * @typedef {{ label: string, colour: string, dash?: number[], width?: number }} Line
 * @param {HTMLElement} host
 * @param {{ x: string, y: string, logX?: boolean, logY?: boolean, height?: number, lines: Line[], bands?: [number, number, string][],
 *   hooks?: any, drag?: any, range?: (low: number, high: number) => [number, number], points?: boolean, sync?: string }} what
 */
function curves(host, what) {
  const ink = name => colour(name) || name, width = () => Math.max(240, host.clientWidth || 600);
  const axis = () => ({ stroke: () => ink("--soft"), grid: { stroke: () => ink("--grid"), width: 1 }, ticks: { stroke: () => ink("--grid"), width: 1 }, font: "11px system-ui", labelFont: "11px system-ui" });
  const log = { splits: (u, k, low, high) => logSplits(low, high), filter: (u, splits) => splits, values: (u, splits) => logLabels(splits) };
  const u = new uPlot({
    width: width(), height: what.height ?? 190, padding: [8, 12, 0, 0],
    legend: { show: false },
    cursor: { drag: what.drag ?? { x: true, y: false }, ...(what.sync ? { sync: { key: what.sync } } : {}) },
    scales: { x: { time: false, distr: what.logX ? 3 : 1, ...(what.logX ? { range: (u, low, high) => [low, high] } : {}) }, y: { distr: what.logY ? 3 : 1, ...(what.range ? { range: (u, low, high) => what.range?.(low, high) ?? [low, high] } : {}) } },
    axes: [
      { ...axis(), label: what.x, labelSize: 16, size: 26, space: 60, ...(what.logX ? log : {}) },
      { ...axis(), label: what.y, labelSize: 16, size: 52, space: 26, ...(what.logY ? log : {}) },
    ],
    series: [{}, ...what.lines.map(line => ({ label: line.label, stroke: () => ink(line.colour), width: line.width ?? 1.3, dash: line.dash,
      ...(what.points ? { paths: () => null, points: { show: true, size: 7, fill: () => ink(line.colour), stroke: () => ink(line.colour) } } : { points: { show: false } }) }))],
    bands: (what.bands ?? []).map(([high, low, name]) => ({ series: [high, low], fill: () => `color-mix(in srgb, ${ink(name)} 18%, transparent)` })),
    hooks: what.hooks ?? {},
  }, [[0], ...what.lines.map(() => [null])], host);
  new ResizeObserver(() => { if (Math.abs(u.width - width()) > 1) u.setSize({ width: width(), height: what.height ?? 190 }); }).observe(host);
  matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => u.redraw(false));
  return u;
}

/** Joins curves with their own places into one axis, as uPlot wants them. @param {[number[], number[]][]} all */
const joined = all => uPlot.join(all.map(([x, y]) => [x, y]));

/** The names of the lines of a plot. @param {Line[]} lines */
const key = lines => element("p", { class: "line-key" }, ...lines.map(line => {
  const mark = element("span", { class: "line-mark" });
  mark.style.borderTop = `${line.dash ? "2px dashed" : "2px solid"} var(${line.colour})`;
  return element("span", {}, mark, line.label);
}));
