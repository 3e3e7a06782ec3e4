// The loop that other gains would have, on the whole region of the model, while they are edited.

/** Peak sensitivities above which a loop has little margin, and is nearly unstable: 4 ends zone B of ISO 14839-3, unrestricted operation. */
const LITTLE = 2, NEARLY = 4;

const gains = (() => {
  const place = /** @type {HTMLElement} */ (document.getElementById("gain-fields")), said = /** @type {HTMLElement} */ (document.getElementById("gain-verdict")), host = /** @type {HTMLElement} */ (document.getElementById("gain-plots"));
  const by = (/** @type {string} */ id) => /** @type {any} */ (document.getElementById(id)), reset = by("gains-reset"), caution = by("gain-caution"), saved = by("gains-saved"), figures = by("gain-figures");
  const worstOf = (/** @type {any} */ found) => Math.max(found.margins.sensitivity, found.worst_sensitivity);
  let run = "", asked = false, again = false, shape = "";
  let /** @type {any} */ edited = null, /** @type {any} */ ran = null, /** @type {any} */ before = null, /** @type {any} */ plots = {};

  /** @param {string} shown */
  async function show(shown) {
    [run, ran] = [shown, null];
    said.textContent = "";
    document.body.classList.remove("has-gains");
    const drawn = await engine.ask({ verb: "draw", run });
    if (run !== shown) return;
    if (drawn.error) return;
    const answer = await engine.ask({ verb: "table", toml: new TextDecoder().decode(engine.files.get(`${run}/run.toml`)) });
    before = await engine.ask({ verb: "loop", run, controller: null });
    if (run !== shown || !answer.controller) return;
    ran = answer.controller;
    edited = onTrial();
    document.body.classList.add("has-gains");
    fields();
    ask();
  }

  /** The gains on trial where they are those of the form that ran, with the sign of the controller that ran, which is no gain. */
  function onTrial() {
    const form = Object.keys(ran)[0], trial = settings.trial?.[form], fits = trial && loopsOf(settings.trial) === loopsOf(ran);
    return structuredClone(fits ? { [form]: { ...trial, feedback: ran[form].feedback } } : ran);
  }

  const same = (/** @type {any} */ a, /** @type {any} */ b) => JSON.stringify(a) === JSON.stringify(b);
  const keep = () => settings.try(same(edited, ran) ? null : structuredClone(edited));
  reset.addEventListener("click", () => settings.try(null));
  by("gains-save").addEventListener("click", () => {
    download("controller.json", new TextEncoder().encode(JSON.stringify(edited, null, 2)));
    saved.textContent = "Saved as controller.json.";
  });
  settings.listen(() => {
    if (!ran || same(edited, onTrial())) return;
    edited = onTrial();
    // The field that is left has the focus until the next one takes it.
    setTimeout(fields);
    ask();
  });

  function fields() {
    const form = Object.keys(edited)[0], values = edited[form];
    const changed = (name, value) => { setKey(values, name, value); ask(); }, kept = (name, value) => { changed(name, value); keep(); setTimeout(fields); };
    const loops = name => [values[name]].flat().keys(), sliders = ["kp", "ki", "kd", "ti", "td"].filter(name => values[name] !== undefined)
      .flatMap(name => [...loops(name)].filter(k => [values[name]].flat()[k] > 0).map(k => slider(name, k, values, changed)));
    refill(place, ...sliders, element("div", { class: "fields" }, ...(FORMS[form] ? formFields(form, values, kept) : [])));
  }

  /** A factor from a tenth to ten times the value of the controller that ran, in one loop. @param {string} name @param {number} k @param {any} values @param {(name: string, value: number | number[]) => void} changed */
  function slider(name, k, values, changed) {
    const all = () => [values[name]].flat(), several = all().length > 1, title = several ? `${name}, loop ${k + 1}` : name;
    const base = [Object.values(ran)[0][name]].flat()[k] || all()[k], place10 = Math.max(-1, Math.min(1, Math.log10(all()[k] / base)));
    const input = element("input", { type: "range", min: -1, max: 1, step: 0.005, value: place10, "aria-label": `${title}, from a tenth to ten times that of the controller that ran` }), shown = element("output", {}, readOut(all()[k]));
    input.addEventListener("input", () => {
      const value = Number((base * 10 ** Number(input.value)).toPrecision(4)), field = place.querySelector(`.fields input[data-name="${name}"]`);
      shown.textContent = readOut(value);
      const next = all().map((was, of) => of === k ? value : was);
      if (field instanceof HTMLInputElement) field.value = gainText(next);
      changed(name, several ? next : value);
    });
    input.addEventListener("change", keep);
    return element("label", { class: "slider" }, element("span", {}, title), input, shown);
  }

  /** Name, unit and value of each figure, and which of more (1) and less (-1) is worse; infinite without a limit, null without a value. @param {any} found @returns {[string, string, number | null, number][] | null} */
  function figuresOf(found) {
    const m = found?.margins;
    if (!m) return null;
    const k = found.sensitivity.centre.findIndex(v => v > Math.SQRT1_2);
    return [["Peak sensitivity", "", m.sensitivity, 1], ["Peak sensitivity, at worst over the region", "", worstOf(found), 1], ["Phase margin", "°", m.phase ?? Infinity, -1],
      ["Gain margin, largest stable factor", "", m.gain_up ?? Infinity, -1], ["Gain margin, smallest stable factor", "", m.gain_down > 1e-6 ? m.gain_down : 0, 1], ["Delay margin", " ms", m.delay == null ? Infinity : 1e3 * m.delay, -1],
      ["S is below −3 dB up to", " Hz", k > 0 ? found.hz[k] : null, -1], ["Overshoot", " %", 100 * Math.max(0, Math.max(...found.step[0].centre) - 1), 1], ["Largest command for a unit step", "", Math.max(...found.command.flatMap(c => c.centre.map(Math.abs))), 0]];
  }

  /** The figures beside those of the controller that ran; what became worse is marked. @param {any} found */
  function compared(found) {
    const now = figuresOf(found), then = figuresOf(before), cell = (kind, text) => element("td", { class: kind }, text);
    const row = ([name, unit, , worse], k) => {
      const [a, b] = [now, then].map(of => of?.[k][2] ?? null), [here, there] = [a, b].map(v => v == null ? "–" : v === Infinity ? "no limit" : `${readOut(v)}${unit}`);
      const bad = a != null && b != null && worse * (a - b) > 0 && here !== there;
      return element("tr", {}, element("th", { scope: "row" }, name), cell(`number ${bad ? "no" : ""}`, here), cell("number", there), cell("no", bad ? "worse" : ""));
    };
    const head = ["", "These gains", "Controller that ran", ""].map((text, k) => element("th", { scope: "col", class: k % 3 ? "number" : null }, text));
    figures.replaceChildren(element("table", {}, element("thead", {}, element("tr", {}, ...head)), element("tbody", {}, ...(now ?? then ?? []).map(row))));
  }

  /** What is said of gains: the colour, a word beside the button that saves them, the sentence. @param {any} found */
  function verdictOf(found) {
    const { draws, drawn } = found, part = drawn > draws, models = `all ${draws} models ${part ? "that the controller that ran stabilises" : "of the region"}`;
    const rest = part ? ` The controller that ran does not stabilise ${drawn - draws} of ${drawn} models drawn from the region, which the log contradicts; they are left out.` : "";
    if (!found.stable) return ["bad", "Unstable", `Unstable on the recommended model: largest pole ${readOut(found.worst_pole)}.${rest}`];
    if (found.unstable) return ["bad", `Unstable on ${found.unstable} of ${draws} models`, `Unstable on ${found.unstable} of ${draws} models ${part ? "that the controller that ran stabilises" : "of the region"}.${rest}`];
    const worst = worstOf(found), peak = `${readOut(found.margins.sensitivity)}, at worst ${readOut(worst)} over the region`, word = worst > NEARLY ? "Nearly unstable" : "Little margin";
    if (worst <= LITTLE && found.beyond) return ["caution", "Beyond what the model shows", `Stable on ${models}; but the loop still acts at ${readOut(found.beyond.hz)} Hz (|I - S| ${readOut(found.beyond.gain)}), and no response is valid to 10 % above ${readOut(found.beyond.valid_to)} Hz: a resonance that the model lacks there may make it unstable. Peak sensitivity ${peak}.${rest}`];
    if (worst <= LITTLE) return ["good", "", `Stable on ${models}; peak sensitivity ${peak}.${rest}`];
    return [worst > NEARLY ? "bad" : "caution", `${word}: peak sensitivity ${readOut(worst)}`, `${word}: stable on ${models}, but the peak sensitivity is ${peak}; ${worst > NEARLY ? "ISO 14839-3 allows up to 4 for unrestricted operation" : "up to 2 is good"}.${rest}`];
  }

  // The running loop's curve at the places of the new one, held at its end.
  const held = (t, xs, ys) => t.map(at => { const k = xs.findIndex(x => x >= at); return k < 0 ? ys[ys.length - 1] : ys[k]; });

  // The newest gains are asked for as soon as the answer before is there.
  async function ask() {
    if (asked) { again = true; return; }
    asked = true;
    reset.disabled = same(edited, ran);
    saved.textContent = "";
    const open = edited.state_space && !edited.state_space.a.length, answer = await engine.ask({ verb: "loop", run, controller: open ? null : edited });
    asked = false;
    if (again) { again = false; ask(); }
    draw(answer);
  }

  matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => { if (plots.drawn) locus(plots.drawn); });

  /** @param {any} found */
  function draw(found) {
    const [kind, word, sentence] = found.error ? ["bad", "", found.error] : verdictOf(found);
    Object.assign(said, { className: `headline ${kind}`, textContent: sentence });
    Object.assign(caution, { className: kind, textContent: word && `${word}.` });
    compared(found);
    if (found.error) return;
    const safe = found.stable && !found.unstable;
    const wanted = JSON.stringify([run, found.outputs, found.inputs, !!found.locus]);
    if (wanted !== shape) { shape = wanted; build(found); }
    host.classList.toggle("unsafe", !safe);
    const empty = p => p.setData(p.series.map(() => [null]));
    if (safe) {
      const then = (of, k) => before?.[of] ? held(found.t, before.t, before[of][k].centre) : found.t.map(() => null);
      const s = found.sensitivity, db = values => values.map(v => 20 * Math.log10(v));
      plots.s.setData([found.hz, db(s.centre), db(s.high), db(s.low), before?.sensitivity ? db(before.sensitivity.centre) : found.hz.map(() => null)]);
      found.outputs.forEach((_, k) => plots.step[k].setData([found.t, found.step[k].centre, found.step[k].high, found.step[k].low, then("step", k)]));
      found.inputs.forEach((_, k) => plots.command[k].setData([found.t, found.command[k].centre, found.command[k].high, found.command[k].low, then("command", k)]));
    } else [plots.s, ...plots.step, ...plots.command].forEach(empty);
    plots.drawn = found.locus && found;
    if (found.locus) locus(found);
  }

  function build(found) {
    const cell = title => { const div = element("div", {}, element("p", { class: "panel-title" }, title)); host.append(div); return div; };
    host.replaceChildren();
    const lines = [{ label: "recommended model", colour: "--recommended" }, { label: "highest", colour: "--recommended", width: 0.4 }, { label: "lowest", colour: "--recommended", width: 0.4 }, { label: "controller that ran", colour: "--soft", dash: [4, 3] }];
    host.append(key([lines[0], lines[3]]));
    const banded = (title, x, y, logX) => curves(cell(title), { x, y, logX, height: 200, lines, bands: [[2, 3, "--recommended"]] });
    plots = { s: banded("Sensitivity, with its range over the region", "Frequency (Hz)", "dB", true) };
    if (found.locus) { plots.canvas = element("canvas", { class: "locus", role: "img", "aria-label": "Locus of the loop gain" }); cell("Loop gain; circles: peak sensitivity 2 and 4").append(plots.canvas); }
    plots.step = found.outputs.map(name => banded(`Step of the reference: ${name}`, "Time (s)", "", false));
    plots.command = found.inputs.map(name => banded(`and the command: ${name}`, "Time (s)", "", false));
  }

  // A locus runs back and forth over its axis, which uPlot does not draw.
  function locus({ locus: [re, im], loci }) {
    const { canvas } = plots, ratio = devicePixelRatio, size = Math.min(360, canvas.parentElement.clientWidth);
    Object.assign(canvas, { width: size * ratio, height: size * 0.8 * ratio });
    canvas.style.width = `${size}px`;
    const ctx = canvas.getContext("2d"), scale = canvas.width / 6, X = v => canvas.width * 0.62 + v * scale, Y = v => canvas.height / 2 - v * scale;
    const line = (xs, ys, ink, width) => { ctx.beginPath(); xs.forEach((x, k) => ctx.lineTo(X(x), Y(ys[k]))); Object.assign(ctx, { strokeStyle: ink, lineWidth: width * ratio }); ctx.stroke(); };
    line([-9, 9], [0, 0], colour("--grid"), 1);
    line([0, 0], [-9, 9], colour("--grid"), 1);
    for (const radius of [0.5, 0.25]) { ctx.beginPath(); ctx.arc(X(-1), Y(0), radius * scale, 0, 7); ctx.strokeStyle = colour("--soft"); ctx.setLineDash([4, 3]); ctx.stroke(); ctx.setLineDash([]); }
    ctx.globalAlpha = 0.3;
    for (const [xs, ys] of loci) line(xs, ys, colour("--recommended"), 0.8);
    ctx.globalAlpha = 1;
    line(re, im, colour("--recommended"), 1.6);
    ctx.fillStyle = colour("--ink");
    ctx.beginPath(); ctx.arc(X(-1), Y(0), 3 * ratio, 0, 7); ctx.fill();
  }

  return { show };
})();
