// Maps of cells: colour and mark say which method wins, the strength of the colour how clearly.

function cells(host, panel) {
  const { columns, rows, cells } = panel.content.cells;
  const map = element("div", { class: "cells", role: "grid", "aria-label": panel.title || withUnit(panel.y.label, panel.y.unit) });
  map.style.setProperty("--columns", columns.length);
  if (panel.title) map.append(element("p", { class: "panel-title" }, panel.title));
  map.append(element("div", { class: "axis-name upright", "aria-hidden": "true" }, withUnit(panel.y.label, panel.y.unit)));
  map.querySelector(".upright").style.gridRow = `${panel.title ? 2 : 1} / span ${rows.length}`;
  const grid = rows.map((_, r) => columns.map((_, c) => cellOf(cells[r * columns.length + c] ?? { method: "", strength: 0, text: "", detail: "" }, r, c)));
  for (let r = rows.length - 1; r >= 0; r--) {
    map.append(element("div", { class: "row", role: "row" }, element("div", { class: "label", role: "rowheader" }, rows[r]), ...grid[r]));
  }
  map.append(element("div", { class: "row", role: "row" }, element("div", { class: "corner" }), ...columns.map(label => element("div", { class: "label below", role: "columnheader" }, label))));
  map.append(element("div", { class: "axis-name along", "aria-hidden": "true" }, withUnit(panel.x.label, panel.x.unit)));
  host.replaceChildren(map);
  const tip = tooltip(map);
  let here = [rows.length - 1, 0];
  if (grid[here[0]]?.[0]) grid[here[0]][0].tabIndex = 0;
  return { destroy() { host.replaceChildren(); } };

  function cellOf(cell, r, c) {
    const method = cell.method ? methodOf(cell.method) : null;
    const place = [panel.x.label, columns[c], prettyUnit(panel.x.unit)].filter(Boolean).join(" ") + "\n" + [panel.y.label, rows[r], prettyUnit(panel.y.unit)].filter(Boolean).join(" ");
    const text = [method?.label, cell.text, cell.detail, place].filter(Boolean).join("\n");
    const show = () => tip.show(text, node.offsetLeft + node.offsetWidth - 14, node.offsetTop + node.offsetHeight - 16);
    const node = element("div", { class: "cell", role: "gridcell", tabindex: -1, "aria-label": text.replaceAll("\n", ", "),
      onpointerenter: show, onfocus: show, onpointerleave: () => tip.hide(), onblur: () => tip.hide(), onkeydown: event => pressed(event, r, c) },
      method ? element("span", { class: "mark", html: cellMark(method.style) }) : null, element("span", {}, minus(cell.text)));
    if (method) node.style.setProperty("--c", `var(${method.style.colour})`);
    node.style.setProperty("--strength", Math.min(1, Math.max(0, cell.strength ?? 0)));
    return node;
  }

  function pressed(event, r, c) {
    const [up, right] = { ArrowUp: [1, 0], ArrowDown: [-1, 0], ArrowRight: [0, 1], ArrowLeft: [0, -1] }[event.key] ?? [];
    const next = up === undefined ? null : grid[r + up]?.[c + right];
    if (!next) return;
    grid[here[0]][here[1]].tabIndex = -1;
    here = [r + up, c + right];
    next.tabIndex = 0;
    next.focus();
    event.preventDefault();
  }
}

function cellMark({ colour, point }) {
  const paint = isFilled(point) ? `fill="var(${colour})"` : `fill="none" stroke="var(${colour})" stroke-width="1.5"`;
  return `<svg width="8" height="8" aria-hidden="true"><path d="${markerPath(point, 4, 4, 2.8)}" ${paint}/></svg>`;
}
