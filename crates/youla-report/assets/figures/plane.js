// A map of the complex plane: equal scales, zoom by dragging, arrows, + and -, and a reading at the pointer.
//
// spec = {
//   label, caption, x, y,                    what it shows, in words; the axes
//   views: [{ name, view: { x0, x1, y0, y1 } }],
//   entries: [{ id, name, swatch, radius? }],  the legend
//   draw(map),                               what stands in the frame, as SVG; map = { px, py, inside, view, frame, hidden, ... }
//   marks: [{ id, at: [x, y], text }],       what can be read
// }

const MAP = { width: 760, height: 520, left: 62, right: 14, top: 12, bottom: 46 };
let planeCount = 0;

function plane(host, spec) {
  const frame = { x: MAP.left, y: MAP.top, w: MAP.width - MAP.left - MAP.right, h: MAP.height - MAP.top - MAP.bottom };
  const presets = spec.views(frame.w / frame.h), hidden = new Set(), clip = `plane-${planeCount++}`;
  let preset = presets[0], view = preset.view;
  const tip = element("div", { class: "tip", hidden: "" });
  const root = element("div", { class: "pole-map", tabindex: 0, role: "img", onkeydown: pressed, "aria-label": spec.label });
  const legend = element("div", { class: "legend" }, ...spec.entries.map(entry => {
    const button = element("button", { type: "button", "aria-pressed": true, title: "Show or hide", onclick: () => {
      hidden.has(entry.id) ? hidden.delete(entry.id) : hidden.add(entry.id);
      button.setAttribute("aria-pressed", !hidden.has(entry.id));
      draw();
    } }, element("span", { class: "swatch", html: entry.swatch }), element("span", {}, entry.name));
    return button;
  }));
  const zoomed = presets.length > 1 ? chooser("Region", presets.map(p => p.name), k => { preset = presets[k]; view = preset.view; draw(); }) : null;
  host.replaceChildren(element("div", { class: "controls" }, zoomed), legend, root, element("p", { class: "caption" }, spec.caption));

  const px = x => frame.x + (x - view.x0) / (view.x1 - view.x0) * frame.w;
  const py = y => frame.y + (view.y1 - y) / (view.y1 - view.y0) * frame.h;
  const inside = ([x, y]) => x > view.x0 && x < view.x1 && y > view.y0 && y < view.y1;
  const polyline = points => points.map(([x, y], k) => `${k ? "L" : "M"}${px(x).toFixed(1)} ${py(y).toFixed(1)}`).join("");
  const line = (points, stroke, width, dash = "") => `<path d="${polyline(points)}" fill="none" stroke="${stroke}" stroke-width="${width}" stroke-dasharray="${dash}"/>`;
  const text = (x, y, label, anchor = "middle") => `<text x="${x.toFixed(1)}" y="${y.toFixed(1)}" text-anchor="${anchor}" dominant-baseline="middle" fill="var(--soft)" stroke="var(--paper)" stroke-width="3" paint-order="stroke">${label}</text>`;
  draw();
  root.addEventListener("pointermove", hover);
  root.addEventListener("pointerleave", () => { tip.hidden = true; });
  root.addEventListener("pointerdown", drag);
  root.addEventListener("dblclick", () => { view = preset.view; draw(); });
  return { destroy() { host.replaceChildren(); } };

  function draw() {
    const content = spec.draw({ px, py, inside, polyline, line, text, view, frame, shown: id => !hidden.has(id) });
    root.innerHTML = `<svg viewBox="0 0 ${MAP.width} ${MAP.height}" aria-hidden="true">
      <defs><clipPath id="${clip}"><rect x="${frame.x}" y="${frame.y}" width="${frame.w}" height="${frame.h}"/></clipPath></defs>
      <g clip-path="url(#${clip})">${content}<rect class="selection" fill="var(--link)" fill-opacity=".15" width="0" height="0"/></g>
      <rect x="${frame.x}" y="${frame.y}" width="${frame.w}" height="${frame.h}" fill="none" stroke="var(--soft)"/>${ticks()}</svg>`;
    tip.hidden = true;
    root.append(tip);
  }

  function ticks() {
    const out = [];
    const label = (x, y, t, anchor) => out.push(`<text x="${x.toFixed(1)}" y="${y.toFixed(1)}" text-anchor="${anchor}" dominant-baseline="middle" fill="var(--ink)" font-size="12">${t}</text>`);
    const along = (low, high, count, place) => {
      const step = niceStep((high - low) / count), at = [];
      for (let v = Math.ceil(low / step) * step; v <= high; v += step) at.push(v);
      tickLabels(at).forEach((t, k) => place(at[k], t));
    };
    along(view.x0, view.x1, 8, (v, t) => { const x = px(v); out.push(`<path d="M${x} ${frame.y + frame.h}v4" stroke="var(--soft)"/>`); label(x, frame.y + frame.h + 14, t, "middle"); });
    along(view.y0, view.y1, 7, (v, t) => { const y = py(v); out.push(`<path d="M${frame.x} ${y}h-4" stroke="var(--soft)"/>`); label(frame.x - 8, y, t, "end"); });
    label(frame.x + frame.w / 2, MAP.height - 10, spec.x, "middle");
    out.push(`<text transform="translate(12 ${frame.y + frame.h / 2}) rotate(-90)" text-anchor="middle" dominant-baseline="middle" fill="var(--ink)" font-size="12">${spec.y}</text>`);
    return out.join("");
  }

  function toMap(event) {
    const box = root.querySelector("svg").getBoundingClientRect();
    return [(event.clientX - box.left) * MAP.width / box.width, (event.clientY - box.top) * MAP.height / box.height];
  }

  function hover(event) {
    if (event.buttons) { tip.hidden = true; return; }
    const [x, y] = toMap(event);
    let nearest = null, distance = 14;
    for (const mark of spec.marks) {
      if (hidden.has(mark.id) || !inside(mark.at)) continue;
      const d = Math.hypot(px(mark.at[0]) - x, py(mark.at[1]) - y);
      if (d < distance) [nearest, distance] = [mark, d];
    }
    tip.hidden = !nearest;
    if (!nearest) return;
    tip.textContent = nearest.text();
    const box = root.getBoundingClientRect();
    const left = event.clientX - box.left;
    tip.style.left = `${left > box.width - 210 ? left - 200 : left + 16}px`;
    tip.style.top = `${event.clientY - box.top + 14}px`;
  }

  function drag(event) {
    if (event.button !== 0) return;
    const start = toMap(event), selection = root.querySelector(".selection");
    root.setPointerCapture(event.pointerId);
    const follow = move => {
      const [x, y] = toMap(move);
      Object.entries({ x: Math.min(x, start[0]), y: Math.min(y, start[1]), width: Math.abs(x - start[0]), height: Math.abs(y - start[1]) })
        .forEach(([name, value]) => selection.setAttribute(name, value));
    };
    const end = up => {
      root.removeEventListener("pointermove", follow);
      const [x, y] = toMap(up);
      if (Math.abs(x - start[0]) < 6 || Math.abs(y - start[1]) < 6) return selection.setAttribute("width", 0);
      const re = [start[0], x].map(p => view.x0 + (p - frame.x) / frame.w * (view.x1 - view.x0)).sort((a, b) => a - b);
      const im = [start[1], y].map(p => view.y1 - (p - frame.y) / frame.h * (view.y1 - view.y0)).sort((a, b) => a - b);
      view = widened(re, im, frame.w / frame.h);
      draw();
    };
    root.addEventListener("pointermove", follow);
    root.addEventListener("pointerup", end, { once: true });
  }

  function pressed(event) {
    const w = view.x1 - view.x0, h = view.y1 - view.y0;
    const shifted = (dx, dy) => ({ x0: view.x0 + dx * w, x1: view.x1 + dx * w, y0: view.y0 + dy * h, y1: view.y1 + dy * h });
    const scaled = k => ({ x0: view.x0 + k * w, x1: view.x1 - k * w, y0: view.y0 + k * h, y1: view.y1 - k * h });
    const next = { ArrowLeft: () => shifted(-0.1, 0), ArrowRight: () => shifted(0.1, 0), ArrowUp: () => shifted(0, 0.1), ArrowDown: () => shifted(0, -0.1),
      "+": () => scaled(0.2), "=": () => scaled(0.2), "-": () => scaled(-0.4), 0: () => preset.view, Escape: () => preset.view }[event.key];
    if (next && !event.ctrlKey && !event.metaKey && !event.altKey) { view = next(); draw(); event.preventDefault(); }
  }
}

const fine = value => minus(value.toFixed(Math.abs(value) < 100 ? 5 : 1));
const range = (from, to, count) => Array.from({ length: count + 1 }, (_, k) => from + (to - from) * k / count);

// The smallest view of the given aspect that holds both intervals.
function widened([x0, x1], [y0, y1], aspect) {
  const w = Math.max(x1 - x0, (y1 - y0) * aspect), h = w / aspect;
  const cx = (x0 + x1) / 2, cy = (y0 + y1) / 2;
  return { x0: cx - w / 2, x1: cx + w / 2, y0: cy - h / 2, y1: cy + h / 2 };
}
