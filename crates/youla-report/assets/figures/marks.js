// Marks of points, swatches, and the legend of a figure.

// A shape that can be filled, and so be told from its outline.
const isFilled = marker => !["plus", "cross"].includes(marker), solid = marker => ({ plus: "up", cross: "down" })[marker] ?? marker;

// A path around (x, y) of half-width r.
function markerPath(marker, x, y, r) {
  const at = (dx, dy) => `${(x + dx * r).toFixed(2)},${(y + dy * r).toFixed(2)}`;
  switch (marker) {
    case "cross": return `M${at(-1, -1)}L${at(1, 1)}M${at(-1, 1)}L${at(1, -1)}`;
    case "plus": return `M${at(-1.2, 0)}L${at(1.2, 0)}M${at(0, -1.2)}L${at(0, 1.2)}`;
    case "square": return `M${at(-0.9, -0.9)}L${at(0.9, -0.9)}L${at(0.9, 0.9)}L${at(-0.9, 0.9)}Z`;
    case "diamond": return `M${at(0, -1.25)}L${at(1.25, 0)}L${at(0, 1.25)}L${at(-1.25, 0)}Z`;
    case "up": return `M${at(0, -1.2)}L${at(1.15, 0.85)}L${at(-1.15, 0.85)}Z`;
    case "down": return `M${at(0, 1.2)}L${at(1.15, -0.85)}L${at(-1.15, -0.85)}Z`;
    default: return `M${at(-1, 0)}a${r},${r} 0 1 0 ${2 * r},0a${r},${r} 0 1 0 ${-2 * r},0Z`;
  }
}

// What stands before a name: an area, a line, a mark, one on the other.
function swatch(method, { area, line, points, dots, marks }, dash = styleOf(method).dash, hollow = false) {
  const { colour, width, marker } = styleOf(method), ink = `var(${colour})`, parts = [];
  const mark = (shape, x, r, filled) => `<path d="${markerPath(shape, x, 5, r)}" fill="${filled ? ink : "none"}" stroke="${ink}" stroke-width="1.3"/>`;
  if (area) parts.push(`<rect x="8" y="-1" width="14" height="12" rx="2" fill="${ink}" fill-opacity="${area}"/>`);
  if (line) parts.push(`<path d="M0 5H30" stroke="${ink}" stroke-width="${Math.max(1.4, 2 * width)}" stroke-dasharray="${dash.map(d => 2 * d).join(" ")}"/>`);
  if (points) parts.push(...[6, 15, 24].map(x => mark(marker, x, 2.5, isFilled(marker) && !hollow)));
  if (dots) parts.push(mark(solid(marker), 15, 3.4, true));
  if (marks) parts.push(mark(marker, 15, 3.6, false));
  return `<svg width="30" height="10" aria-hidden="true">${parts.join("")}</svg>`;
}

const idOf = ({ method, note }) => JSON.stringify([method, note ?? ""]);
const inOrder = list => [...list].sort((a, b) => styleOf(a.method).order - styleOf(b.method).order);

// Methods and notes of a figure in the order of the methods, each with all that is drawn of it.
function entriesOf(figure) {
  const entries = new Map();
  const add = (item, kind) => {
    const entry = entries.get(idOf(item)) ?? { id: idOf(item), method: item.method, note: item.note, kinds: {} };
    entries.set(entry.id, entry);
    Object.assign(entry.kinds, kind);
  };
  for (const { content, regions = [] } of figure.panels) {
    for (const curve of content.curves ?? []) add(curve, { [curve.drawn]: true });
    for (const region of regions) add(region, { area: 0.3 });
    for (const cell of content.cells?.cells ?? []) if (cell.method) add({ method: cell.method }, { area: 0.7 });
  }
  // What has a note of its own stands behind the method itself.
  const list = inOrder([...entries.values()].sort((a, b) => !!a.note - !!b.note));
  // Further lines of a method have dashes of their own, further clouds are hollow.
  const nth = (entry, kind) => list.filter(other => other.method === entry.method && other.kinds[kind]).indexOf(entry);
  for (const entry of list) {
    entry.dash = entry.kinds.line && nth(entry, "line") > 0 ? [[1.2, 1.2], [4, 1, 1, 1], [7, 2], [2.5, 2.5]][(nth(entry, "line") - 1) % 4] : styleOf(entry.method).dash;
    entry.hollow = entry.kinds.points && nth(entry, "points") > 0;
  }
  return list;
}

// Names that read out and hide; all that is drawn under them listens.
function makeLegend(figure, hidden) {
  const listeners = [], entries = entriesOf(figure), still = figure.panels.every(panel => panel.content.cells), values = new Map();
  const node = element("div", { class: still ? "legend of-maps" : "legend" }, ...entries.map(entry => {
    const { id, kinds } = entry, value = element("span", { class: "value" });
    values.set(id, value);
    const button = element("button", { type: "button", "aria-pressed": !hidden.has(id), title: still ? null : "Show or hide", disabled: still ? "" : null, onclick: () => {
      hidden.has(id) ? hidden.delete(id) : hidden.add(id);
      button.setAttribute("aria-pressed", !hidden.has(id));
      listeners.forEach(listener => listener());
    } }, element("span", { class: "swatch", html: swatch(entry.method, kinds, entry.dash, entry.hollow) }), element("span", {}, nameOf(entry)), value);
    return button;
  }));
  return { node, hidden, listeners, entry: item => entries.find(entry => entry.id === idOf(item)), read(id, text) { values.get(id).textContent = text; }, ids: [...values.keys()] };
}
