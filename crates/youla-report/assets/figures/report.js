// The figures of this report.

const FADED = 0.6; // Coherence below which a point of the indirect response is said to carry little.

// Rows of a trace as seconds.
function seconds(trace, clock) {
  let row = 0;
  return trace.steps.map(step => (row += step) * clock.sample_time);
}

const detailOf = clock => clock.detail.end > clock.detail.start ? [clock.detail.start, clock.detail.end - 1].map(k => k * clock.sample_time) : null;

function statement(clock) {
  const length = `${grouped(clock.samples)} samples (${inProse(clock.samples * clock.sample_time)} s)`;
  if (clock.bucket === 1) return `Every one of ${length} is drawn.`;
  const detail = detailOf(clock);
  return `${length}, drawn by minimum and maximum of every ${clock.bucket} samples` +
    (detail ? `; in the shaded detail window, ${inProse(detail[0])} s to ${inProse(detail[1])} s, every sample is drawn.` : ".");
}

// Figures over time: choices above, a stack, and how much of the record is drawn.
function timeFigure(host, choices, clockNow, specNow, sentence) {
  const controls = element("div", { class: "controls" });
  const plotHost = element("div"), caption = element("p", { class: "caption" });
  host.replaceChildren(controls, plotHost, caption);
  const figure = mount(plotHost, () => stack(plotHost, specNow()));
  const whole = element("button", { type: "button", class: "action", onclick: () => figure.plot.reset() }, "Whole record");
  const detail = element("button", { type: "button", class: "action", onclick: () => figure.plot.zoom(...detailOf(clockNow())) }, "Detail window");
  const tell = () => {
    caption.textContent = `${sentence()} ${statement(clockNow())}`;
    whole.hidden = detail.hidden = !detailOf(clockNow());
  };
  controls.append(...choices.filter(c => c.options.length > 1).map(c => chooser(c.label, c.options, k => { c.changed(k); figure.draw(); tell(); })), whole, detail);
  tell();
}

function signalFigure(host, kinds, names, sentence) {
  const experiments = report.experiments.filter(e => e.signals.some(s => kinds.includes(s.kind)));
  let now = experiments[0];
  timeFigure(host,
    [{ label: "Experiment", options: experiments.map(e => e.name), changed: k => { now = experiments[k]; } }],
    () => now.clock,
    () => {
      const shown = now.signals.filter(s => kinds.includes(s.kind));
      const style = { colour: "--measured", dash: [], width: 1 };
      return {
        label: `${sentence} Signals: ${shown.map(s => channelLabel(s.channel)).join(", ")}.`,
        x: { label: "Time", unit: "s" }, detail: detailOf(now.clock), legend: shown.map((s, k) => ({ id: String(k), name: `${prettyName(s.channel.name)}, ${names[s.kind]}`, style: signalStyle(s.kind, style) })),
        panels: shown.map((s, k) => ({
          label: prettyName(s.channel.name), unit: s.channel.unit, height: shown.length > 4 ? 92 : 128,
          curves: [{ id: String(k), x: seconds(s.trace, now.clock), y: s.trace.values, style: signalStyle(s.kind, style) }],
        })),
      };
    }, () => sentence);
}

const signalStyle = (kind, style) => ["input", "alpha"].includes(kind) ? { ...style, colour: "--soft" } : kind === "excitation" ? { ...style, colour: "--indirect" } : style;

function data(host) {
  signalFigure(host, ["input", "output", "excitation"], { input: "input", output: "output", excitation: "excitation" }, "Signals of the record from which the models were identified.");
}

function signals(host) {
  signalFigure(host, ["alpha", "beta"], { alpha: "input of S", beta: "output of S" }, "The signals from which S was identified.");
}

function order(host) {
  for (const choice of report.orders) {
    const { label, style } = methodOf(choice.method);
    stemFigure(host, choice.label || label, { ...style, dash: [] }, choice.values, choice.chosen, "Singular value",
      `Singular values (${choice.label || label}). ${choice.chosen} are kept, ${choice.values.length} are shown.`);
  }
}

function reduction(host) {
  const { hankel, chosen, kept = 0, bound, bound_is_gap, label, orders = [] } = report.reduction;
  const said = bound == null ? "" : ` The error is at most ${inProse(bound)} in the ${bound_is_gap ? "gap metric" : "H∞ norm"}.`;
  const apart = kept ? `, besides ${kept} whose poles are kept as they are` : "";
  stemFigure(host, label, { ...methodOf("hansen_reduced").style, dash: [] }, hankel, chosen - kept, "Hankel singular value", `Hankel singular values (${label}). ${chosen - kept} of ${hankel.length} states are kept${apart}.${said}`);
  if (orders.length) errorsByOrder(host);
}

// Relative errors below this are rounding, as of a model that is not reduced.
const ROUNDING = 1e-9;

// Errors in open and closed loop over the order; shaded: orders that the controller does not stabilise.
function errorsByOrder(host) {
  const { orders, plant_norm, bound_is_gap, chosen } = report.reduction;
  const plotHost = element("div"), rows = orders.filter(o => !o.failure);
  const own = { ...methodOf("hansen_reduced").style, dash: [] };
  const relativeBound = o => o.bound == null ? null : bound_is_gap ? o.bound : plant_norm ? o.bound / plant_norm : null;
  const entries = [
    { id: "closed", name: "closed loop", style: own, of: o => o.closed_loop_relative },
    { id: "open", name: "open loop", style: { ...own, colour: "--soft" }, of: o => o.open_loop_relative },
    { id: "bound", name: bound_is_gap ? "bound (gap)" : "bound", style: { ...own, colour: "--soft", dash: [5, 4], width: 1 }, of: relativeBound },
  ].map(e => ({ ...e, at: rows.filter(o => e.of(o) > ROUNDING) })).filter(e => e.at.length);
  const caption = `Relative errors over the order (H∞ norm); order ${chosen} is taken.` + (rows.some(o => !o.stabilised) ? " Shaded: the controller does not stabilise the reduced model." : "");
  host.append(element("div", {}, element("p", { class: "panel-title" }, "Error against order"), plotHost, element("p", { class: "caption" }, caption)));
  if (!entries.length) return;
  mount(plotHost, () => stack(plotHost, {
    label: `${caption} The numbers are in the table beneath.`, x: { label: "Order", unit: "", whole: true },
    legend: entries.map(({ id, name, style }) => ({ id, name, style })),
    shades: rows.filter(o => !o.stabilised).map(o => [o.order - 0.5, o.order + 0.5]),
    panels: [{ label: "Relative error", unit: "", height: 220, log: true,
      curves: entries.map(e => ({ id: e.id, x: e.at.map(o => o.order), y: e.at.map(e.of), style: e.style })) }],
  }));
}

function stemFigure(host, title, style, values, chosen, label, caption) {
  const largest = Math.max(...values), plotHost = element("div");
  const kept = values.map((v, k) => [k + 1, v]).filter(([, v]) => v > largest * 1e-18);
  host.append(element("div", {}, element("p", { class: "panel-title" }, title), plotHost, element("p", { class: "caption" }, caption)));
  mount(plotHost, () => stack(plotHost, {
    label: caption, x: { label: "Number", unit: "", whole: true }, legend: [],
    panels: [{ label, unit: "", height: 220, log: true, curves: [{ id: "values", x: kept.map(v => v[0]), y: kept.map(v => v[1]), style, chosen }] }],
  }));
}

function verification(host) {
  const records = report.verification;
  let record = records[0], place = 0;
  const outputs = record.outputs.map(o => o.output);
  const name = k => report.outputs[k]?.name ?? `output ${k + 1}`;
  const entry = () => record.outputs.find(o => o.output === outputs[place]) ?? record.outputs[0];
  const fitOf = (method, output) => {
    const found = report.fits.find(f => f.record === record.record && f.output === output && f.method === method);
    return !found ? "" : found.fit == null ? ", diverged" : `, ${minus(found.fit.toFixed(1))} %`;
  };
  timeFigure(host, [
    { label: "Record", options: records.map(r => r.record), changed: k => { record = records[k]; } },
    { label: "Output", options: outputs.map(name), changed: k => { place = k; } },
  ], () => record.clock, () => {
    const { output, measured, predictions } = entry(), clock = record.clock;
    const channel = report.outputs[output] ?? { name: name(output), unit: "" };
    const [low, high] = span(measured.values), room = high - low || 1;
    const time = trace => seconds(trace, clock), size = p => { const [a, b] = span(p.residual.values); return b - a; };
    return {
      label: `Measured and predicted ${channel.name} of ${record.record}, and the residuals beneath. The fits are in the table of fits.`,
      x: { label: "Time", unit: "s" }, detail: detailOf(clock), view: detailOf(clock),
      legend: [{ id: "measured", name: "measured", style: MEASURED }, ...predictions.map(p => {
        const { label, style } = methodOf(p.method);
        return { id: p.method, name: label + fitOf(p.method, output), style };
      })],
      panels: [
        { label: channel.name, unit: channel.unit, height: 280, limits: [low - 0.6 * room, high + 0.6 * room],
          curves: [{ id: "measured", x: time(measured), y: measured.values, style: MEASURED },
            ...predictions.map(p => ({ id: p.method, x: time(p.predicted), y: p.predicted.values, style: methodOf(p.method).style }))] },
        { label: "residual e", short: "e", unit: channel.unit, height: 150, limits: [-room, room],
          curves: [...predictions].sort((a, b) => size(b) - size(a)).map(p => ({ id: p.method, x: time(p.residual), y: p.residual.values, style: { ...methodOf(p.method).style, width: 1.1, dash: [] } })) },
      ],
    };
  }, () => {
    const { output, measured, predictions } = entry();
    const [low, high] = span(measured.values), room = high - low || 1;
    const away = predictions.filter(p => { const [a, b] = span(p.predicted.values); return a < low - 0.6 * room || b > high + 0.6 * room; });
    return `${name(output)} of ${record.record}, ${record.prediction}; beneath, measured less predicted.` +
      (away.length ? ` Axes follow the measured signal; ${away.map(p => methodOf(p.method).label).join(", ")} leaves them.` : "");
  });
}

// Correlations of the residuals over lags, all models in one figure, with the widest band.
function residuals(host) {
  const { tests, external } = report.residuals;
  const records = [...new Set(tests.map(t => t.record))], outputs = report.outputs.map(o => o.name), inputs = tests[0].excitations;
  let record = records[0], output = 0, input = 0;
  const controls = element("div", { class: "controls" }), plotHost = element("div"), caption = element("p", { class: "caption" });
  host.append(controls, plotHost, caption);
  const shown = () => tests.filter(t => t.record === record);
  const panel = (label, of, first) => {
    const all = shown().map(t => ({ method: t.method, ...of(t) })).filter(c => c.values?.length);
    const band = Math.max(...all.map(c => c.band)), last = first + all[0].values.length - 1;
    const level = (y, k) => ({ id: `band${k}`, x: [first, last], y: [y, y], style: { colour: "--soft", dash: [4, 4], width: 1 } });
    return { label, unit: "", height: 180, curves: [level(band, 1), level(-band, 2),
      ...all.map(c => ({ id: c.method, x: c.values.map((_, k) => first + k), y: c.values, style: methodOf(c.method).style }))] };
  };
  const lags = () => (shown()[0].cross[0].values.length - 1) / 2;
  const figure = mount(plotHost, () => stack(plotHost, {
    label: `Correlations of the residual of ${outputs[output]} on ${record}.`,
    x: { label: "Lag", unit: "samples", whole: true },
    legend: shown().map(t => ({ id: t.method, name: methodOf(t.method).label, style: methodOf(t.method).style })),
    panels: [panel(`with ${inputs[input]}`, t => t.cross[output * inputs.length + input], -lags()), panel("with itself", t => t.auto[output], 0)],
  }));
  const tell = () => {
    caption.textContent = `Correlation of the residual of ${outputs[output]} with ${inputs[input]} and with itself. Dashed: the widest band of 99 % of all models for residuals that are noise. ` +
      (external ? "Positive lags judge the model; negative ones only show what is fed back." : "No excitation from outside is known: the input holds fed-back noise, and judges nothing.");
  };
  const choose = (label, options, changed) => { if (options.length > 1) controls.append(chooser(label, options, k => { changed(k); figure.draw(); tell(); })); };
  choose("Record", records, k => { record = records[k]; });
  choose("Output", outputs, k => { output = k; });
  choose("Excitation", inputs, k => { input = k; });
  tell();
}

function span(values) {
  let low = Infinity, high = -Infinity;
  for (const v of values) if (v != null) { low = Math.min(low, v); high = Math.max(high, v); }
  return low <= high ? [low, high] : [0, 0];
}

const opacityOf = coherence => coherence == null ? 0.1 : 0.08 + 0.92 * Math.min(1, Math.max(0, (coherence - 0.2) / 0.7)) ** 2;
const percent = level => `${+(100 * level).toPrecision(4)} %`;

// Bode and Nyquist diagrams of one pair of output and input, and the singular values of all together.
function frequency(host) {
  const { models, indirect, singular = [] } = report.frequency;
  const pairs = [];
  for (const { output, input } of [...models, ...indirect]) if (!pairs.some(p => p.output === output && p.input === input)) pairs.push({ output, input });
  pairs.sort((a, b) => a.output - b.output || a.input - b.input);
  const nameOf = (list, k, word) => list[k]?.name ?? `${word} ${k + 1}`;
  const title = p => `${nameOf(report.outputs, p.output, "output")} from ${nameOf(report.inputs, p.input, "input")}`;
  let pair = pairs[0], view = 0;
  const views = [["Bode", bode], ["Nyquist", nyquistMap], ...(singular.length ? [["Singular values", singularValues]] : [])];
  const plotHost = element("div"), controls = element("div", { class: "controls" });
  host.append(controls, plotHost);
  const figure = mount(plotHost, () => views[view][1](plotHost, title(pair), pair));
  controls.append(chooser("View", views.map(v => v[0]), k => { view = k; of.hidden = views[k][1] === singularValues; figure.draw(); }));
  const of = pairs.length > 1 ? chooser("Response of", pairs.map(title), k => { pair = pairs[k]; figure.draw(); }) : element("span");
  controls.append(of);
}

// A stack with its caption, as one figure.
function captioned(host, caption, build) {
  const plotHost = element("div");
  host.replaceChildren(plotHost, element("p", { class: "caption" }, caption));
  const plot = build(plotHost);
  return { ...plot, destroy() { plot.destroy(); host.replaceChildren(); } };
}

function bode(host, title, pair) {
  const { hz, models, indirect, bands } = report.frequency;
  const same = curve => curve.output === pair.output && curve.input === pair.input;
  const measured = indirect.filter(same), shown = models.filter(same), regions = bands.filter(same);
  const caption = `Frequency response, ${title}.` + (measured.length ? ` Points: indirect non-parametric response, estimated with the external excitation and without any model; the fainter a point, the lower its coherence. In shaded bands coherence is below ${FADED} and the points say little.` : "") +
    (regions.length ? ` Filled: where the magnitude of ${regions.map(b => methodOf(b.method).label).join(" and of ")} lies with a probability of ${percent(regions[0].level)} at each frequency.` : "");
  const curves = part => [
    ...measured.map(m => ({ id: "indirect", x: m.hz, y: m[part], style: INDIRECT, opacity: m.coherence.map(opacityOf) })),
    ...shown.map(m => ({ id: m.method, x: hz, y: m[part], style: methodOf(m.method).style })),
  ];
  return captioned(host, caption, plotHost => stack(plotHost, {
    label: `Bode diagram, ${title}: magnitude and phase of ${shown.map(m => methodOf(m.method).label).join(", ")}${measured.length ? ", and the indirect response with its coherence" : ""}.`,
    x: { label: "Frequency", unit: "Hz", log: true }, shades: measured.flatMap(lowCoherence),
    legend: [...regions.map(bandEntry), ...(measured.length ? [{ id: "indirect", name: "indirect", style: INDIRECT }] : []), ...shown.map(m => ({ id: m.method, name: methodOf(m.method).label, style: methodOf(m.method).style }))],
    panels: [
      { label: "Magnitude", unit: "dB", axisUnit: gainUnit(pair), height: 280, curves: [...regions.map(b => band(b, `band-${b.method}`)), ...curves("magnitude_db")] },
      { label: "Phase", unit: "deg", height: 200, steps: [5, 15, 30, 45, 90, 180, 360, 720], curves: curves("phase_deg") },
      ...(measured.length ? [{ label: "Coherence γ²", short: "γ²", unit: "", height: 84, fixed: [0, 1.04],
        curves: measured.map(m => ({ id: "indirect", x: m.hz, y: m.coherence, style: { ...INDIRECT, points: false, width: 1.2 } })) }] : []),
    ],
  }));
}

function gainUnit({ output, input }) {
  const units = [report.outputs[output]?.unit, report.inputs[input]?.unit];
  return units[0] && units[1] ? `dB re ${prettyUnit(units[0])}/${prettyUnit(units[1])}` : "dB";
}

// The principal gains: how strongly the plant answers in its strongest and its weakest direction.
function singularValues(host) {
  const { hz, singular } = report.frequency;
  const regions = singular.filter(s => s.level != null), shown = [...new Set(singular.map(s => s.method))];
  const caption = "Singular values of the response of all outputs from all inputs, in the units of the channels." +
    (regions.length ? ` Filled: where those of ${[...new Set(regions.map(s => methodOf(s.method).label))].join(" and of ")} lie with a probability of ${percent(regions[0].level)} at each frequency; where two of them meet, the bounds say little.` : "");
  return captioned(host, caption, plotHost => stack(plotHost, {
    label: `Singular values over frequency: ${shown.map(key => methodOf(key).label).join(", ")}.`,
    x: { label: "Frequency", unit: "Hz", log: true },
    legend: [...regions.filter(s => s.place === 0).map(bandEntry), ...shown.map(key => ({ id: key, name: methodOf(key).label, style: methodOf(key).style }))],
    panels: [{ label: "Singular values", unit: "dB", height: 340, curves: [...regions.map(s => band(s, `band-${s.method}`)),
      ...singular.map(s => ({ id: s.method, x: hz, y: s.value_db, style: methodOf(s.method).style }))] }],
  }));
}

// The scheme's own band has a colour of its own, that of another method its colour, faint.
const faint = b => b.method !== "hansen";
const bandStyle = b => ({ ...methodOf(b.method).style, width: 6, dash: [], points: false, ...(faint(b) ? {} : { colour: "--band" }) });

const bandEntry = b => ({ id: `band-${b.method}`, name: `${methodOf(b.method).label}, ${percent(b.level)}`, style: bandStyle(b) });

// The region between bounds, filled under the curves.
function band(b, id) {
  const { hz } = report.frequency;
  return { id, x: hz, y: b.high_db, style: bandStyle(b), draw: u => clipped(u, ctx => {
    const at = (values, k) => [u.valToPos(hz[k], "x", true), u.valToPos(values[k], "y", true)];
    const known = hz.map((_, k) => k).filter(k => b.low_db[k] != null && b.high_db[k] != null);
    ctx.fillStyle = colour(bandStyle(b).colour);
    if (faint(b)) ctx.globalAlpha = 0.25;
    ctx.beginPath();
    known.forEach(k => ctx.lineTo(...at(b.high_db, k)));
    known.reverse().forEach(k => ctx.lineTo(...at(b.low_db, k)));
    ctx.fill();
    ctx.globalAlpha = 1;
  }) };
}

// Bands of at least three neighbouring points of low coherence.
function lowCoherence({ hz, coherence }) {
  const bands = [];
  for (let k = 0, start = 0; k <= hz.length; k++) {
    if (k < hz.length && !(coherence[k] >= FADED)) continue;
    if (k - start >= 3) bands.push([hz[start], hz[k - 1]]);
    start = k + 1;
  }
  return bands;
}

function poles(host) {
  if (report.poles.some(set => set.poles.length)) poleMap(host, report.poles, report.sample_time);
}

// A line of the verdict leads nowhere where the run has no such part.
for (const link of document.querySelectorAll(".evidence")) if (!document.querySelector(link.hash)) link.remove();

const BUILDERS = { data, signals, order, stabilisation, verification, residuals, frequency, poles, reduction };
for (const host of document.querySelectorAll("[data-figure]")) BUILDERS[host.dataset.figure](host);

// Worst closed-loop poles of discrete loops are judged by their magnitude.
if (report.sample_time != null) {
  const rows = document.querySelector("#certificate tbody")?.rows ?? [];
  [...rows].forEach((row, k) => {
    const pole = report.certificates[k]?.worst_closed_loop_pole;
    if (pole) row.lastElementChild.append(`, |z| = ${Math.hypot(...pole).toFixed(6)}`);
  });
}
