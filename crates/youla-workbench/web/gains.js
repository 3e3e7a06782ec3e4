// The loop that other gains would have, on the whole region of the model, while they are edited.

const gains = (() => {
  const place = /** @type {HTMLElement} */ (document.getElementById("gain-fields")), said = /** @type {HTMLElement} */ (document.getElementById("gain-verdict")), host = /** @type {HTMLElement} */ (document.getElementById("gain-plots"));
  const by = (/** @type {string} */ id) => /** @type {any} */ (document.getElementById(id)), reset = by("gains-reset");
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
  by("gains-save").addEventListener("click", () => download("controller.json", new TextEncoder().encode(JSON.stringify(edited, null, 2))));
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

  // Where S first exceeds -3 dB, overshoot of the first output, largest command for a unit step of the reference.
  function figuresOf(found) {
    if (!found?.sensitivity) return null;
    const k = found.sensitivity.centre.findIndex(v => v > Math.SQRT1_2);
    return [k > 0 ? found.hz[k] : null, 100 * Math.max(0, Math.max(...found.step[0].centre) - 1), Math.max(...found.command.flatMap(c => c.centre.map(Math.abs)))];
  }

  function compared(found) {
    const now = figuresOf(found), then = figuresOf(before), words = ["S below −3 dB up to", "overshoot", "largest command for a unit step"], units = [" Hz", " %", ""];
    if (!now || !then) return "";
    const said = words.map((word, k) => now[k] == null || then[k] == null ? null : `${word} ${readOut(now[k])}${units[k]} (controller that ran: ${readOut(then[k])}${units[k]})`).filter(Boolean);
    return said.length ? ` ${said.join("; ")}.`.replace(" S below", " S is below") : "";
  }

  // The running loop's curve at the places of the new one, held at its end.
  const held = (t, xs, ys) => t.map(at => { const k = xs.findIndex(x => x >= at); return k < 0 ? ys[ys.length - 1] : ys[k]; });

  // The newest gains are asked for as soon as the answer before is there.
  async function ask() {
    if (asked) { again = true; return; }
    asked = true;
    reset.disabled = same(edited, ran);
    const open = edited.state_space && !edited.state_space.a.length, answer = await engine.ask({ verb: "loop", run, controller: open ? null : edited });
    asked = false;
    if (again) { again = false; ask(); }
    draw(answer);
  }

  /** @param {any} found */
  function draw(found) {
    const note = (/** @type {string} */ kind, /** @type {string} */ text) => { said.className = `headline ${kind}`; said.textContent = text; };
    if (found.error) return note("bad", found.error);
    const safe = found.stable && !found.unstable;
    if (!found.stable) note("bad", `Unstable on the recommended model: largest pole ${readOut(found.worst_pole)}.`);
    else if (found.unstable) note("bad", `Unstable on ${found.unstable} of ${found.draws} models of the region.`);
    else {
      const m = found.margins, worst = Math.max(m.sensitivity, found.worst_sensitivity), parts = [`peak sensitivity ${readOut(m.sensitivity)}, at worst ${readOut(worst)} over the region`, m.phase != null ? `phase margin ${readOut(m.phase)}°` : null,
        m.gain_up != null ? `unstable at ${readOut(m.gain_up)} times the gain` : null, m.gain_down > 1e-6 ? `and at ${readOut(m.gain_down)} times` : null, m.delay != null ? `delay margin ${readOut(m.delay * 1e3)} ms` : null].filter(Boolean);
      note(worst <= 4 ? "good" : "caution", `Stable on all ${found.draws} models of the region; ${parts.join(", ")}.${compared(found)}`);
    }
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
