// Maps of cells: colour and mark say which method wins, the strength of the colour how clearly.

function cells(host, panel) {
  const { columns, rows, cells } = panel.content.cells;
  const map = element("div", { class: "cells", role: "grid", "aria-label": panel.title || withUnit(panel.y) });
  map.style.setProperty("--columns", columns.length);
  if (panel.title) map.append(element("p", { class: "panel-title" }, panel.title));
  map.append(element("div", { class: "axis-name upright", "aria-hidden": "true", style: `grid-row: ${panel.title ? 2 : 1} / span ${rows.length}` }, withUnit(panel.y)));
  const grid = rows.map((_, r) => columns.map((_, c) => cellOf(cells[r * columns.length + c] ?? { method: "", strength: 0, text: "", detail: "" }, r, c)));
  for (let r = rows.length - 1; r >= 0; r--) map.append(element("div", { class: "row", role: "row" }, element("div", { class: "label", role: "rowheader" }, rows[r]), ...grid[r]));
  map.append(element("div", { class: "row", role: "row" }, element("div", { class: "corner" }), ...columns.map(label => element("div", { class: "label below", role: "columnheader" }, label))));
  map.append(element("div", { class: "axis-name along", "aria-hidden": "true" }, withUnit(panel.x)));
  host.replaceChildren(map);
  const tip = tooltip(map);
  let here = [rows.length - 1, 0];
  if (grid[here[0]]?.[0]) grid[here[0]][0].tabIndex = 0;
  return { destroy() { host.replaceChildren(); } };

  function cellOf(cell, r, c) {
    const place = [[panel.x, columns[c]], [panel.y, rows[r]]].map(([axis, value]) => [axis.label, value, prettyUnit(axis.unit)].filter(Boolean).join(" "));
    const { label, colour, marker } = styleOf(cell.method), text = [cell.method ? label : "", cell.text, cell.detail, ...place].filter(Boolean).join("\n");
    const show = () => tip.show(text, node.offsetLeft + node.offsetWidth - 14, node.offsetTop + node.offsetHeight - 16);
    const mark = `<svg width="8" height="8" aria-hidden="true"><path d="${markerPath(marker, 4, 4, 2.8)}" fill="${isFilled(marker) ? `var(${colour})` : "none"}" stroke="var(${colour})"/></svg>`;
    const node = element("div", { class: "cell", role: "gridcell", tabindex: -1, "aria-label": text.replaceAll("\n", ", "),
      onpointerenter: show, onfocus: show, onpointerleave: () => tip.hide(), onblur: () => tip.hide(), onkeydown: event => pressed(event, r, c) },
      cell.method ? element("span", { class: "mark", html: mark }) : null, element("span", {}, minus(cell.text)));
    node.style.cssText = `--c: ${cell.method ? `var(${colour})` : "transparent"}; --strength: ${Math.min(1, Math.max(0, cell.strength ?? 0))}`;
    return node;
  }

  function pressed(event, r, c) {
    const [up, right] = { ArrowUp: [1, 0], ArrowDown: [-1, 0], ArrowRight: [0, 1], ArrowLeft: [0, -1] }[event.key] ?? [];
    const next = grid[r + up]?.[c + right];
    if (!next) return;
    grid[here[0]][here[1]].tabIndex = -1;
    [here, next.tabIndex] = [[r + up, c + right], 0];
    next.focus();
    event.preventDefault();
  }
}
