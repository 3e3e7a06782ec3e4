// Poles and zeros with a grid of damping ratio and natural frequency, in z or in s.

const DAMPINGS = [0.001, 0.002, 0.005, 0.01, 0.02, 0.05, 0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9];

function poleMap(host, sets, sampleTime) {
  const discrete = sampleTime != null, zeros = sets.some(set => set.zeros?.length);
  const fromS = ([re, im]) => discrete ? [Math.exp(re * sampleTime) * Math.cos(im * sampleTime), Math.exp(re * sampleTime) * Math.sin(im * sampleTime)] : [re, im];
  const toS = ([re, im]) => discrete ? [Math.log(Math.hypot(re, im)) / sampleTime, Math.atan2(im, re) / sampleTime] : [re, im];
  const mode = pole => { const [re, im] = toS(pole), size = Math.hypot(re, im); return { hz: size / (2 * Math.PI), zeta: size ? -re / size : 1 }; };
  const grid = discrete ? "natural frequency (Hz, printed outside of the unit circle) and of constant damping ratio ζ" : "natural frequency (Hz, circles) and of constant damping ratio ζ (rays)";
  return plane(host, {
    label: `Pole map of ${sets.map(set => methodOf(set.method).label).join(", ")} in the ${discrete ? "z" : "s"} plane; the frequencies and damping ratios are in the table of modes.`,
    caption: `Poles in the ${discrete ? "z plane" : "s plane (rad/s)"}${zeros ? ", with the markers of the legend, and invariant zeros, as small dotted circles in the same colours" : ""}. Grid: lines of constant ${grid}. Drag to zoom, double-click to return.`,
    x: discrete ? "Re z" : "Re s (rad/s)", y: discrete ? "Im z" : "Im s (rad/s)",
    views: aspect => poleViews(sets, discrete, aspect),
    entries: sets.map(set => ({ id: set.method, name: `${methodOf(set.method).label}, ${set.poles.length} poles${zeros ? `, ${set.zeros?.length ?? 0} zeros` : ""}`, swatch: swatch(methodOf(set.method).style, true) })),
    marks: sets.flatMap(set => [...set.poles.map(at => mark(set, at, "pole")), ...(set.zeros ?? []).map(at => mark(set, at, "zero"))]),
    draw: map => drawGrid(map) + sets.filter(set => map.shown(set.method)).map(set => markers(set, map)).join(""),
  });

  function mark(set, at, kind) {
    const [re, im] = at, { hz, zeta } = mode(at);
    return { id: set.method, at, text: () => `${methodOf(set.method).label}, ${kind}\n${discrete ? "z" : "s"} = ${fine(re)}${im ? ` ${im < 0 ? "−" : "+"} ${fine(Math.abs(im))}i` : ""}`
      + (discrete ? `\n|z| = ${fine(Math.hypot(re, im))}` : "") + `\n${readOut(hz)} Hz, ζ = ${minus(zeta.toFixed(4))}` };
  }

  function markers(set, { px, py, inside }) {
    const { style } = methodOf(set.method);
    const path = set.poles.filter(inside).map(([re, im]) => markerPath(style.marker, px(re), py(im), 5)).join("");
    const rings = (set.zeros ?? []).filter(inside).map(([re, im]) => markerPath("circle", px(re), py(im), 3)).join("");
    return `<path class="poles" d="${path}" fill="none" stroke="var(${style.colour})" stroke-width="1.7"/><path class="zeros" d="${rings}" fill="none" stroke="var(${style.colour})" stroke-width="1.3" stroke-dasharray="1.6 1.6"/>`;
  }

  function drawGrid({ px, py, inside, line, text, view }) {
    const lines = [], labels = [];
    const placed = [], near = (a, b) => Math.abs(px(a[0]) - px(b[0])) < 30 && Math.abs(py(a[1]) - py(b[1])) < 15;
    const covered = ([x, y]) => sets.some(set => set.poles.some(p => near(p, [x, y]))) || placed.some(p => near(p, [x, y]));
    const [low, high] = frequenciesInView(view);
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
          const places = [0.5, 0.4, 0.6, 0.3, 0.7, 0.2, 0.8].map(t => seen[Math.floor(seen.length * t)]);
          const at = places.find(place => !covered(place)) ?? places[0];
          placed.push(at);
          labels.push(text(px(at[0]), py(at[1]), `ζ ${zeta}`));
        }
      }
    }
    const boundary = discrete ? arcOfUnitCircle(view) : [[0, view.y0], [0, view.y1]];
    const axes = line([[view.x0, 0], [view.x1, 0]], "var(--rule)", 1) + (discrete ? line([[0, view.y0], [0, view.y1]], "var(--rule)", 1) : "");
    return axes + lines.join("") + line(boundary, "var(--ink)", 1.3) + labels.join("");
  }

  function arcOfUnitCircle(view) {
    const [low, high] = frequenciesInView(view).map(f => 2 * Math.PI * f * sampleTime);
    const upper = range(Math.max(0, low * 0.9 - 0.01), Math.min(Math.PI, high * 1.1 + 0.01), 400).map(a => [Math.cos(a), Math.sin(a)]);
    return view.y0 >= 0 ? upper : [...upper.map(([x, y]) => [x, -y]).reverse(), ...upper];
  }

  function frequenciesInView(view) {
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
}

const atMode = (hz, zeta, sign) => [-2 * Math.PI * hz * zeta, sign * 2 * Math.PI * hz * Math.sqrt(1 - zeta * zeta)];

// The same view moved such that little more than room for labels is right of x.
function leftOf(view, x) {
  const shift = x + 0.25 * (view.x1 - view.x0) - view.x1;
  return shift < 0 ? { ...view, x0: view.x0 + shift, x1: view.x1 + shift } : view;
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
  if (!near.length) return [whole];
  const close = { name: "near the unit circle", view: leftOf(around(near, 0.2), Math.max(...near.map(p => p[0]))) };
  return close.view.x1 - close.view.x0 < reach ? [close, whole] : [whole, close];
}
