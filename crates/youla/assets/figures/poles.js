// Pole map with a grid of damping ratio and natural frequency, in z or in s.

const MAP = { width: 760, height: 520, left: 62, right: 14, top: 12, bottom: 46 };
const DAMPINGS = [0.001, 0.002, 0.005, 0.01, 0.02, 0.05, 0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9];

function poleMap(host, sets, sampleTime) {
  const discrete = sampleTime != null;
  const frame = { x: MAP.left, y: MAP.top, w: MAP.width - MAP.left - MAP.right, h: MAP.height - MAP.top - MAP.bottom };
  const presets = poleViews(sets, discrete, frame.w / frame.h);
  const hidden = new Set();
  let preset = presets[0], view = preset.view;
  const tip = element("div", { class: "tip", hidden: "" });
  const map = element("div", { class: "pole-map", tabindex: 0, role: "img", onkeydown: pressed,
    "aria-label": `Pole map of ${sets.map(set => methodOf(set.method).label).join(", ")} in the ${discrete ? "z" : "s"} plane; the frequencies and damping ratios are in the table of modes.` });
  const legend = element("div", { class: "legend" }, ...sets.map(set => {
    const method = methodOf(set.method);
    const button = element("button", { type: "button", "aria-pressed": true, title: "Show or hide", onclick: () => {
      hidden.has(set.method) ? hidden.delete(set.method) : hidden.add(set.method);
      button.setAttribute("aria-pressed", !hidden.has(set.method));
      draw();
    } }, element("span", { class: "swatch", html: swatch(method.style, true) }), element("span", {}, `${method.label}, ${set.poles.length} poles`));
    return button;
  }));
  const zoomed = presets.length > 1 ? chooser("Region", presets.map(p => p.name), k => { preset = presets[k]; view = preset.view; draw(); }) : null;
  host.replaceChildren(element("div", { class: "controls" }, zoomed), legend, map,
    element("p", { class: "caption" }, discrete
      ? "Poles in the z plane. Grid: lines of constant natural frequency (Hz, printed outside of the unit circle) and of constant damping ratio ζ. Drag to zoom, double-click to return."
      : "Poles in the s plane (rad/s). Grid: circles of constant natural frequency (Hz) and rays of constant damping ratio ζ. Drag to zoom, double-click to return."));

  const px = x => frame.x + (x - view.x0) / (view.x1 - view.x0) * frame.w;
  const py = y => frame.y + (view.y1 - y) / (view.y1 - view.y0) * frame.h;
  const fromS = ([re, im]) => discrete ? [Math.exp(re * sampleTime) * Math.cos(im * sampleTime), Math.exp(re * sampleTime) * Math.sin(im * sampleTime)] : [re, im];
  const toS = ([re, im]) => discrete ? [Math.log(Math.hypot(re, im)) / sampleTime, Math.atan2(im, re) / sampleTime] : [re, im];
  const inside = ([x, y]) => x > view.x0 && x < view.x1 && y > view.y0 && y < view.y1;
  const mode = pole => { const [re, im] = toS(pole), size = Math.hypot(re, im); return { hz: size / (2 * Math.PI), zeta: size ? -re / size : 1 }; };
  draw();
  map.addEventListener("pointermove", hover);
  map.addEventListener("pointerleave", () => { tip.hidden = true; });
  map.addEventListener("pointerdown", drag);
  map.addEventListener("dblclick", () => { view = preset.view; draw(); });
  return { destroy() { host.replaceChildren(); } };

  function draw() {
    const marks = sets.filter(set => !hidden.has(set.method)).map(set => {
      const { style } = methodOf(set.method);
      const path = set.poles.filter(inside).map(([re, im]) => markerPath(style.marker, px(re), py(im), 5)).join("");
      return `<path d="${path}" fill="none" stroke="var(${style.colour})" stroke-width="1.7"/>`;
    }).join("");
    map.innerHTML = `<svg viewBox="0 0 ${MAP.width} ${MAP.height}" aria-hidden="true">
      <defs><clipPath id="pole-frame"><rect x="${frame.x}" y="${frame.y}" width="${frame.w}" height="${frame.h}"/></clipPath></defs>
      <g clip-path="url(#pole-frame)">${grid()}${marks}<rect class="selection" fill="var(--link)" fill-opacity=".15" width="0" height="0"/></g>
      <rect x="${frame.x}" y="${frame.y}" width="${frame.w}" height="${frame.h}" fill="none" stroke="var(--soft)"/>${ticks()}</svg>`;
    map.append(tip);
  }

  function grid() {
    const line = (points, stroke, width, dash = "") => `<path d="${polyline(points)}" fill="none" stroke="${stroke}" stroke-width="${width}" stroke-dasharray="${dash}"/>`;
    const text = (x, y, label, anchor = "middle") => `<text x="${x.toFixed(1)}" y="${y.toFixed(1)}" text-anchor="${anchor}" dominant-baseline="middle" fill="var(--soft)" stroke="var(--paper)" stroke-width="3" paint-order="stroke">${label}</text>`;
    const lines = [], labels = [];
    const [low, high] = frequenciesInView();
    const step = niceStep((high - low) / (discrete ? 8 : 6)) || 1;
    const places = Math.max(0, -Math.floor(Math.log10(step) + 1e-9));
    const nyquist = discrete ? 0.5 / sampleTime : Infinity;
    for (let f = Math.max(step, Math.ceil(low / step) * step); f <= Math.min(high * (1 + 1e-9), nyquist); f += step) {
      for (const sign of [1, -1]) {
        const arc = range(0, 1, 100).map(zeta => fromS(atMode(f, zeta, sign)));
        lines.push(line(arc, "var(--rule)", 1));
        const [x, y] = arc[0], outward = discrete ? 15 : 0;
        const size = Math.hypot(x, y) || 1;
        if (inside([x, y]) && !(sign < 0 && Math.abs(y) < 1e-9)) labels.push(text(px(x) + outward * x / size * 1.25, py(y) - outward * y / size, f.toFixed(places)));
      }
    }
    const middle = (low + Math.min(high, nyquist)) / 2;
    let previous = fromS(atMode(middle, 0, 1));
    for (const zeta of DAMPINGS) {
      const here = fromS(atMode(middle, zeta, 1));
      if (Math.hypot(px(here[0]) - px(previous[0]), py(here[1]) - py(previous[1])) < 30) continue;
      previous = here;
      const top = Math.min(high * 1.6, nyquist / Math.sqrt(1 - zeta * zeta));
      for (const sign of [1, -1]) {
        const ray = range(0, top, 240).map(f => fromS(atMode(f, zeta, sign)));
        lines.push(line(ray, "var(--rule)", 1));
        const seen = ray.filter(inside);
        if (seen.length > 8 && (sign > 0 || view.y1 <= 0)) {
          const at = seen[Math.floor(seen.length * 0.5)];
          labels.push(text(px(at[0]), py(at[1]), `ζ ${zeta}`));
        }
      }
    }
    const boundary = discrete ? arcOfUnitCircle() : [[0, view.y0], [0, view.y1]];
    const axes = line([[view.x0, 0], [view.x1, 0]], "var(--rule)", 1) + (discrete ? line([[0, view.y0], [0, view.y1]], "var(--rule)", 1) : "");
    return axes + lines.join("") + line(boundary, "var(--ink)", 1.3) + labels.join("");
  }

  function polyline(points) {
    return points.map(([x, y], k) => `${k ? "L" : "M"}${px(x).toFixed(1)} ${py(y).toFixed(1)}`).join("");
  }

  function arcOfUnitCircle() {
    const [low, high] = frequenciesInView().map(f => 2 * Math.PI * f * sampleTime);
    const upper = range(Math.max(0, low * 0.9 - 0.01), Math.min(Math.PI, high * 1.1 + 0.01), 400).map(a => [Math.cos(a), Math.sin(a)]);
    return view.y0 >= 0 ? upper : [...upper.map(([x, y]) => [x, -y]).reverse(), ...upper];
  }

  function frequenciesInView() {
    const edge = [];
    for (const t of range(0, 1, 40)) {
      const x = view.x0 + t * (view.x1 - view.x0), y = view.y0 + t * (view.y1 - view.y0);
      edge.push([x, view.y0], [x, view.y1], [view.x0, y], [view.x1, y]);
    }
    const size = point => discrete ? Math.abs(Math.atan2(point[1], point[0])) / (2 * Math.PI * sampleTime) : Math.hypot(...point) / (2 * Math.PI);
    const sizes = edge.map(size);
    const realAxis = view.y0 < 0 && view.y1 > 0 && (discrete ? view.x1 > 0 : view.x0 < 0 && view.x1 > 0);
    return [realAxis ? 0 : Math.min(...sizes), Math.max(...sizes)];
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
    label(frame.x + frame.w / 2, MAP.height - 10, discrete ? "Re z" : "Re s (rad/s)", "middle");
    out.push(`<text transform="translate(12 ${frame.y + frame.h / 2}) rotate(-90)" text-anchor="middle" dominant-baseline="middle" fill="var(--ink)" font-size="12">${discrete ? "Im z" : "Im s (rad/s)"}</text>`);
    return out.join("");
  }

  function toMap(event) {
    const box = map.querySelector("svg").getBoundingClientRect();
    return [(event.clientX - box.left) * MAP.width / box.width, (event.clientY - box.top) * MAP.height / box.height];
  }

  function hover(event) {
    const [x, y] = toMap(event);
    let nearest = null, distance = 14;
    for (const set of sets) {
      if (hidden.has(set.method)) continue;
      for (const pole of set.poles) {
        const d = Math.hypot(px(pole[0]) - x, py(pole[1]) - y);
        if (inside(pole) && d < distance) [nearest, distance] = [{ pole, set }, d];
      }
    }
    tip.hidden = !nearest;
    if (!nearest) return;
    const [re, im] = nearest.pole, { hz, zeta } = mode(nearest.pole);
    tip.textContent = `${methodOf(nearest.set.method).label}\n${discrete ? "z" : "s"} = ${fine(re)}${im ? ` ${im < 0 ? "−" : "+"} ${fine(Math.abs(im))}i` : ""}`
      + (discrete ? `\n|z| = ${fine(Math.hypot(re, im))}` : "") + `\n${readOut(hz)} Hz, ζ = ${minus(zeta.toFixed(4))}`;
    const box = map.getBoundingClientRect();
    const left = event.clientX - box.left;
    tip.style.left = `${left > box.width - 210 ? left - 200 : left + 16}px`;
    tip.style.top = `${event.clientY - box.top + 14}px`;
  }

  function drag(event) {
    if (event.button !== 0) return;
    const start = toMap(event), selection = map.querySelector(".selection");
    map.setPointerCapture(event.pointerId);
    const follow = move => {
      const [x, y] = toMap(move);
      Object.entries({ x: Math.min(x, start[0]), y: Math.min(y, start[1]), width: Math.abs(x - start[0]), height: Math.abs(y - start[1]) })
        .forEach(([name, value]) => selection.setAttribute(name, value));
    };
    const end = up => {
      map.removeEventListener("pointermove", follow);
      const [x, y] = toMap(up);
      if (Math.abs(x - start[0]) < 6 || Math.abs(y - start[1]) < 6) return selection.setAttribute("width", 0);
      const re = [start[0], x].map(p => view.x0 + (p - frame.x) / frame.w * (view.x1 - view.x0)).sort((a, b) => a - b);
      const im = [start[1], y].map(p => view.y1 - (p - frame.y) / frame.h * (view.y1 - view.y0)).sort((a, b) => a - b);
      view = widened(re, im, frame.w / frame.h);
      draw();
    };
    map.addEventListener("pointermove", follow);
    map.addEventListener("pointerup", end, { once: true });
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
const atMode = (hz, zeta, sign) => [-2 * Math.PI * hz * zeta, sign * 2 * Math.PI * hz * Math.sqrt(1 - zeta * zeta)];

// The smallest view of the given aspect that holds both intervals.
function widened([x0, x1], [y0, y1], aspect) {
  const w = Math.max(x1 - x0, (y1 - y0) * aspect), h = w / aspect;
  const cx = (x0 + x1) / 2, cy = (y0 + y1) / 2;
  return { x0: cx - w / 2, x1: cx + w / 2, y0: cy - h / 2, y1: cy + h / 2 };
}

function poleViews(sets, discrete, aspect) {
  const all = sets.flatMap(set => set.poles);
  const around = (poles, pad) => {
    const [re, im] = [poles.map(p => p[0]), poles.map(p => p[1])];
    const span = Math.max(Math.max(...re) - Math.min(...re), (Math.max(...im) - Math.min(...im)), 1e-3 * Math.max(...re.map(Math.abs), ...im.map(Math.abs)), 1e-9) * pad;
    return widened([Math.min(...re) - span, Math.max(...re) + span], [Math.min(...im) - span, Math.max(...im) + span], aspect);
  };
  if (!discrete) {
    const light = all.filter(([re, im]) => im > 0 && -re < 0.2 * Math.hypot(re, im));
    return [{ name: "all poles", view: around([...all, [0, 0]], 0.15) }, ...(light.length ? [{ name: "lightly damped", view: around([...light, [0, light[0][1]]], 0.25) }] : [])];
  }
  const reach = Math.max(1.12, 1.05 * Math.max(...all.map(p => Math.hypot(...p))));
  const whole = { name: "unit circle", view: widened([-reach, reach], [-reach, reach], aspect) };
  const near = all.filter(([re, im]) => im >= 0 && Math.hypot(re, im) > 0.9);
  return near.length ? [whole, { name: "near the unit circle", view: around(near, 0.2) }] : [whole];
}
