// Data, colours, markers and number formats that all figures share.

const report = JSON.parse(document.getElementById("report-data").textContent);

// Colour and line of each role; colours are custom properties of the style sheet, one per method throughout. `marker` is drawn
// by lines and stands in pole maps; `point` is filled and stands in clouds, where a cross means that there is no value.
const ROLE_STYLES = {
  nominal: { colour: "--nominal", dash: [3, 3], width: 1.6, marker: "diamond", point: "plus" },
  pem: { colour: "--pem", dash: [11, 3], width: 1.7, marker: "triangle", point: "triangle" },
  pem_multi_start: { colour: "--pem-multi-start", dash: [5, 2], width: 1.7, marker: "triangle-down", point: "triangle-down" },
  direct: { colour: "--direct", dash: [9, 3, 2, 3], width: 1.7, marker: "square", point: "square" },
  hansen: { colour: "--hansen", dash: [], width: 1.9, marker: "cross", point: "circle" },
  hansen_pem: { colour: "--hansen-pem", dash: [14, 2, 2, 2], width: 1.8, marker: "hourglass", point: "diamond" },
  hansen_reduced: { colour: "--hansen-reduced", dash: [7, 4], width: 1.7, marker: "circle", point: "diamond" },
};
const OTHER_STYLES = [
  { colour: "--other-1", dash: [12, 3], width: 1.6, marker: "plus", point: "plus" },
  { colour: "--other-2", dash: [5, 2], width: 1.6, marker: "star", point: "circle" },
  { colour: "--other-3", dash: [2, 2], width: 1.6, marker: "hourglass", point: "square" },
  { colour: "--other-4", dash: [10, 3, 2, 3, 2, 3], width: 1.6, marker: "bar", point: "diamond" },
];
const MEASURED = { colour: "--measured", dash: [], width: 1.3, point: "circle" };
const INDIRECT = { colour: "--indirect", dash: [], width: 0.8, points: true };

const methods = new Map([["measured", { key: "measured", label: "measured", style: MEASURED }]]);
{
  let others = 0;
  for (const method of report.methods) {
    const style = ROLE_STYLES[method.role] ?? OTHER_STYLES[others++ % OTHER_STYLES.length];
    methods.set(method.key, { ...method, style });
  }
}
const methodOf = key => methods.get(key) ?? { key, label: key, style: OTHER_STYLES[0] };

const colour = name => getComputedStyle(document.documentElement).getPropertyValue(name).trim();

// A path around (x, y) of half-width r.
function markerPath(shape, x, y, r) {
  const at = (dx, dy) => `${(x + dx * r).toFixed(2)},${(y + dy * r).toFixed(2)}`;
  switch (shape) {
    case "cross": return `M${at(-1, -1)}L${at(1, 1)}M${at(-1, 1)}L${at(1, -1)}`;
    case "plus": return `M${at(-1.2, 0)}L${at(1.2, 0)}M${at(0, -1.2)}L${at(0, 1.2)}`;
    case "star": return markerPath("plus", x, y, r) + markerPath("cross", x, y, 0.75 * r);
    case "square": return `M${at(-1, -1)}L${at(1, -1)}L${at(1, 1)}L${at(-1, 1)}Z`;
    case "diamond": return `M${at(0, -1.3)}L${at(1.3, 0)}L${at(0, 1.3)}L${at(-1.3, 0)}Z`;
    case "triangle": return `M${at(0, -1.2)}L${at(1.1, 0.8)}L${at(-1.1, 0.8)}Z`;
    case "triangle-down": return `M${at(0, 1.2)}L${at(1.1, -0.8)}L${at(-1.1, -0.8)}Z`;
    case "hourglass": return `M${at(-1, -1.1)}L${at(1, -1.1)}L${at(-1, 1.1)}L${at(1, 1.1)}Z`;
    case "bar": return `M${at(0, -1.3)}L${at(0, 1.3)}`;
    default: return `M${at(-1.1, 0)}a${1.1 * r},${1.1 * r} 0 1 0 ${2.2 * r},0a${1.1 * r},${1.1 * r} 0 1 0 ${-2.2 * r},0Z`;
  }
}

// The short line that names a curve in legends and tables.
function swatch(style, withMarker = false) {
  const marker = withMarker && style.marker
    ? `<path d="${markerPath(style.marker, 15, 5, 3.6)}" fill="none" stroke="var(${style.colour})" stroke-width="1.5"/>` : "";
  const points = [4, 11, 19, 26].map(x => `<circle cx="${x}" cy="5" r="2" fill="var(${style.colour})"/>`).join("");
  const line = `<line x1="0" y1="5" x2="30" y2="5" stroke="var(${style.colour})" stroke-width="2" stroke-dasharray="${style.dash.join(" ")}"/>`;
  return `<svg width="30" height="10" aria-hidden="true">${style.points ? points : withMarker ? "" : line}${marker}</svg>`;
}

// Shapes that have an area are filled in clouds.
const isFilled = shape => !["plus", "cross", "star", "bar"].includes(shape);

// The same for a cloud of points and for an area.
function pointSwatch({ colour, point }) {
  const paint = isFilled(point) ? `fill="var(${colour})"` : `fill="none" stroke="var(${colour})" stroke-width="1.6"`;
  return `<svg width="30" height="10" aria-hidden="true">${[6, 15, 24].map(x => `<path d="${markerPath(point, x, 5, 2.8)}" ${paint}/>`).join("")}</svg>`;
}
const keySwatch = style => `<svg width="30" height="10" aria-hidden="true">${swatch(style)}<path d="${markerPath(style.point, 15, 5, 3.4)}" fill="${isFilled(style.point) ? `var(${style.colour})` : "none"}" stroke="var(${style.colour})" stroke-width="1.4"/></svg>`;
const areaSwatch = ({ colour }) => `<svg width="30" height="10" aria-hidden="true"><rect x="8" y="-1" width="14" height="12" rx="2" fill="var(${colour})" fill-opacity=".7"/></svg>`;

const SUPERSCRIPTS = "⁰¹²³⁴⁵⁶⁷⁸⁹";
const superscript = n => String(n).replace("-", "⁻").replace(/\d/g, d => SUPERSCRIPTS[d]);
const minus = text => text.replace("-", "−");
const grouped = n => String(n).replace(/\B(?=(\d{3})+$)/g, "\u202f");

// Four significant digits for reading out.
function readOut(value) {
  if (value == null || !Number.isFinite(value)) return "–";
  const size = Math.abs(value);
  if (size !== 0 && (size < 1e-3 || size >= 1e6)) {
    const exponent = Math.floor(Math.log10(size));
    return minus((value / 10 ** exponent).toFixed(2)) + "×10" + superscript(exponent);
  }
  const places = size === 0 ? 0 : Math.max(0, Math.min(6, 3 - Math.floor(Math.log10(size))));
  return minus(value.toFixed(places));
}

// The same in a sentence, without zeros at the end.
const inProse = value => readOut(value).replace(/(\.\d*?)0+(?=$|×)/, "$1").replace(/\.(?=$|×)/, "");

// Labels of an axis: as many decimals as the increment needs, a power of ten where numbers are very small or large.
function tickLabels(splits) {
  const finite = splits.filter(v => v != null);
  const largest = Math.max(...finite.map(Math.abs));
  const step = finite.length > 1 ? Math.abs(finite[1] - finite[0]) : largest || 1;
  const exponent = largest > 0 && (largest < 1e-3 || largest >= 1e6) ? Math.floor(Math.log10(largest)) : 0;
  const unit = step / 10 ** exponent;
  let places = 0;
  while (places < 9 && Math.abs(unit * 10 ** places - Math.round(unit * 10 ** places)) > 1e-6 * unit * 10 ** places) places++;
  return splits.map(v => {
    if (v == null) return "";
    const text = minus((Math.abs(v) < step * 1e-6 ? 0 : v / 10 ** exponent).toFixed(places));
    return exponent === 0 || Math.abs(v) < step * 1e-6 ? text : text + "×10" + superscript(exponent);
  });
}

const prettyUnit = unit => unit.replace(/^u(?=[A-Za-z])/, "µ").replace(/\bdeg\b/, "°");
const withUnit = (name, unit) => unit ? `${name} (${prettyUnit(unit)})` : name;
const GREEK = { alpha: "α", beta: "β", eta: "η", epsilon: "ε" };
const prettyName = name => name.replace(/^(alpha|beta|eta|epsilon)(?=_|$)/, word => GREEK[word]);
const channelLabel = channel => withUnit(prettyName(channel.name), channel.unit);

function element(tag, attributes = {}, ...children) {
  const node = document.createElement(tag);
  for (const [name, value] of Object.entries(attributes)) {
    if (name === "html") node.innerHTML = value;
    else if (name.startsWith("on")) node.addEventListener(name.slice(2), value);
    else if (value != null) node.setAttribute(name, value);
  }
  node.append(...children.filter(child => child != null));
  return node;
}

// Text beside the pointer, or beside what has the focus; positions count from the host's corner.
function tooltip(host) {
  const tip = element("div", { class: "tip", hidden: "" });
  host.append(tip);
  return {
    show(text, x, y) {
      tip.textContent = text;
      tip.hidden = false;
      const before = x + 16 + tip.offsetWidth > host.clientWidth && x > tip.offsetWidth;
      tip.style.left = `${before ? x - 12 - tip.offsetWidth : x + 16}px`;
      tip.style.top = `${y + 14}px`;
    },
    hide() { tip.hidden = true; },
  };
}

// A choice among few as buttons, among many as a list. Calls `changed` with the place of the choice.
function chooser(label, options, changed) {
  const name = element("span", {}, label);
  if (options.length > 9) {
    const list = element("select", { "aria-label": label, onchange: () => changed(list.selectedIndex) },
      ...options.map(option => element("option", {}, option)));
    return element("label", { class: "choice" }, name, list);
  }
  const buttons = options.map((option, k) => element("button", {
    type: "button", "aria-pressed": k === 0,
    onclick: () => { buttons.forEach((b, i) => b.setAttribute("aria-pressed", i === k)); changed(k); },
  }, option));
  return element("div", { class: "choice", role: "group", "aria-label": label }, name, element("span", { class: "options" }, ...buttons));
}
