// The Nyquist diagram of one pair of output and input: curves over frequency in the complex plane, with their regions.

function nyquistMap(host, title, pair) {
  const { hz, models, indirect, bands } = report.frequency;
  const same = curve => curve.output === pair.output && curve.input === pair.input;
  const complex = ({ magnitude_db, phase_deg }) => magnitude_db.map((db, k) => {
    const size = db == null ? NaN : 10 ** (db / 20), angle = (phase_deg[k] ?? NaN) * Math.PI / 180;
    return [size * Math.cos(angle), size * Math.sin(angle)];
  });
  const curves = models.filter(same).map(m => ({ id: m.method, style: methodOf(m.method).style, name: methodOf(m.method).label, hz, at: complex(m), band: bands.find(b => same(b) && b.method === m.method && b.region?.length) }));
  const measured = indirect.filter(same).map(m => ({ id: "indirect", style: INDIRECT, name: "indirect", hz: m.hz, at: complex(m), coherence: m.coherence }));
  const regions = curves.filter(c => c.band);
  const finite = ([re, im]) => Number.isFinite(re) && Number.isFinite(im);
  return plane(host, {
    label: `Nyquist diagram, ${title}: ${[...measured, ...curves].map(c => c.name).join(", ")}.`,
    caption: `Nyquist diagram, ${title}: the response in the complex plane, equal scales, from ${readOut(hz[0])} to ${readOut(hz[hz.length - 1])} Hz.` +
      (regions.length ? ` Ellipses: where the response of ${regions.map(c => c.name).join(" and of ")} lies with a probability of ${inProse(100 * regions[0].band.level)} % at each of some frequencies.` : "") +
      (measured.length ? " Points: indirect non-parametric response, the fainter the lower its coherence." : "") + " Drag to zoom, double-click to return.",
    x: "Real part", y: "Imaginary part",
    views: aspect => nyquistViews(curves.flatMap(c => c.at).filter(finite), aspect),
    entries: [...measured, ...curves].map(({ id, name, style }) => ({ id, name, swatch: swatch(style) })),
    marks: [...measured, ...curves].flatMap(c => c.at.map((at, k) => ({ id: c.id, at, text: () => `${c.name}\n${readOut(c.hz[k])} Hz\n${readOut(at[0])} ${at[1] < 0 ? "−" : "+"} ${readOut(Math.abs(at[1]))}i` }))),
    draw: map => axes(map) + regions.filter(c => map.shown(c.id)).map(c => ellipses(c, map)).join("") +
      measured.filter(c => map.shown(c.id)).map(c => points(c, map)).join("") +
      curves.filter(c => map.shown(c.id)).map(c => map.line(c.at.filter(finite), `var(${c.style.colour})`, c.style.width, c.style.dash.join(" "))).join("") +
      frequencies(curves.find(c => c.id === "hansen" && map.shown(c.id)) ?? curves.find(c => map.shown(c.id)), map),
  });

  function axes({ line, view }) {
    return line([[view.x0, 0], [view.x1, 0]], "var(--rule)", 1) + line([[0, view.y0], [0, view.y1]], "var(--rule)", 1);
  }

  function points(c, { px, py, inside }) {
    return c.at.map((at, k) => !finite(at) || !inside(at) ? "" : `<circle cx="${px(at[0]).toFixed(1)}" cy="${py(at[1]).toFixed(1)}" r="1.8" fill="var(${c.style.colour})" fill-opacity="${opacityOf(c.coherence[k]).toFixed(2)}"/>`).join("");
  }

  // d' V^-1 d = 1: the axes are the eigenvectors of V.
  function ellipses(c, { px, py, inside, view, frame }) {
    const scale = frame.w / (view.x1 - view.x0), every = Math.max(1, Math.floor(c.at.length / 60));
    return c.at.map((at, k) => {
      if (k % every || !finite(at) || !inside(at)) return "";
      const [rr, ri, ii] = c.band.region.slice(3 * k, 3 * k + 3);
      const mean = (rr + ii) / 2, half = Math.hypot((rr - ii) / 2, ri), angle = Math.atan2(2 * ri, rr - ii) / 2;
      const [a, b] = [mean + half, Math.max(0, mean - half)].map(v => Math.sqrt(v) * scale);
      if (!(a < 4 * frame.w)) return "";
      return `<ellipse transform="translate(${px(at[0]).toFixed(1)} ${py(at[1]).toFixed(1)}) rotate(${(-angle * 180 / Math.PI).toFixed(1)})" rx="${a.toFixed(1)}" ry="${b.toFixed(1)}" fill="var(${faint(c.band) ? c.style.colour : "--band"})" fill-opacity="${faint(c.band) ? 0.12 : 0.45}"/>`;
    }).join("");
  }

  // Dots with their frequency where there is room.
  function frequencies(c, { px, py, inside, text }) {
    if (!c) return "";
    const placed = [], out = [];
    for (const wanted of [1, 2, 5].flatMap(m => range(-2, 5, 7).map(e => m * 10 ** e))) {
      const k = hz.findIndex((f, k) => f <= wanted && wanted < hz[k + 1]);
      if (k < 0 || !finite(c.at[k]) || !finite(c.at[k + 1])) continue;
      const t = (wanted - hz[k]) / (hz[k + 1] - hz[k]), at = c.at[k].map((v, i) => v + t * (c.at[k + 1][i] - v));
      const [x, y] = [px(at[0]), py(at[1])];
      if (!inside(at) || placed.some(([a, b]) => Math.abs(a - x) < 66 && Math.abs(b - y) < 18)) continue;
      placed.push([x, y]);
      out.push(`<circle cx="${x.toFixed(1)}" cy="${y.toFixed(1)}" r="2.6" fill="var(--ink)"/>`, text(x + 7, y - 8, `${inProse(wanted)} Hz`, "start"));
    }
    return out.join("");
  }
}

// The whole, and closer in, what is smaller than the upper quartile of the magnitudes.
function nyquistViews(points, aspect) {
  const around = some => {
    const [re, im] = [0, 1].map(k => [...some.map(p => p[k]), 0]);
    const pad = 0.08 * Math.max(Math.max(...re) - Math.min(...re), Math.max(...im) - Math.min(...im), 1e-12);
    return widened([Math.min(...re) - pad, Math.max(...re) + pad], [Math.min(...im) - pad, Math.max(...im) + pad], aspect);
  };
  const sizes = points.map(p => Math.hypot(...p)).sort((a, b) => a - b);
  const limit = sizes[Math.floor(0.75 * (sizes.length - 1))];
  const whole = { name: "whole", view: around(points) }, close = { name: "near zero", view: around(points.filter(p => Math.hypot(...p) <= limit)) };
  return close.view.x1 - close.view.x0 < 0.6 * (whole.view.x1 - whole.view.x0) ? [whole, close] : [whole];
}
