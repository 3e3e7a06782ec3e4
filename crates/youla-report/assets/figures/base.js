// Data of the page, elements, and numbers as text.

// styles: { key: { label, colour, width, dash, marker, order } }; figures: [Figure]; hosts: where each of them is drawn.
const page = JSON.parse(document.getElementById("report-data").textContent);
const styleOf = key => page.styles[key] ?? { label: key, colour: "--other-1", width: 0.8, dash: [], marker: "circle", order: 1e9 };
const nameOf = ({ method, note }) => [styleOf(method).label, note].filter(Boolean).join(", ");
const colour = name => getComputedStyle(document.documentElement).getPropertyValue(name).trim();

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

// Text beside the pointer, or beside what has the focus; positions count from the corner of the host.
function tooltip(host) {
  const tip = element("div", { class: "tip", hidden: "" });
  host.append(tip);
  return {
    show(text, x, y) {
      tip.textContent = text;
      tip.hidden = false;
      tip.style.left = `${x + 16 + tip.offsetWidth > host.clientWidth && x > tip.offsetWidth ? x - 12 - tip.offsetWidth : x + 16}px`;
      tip.style.top = `${y + 14}px`;
    },
    hide() { tip.hidden = true; },
  };
}

// A choice among few as buttons, among many as a list. Calls `changed` with the place of the choice.
function chooser(label, options, changed, chosen = 0) {
  const name = element("span", {}, label);
  if (options.length > 9) {
    const list = element("select", { "aria-label": label, onchange: () => changed(list.selectedIndex) }, ...options.map((option, k) => element("option", { selected: k === chosen ? "" : null }, option)));
    return element("label", { class: "choice" }, name, list);
  }
  const buttons = options.map((option, k) => element("button", { type: "button", "aria-pressed": k === chosen,
    onclick: () => { buttons.forEach((b, i) => b.setAttribute("aria-pressed", i === k)); changed(k); } }, option));
  return element("div", { class: "choice", role: "group", "aria-label": label }, name, element("span", { class: "options" }, ...buttons));
}

const plainKey = event => !event.ctrlKey && !event.metaKey && !event.altKey;
const minus = text => text.replace("-", "−");
const superscript = n => String(n).replace("-", "⁻").replace(/\d/g, d => "⁰¹²³⁴⁵⁶⁷⁸⁹"[d]);
const prettyUnit = unit => unit.replace(/^u(?=[A-Za-z])/, "µ").replace(/\bdeg\b/, "°");
const withUnit = ({ label, unit }) => unit ? `${label} (${prettyUnit(unit)})` : label;
const valued = (value, unit) => readOut(value) + (unit === "deg" ? "°" : unit ? `\u00a0${prettyUnit(unit)}` : "");

// Four significant digits for reading.
function readOut(value) {
  if (value == null || !Number.isFinite(value)) return "–";
  const size = Math.abs(value);
  if (size !== 0 && (size < 1e-3 || size >= 1e6)) {
    const exponent = Math.floor(Math.log10(size));
    return minus((value / 10 ** exponent).toFixed(2)) + "×10" + superscript(exponent);
  }
  return minus(value.toFixed(size === 0 ? 0 : Math.max(0, Math.min(6, 3 - Math.floor(Math.log10(size))))));
}

// The same in a sentence, without zeros at the end.
const inProse = value => readOut(value).replace(/(\.\d*?)0+(?=$|×)/, "$1").replace(/\.(?=$|×)/, "");

// Labels of an axis: as many decimals as the increment needs, a power of ten where numbers are very small or large.
function tickLabels(splits) {
  const finite = splits.filter(v => v != null), largest = Math.max(...finite.map(Math.abs)), step = finite.length > 1 ? Math.abs(finite[1] - finite[0]) : largest || 1;
  const exponent = largest > 0 && (largest < 1e-3 || largest >= 1e6) ? Math.floor(Math.log10(largest)) : 0, unit = step / 10 ** exponent;
  let places = 0;
  while (places < 9 && Math.abs(unit * 10 ** places - Math.round(unit * 10 ** places)) > 1e-6 * unit * 10 ** places) places++;
  return splits.map(v => {
    if (v == null) return "";
    const zero = Math.abs(v) < step * 1e-6, text = minus((zero ? 0 : v / 10 ** exponent).toFixed(places));
    return exponent === 0 || zero ? text : text + "×10" + superscript(exponent);
  });
}

// Places of labels on a logarithmic axis: equal steps in less than a decade, else 1 to 9 times powers of ten.
function logSplits(low, high) {
  const decades = Math.log10(high / low), splits = [], every = Math.ceil(decades / 9);
  if (decades < 0.7) {
    const rough = (high - low) / 6, power = 10 ** Math.floor(Math.log10(rough)), step = power * [1, 2, 5, 10].find(m => rough < 1.5 * m * power);
    for (let v = Math.ceil(low / step) * step; v <= high * (1 + 1e-9); v += step) splits.push(v);
    return splits;
  }
  for (let k = Math.floor(Math.log10(low)); 10 ** k <= high; k++) for (let m = 1; m < 10; m++) {
    const v = m * 10 ** k;
    if (v >= low * (1 - 1e-9) && v <= high * (1 + 1e-9) && (decades < 5 || m === 1 && k % every === 0)) splits.push(v);
  }
  return splits;
}

function logLabels(splits) {
  if (splits.length < 2) return splits.map(readOut);
  const last = splits[splits.length - 1], decades = Math.log10(last / splits[0]);
  if (decades < 0.7) return tickLabels(splits);
  const plain = splits[0] >= 1e-2 * (1 - 1e-9) && last < 1e5, shown = decades > 2.2 ? [1] : decades > 1.2 ? [1, 2, 5] : [1, 2, 3, 5, 7];
  return splits.map(v => {
    const exponent = Math.floor(Math.log10(v) + 1e-9), mantissa = Math.round(v / 10 ** exponent);
    if (!shown.includes(mantissa)) return "";
    return plain ? String(Number((mantissa * 10 ** exponent).toPrecision(3))) : (mantissa === 1 ? "" : mantissa + "×") + "10" + superscript(exponent);
  });
}
