// Traces of all channels, with the ranges that identify and verify, and the findings of the check where they are in time.

const signals = (() => {
  const host = /** @type {HTMLElement} */ (document.getElementById("traces")), spectra = /** @type {HTMLElement} */ (document.getElementById("spectra")), listed = /** @type {HTMLElement} */ (document.getElementById("findings"));
  const modes = /** @type {HTMLElement} */ (document.getElementById("range-mode")), saidOfController = /** @type {HTMLElement} */ (document.getElementById("controller-said")), defect = /** @type {HTMLElement} */ (document.getElementById("defect"));
  /** @type {any[]} */
  let plots = [];
  const PALETTE = ["--hansen", "--direct", "--hansen-reduced", "--pem", "--other-1", "--other-4"];
  let mode = "zoom", loaded = "", checking = 0;
  /** @type {any[]} */
  let findings = [], drawnCurves = [];

  modes.append(chooser("Drag a range to", ["zoom", "identify from it", "verify on it"], k => { mode = ["zoom", "estimation", "verification"][k]; }));

  /** First and last second of a part of the log. @param {string} purpose @returns {[number, number][]} */
  function ranges(purpose) {
    const ts = log.sampleTime() ?? 1, file = log.file(), rows = Math.max(0, ...log.survey(file ?? "").columns.map(c => c.rows ?? 0));
    return (settings.table.data[purpose] ?? []).filter(f => f.file === file)
      .map(f => [(f.skip ?? 0) * ts, (f.take == null ? rows : Math.min(rows, (f.skip ?? 0) + f.take)) * ts]);
  }

  /** @param {any} u */
  function shade(u) {
    const { left, top, width, height } = u.bbox, { ctx } = u;
    const fill = (from, to, name, share, y = top, h = height) => {
      const a = Math.max(left, u.valToPos(from, "x", true)), b = Math.min(left + width, u.valToPos(to, "x", true));
      if (b <= a) return;
      Object.assign(ctx, { fillStyle: colour(name), globalAlpha: share });
      ctx.fillRect(a, y, Math.max(2, b - a), h);
      ctx.globalAlpha = 1;
    };
    for (const [from, to] of ranges("estimation")) fill(from, to, "--link", 0.09);
    for (const [from, to] of ranges("verification")) fill(from, to, "--good", 0.11);
    const ts = log.sampleTime() ?? 1;
    for (const { rows, channel, severity } of findings) if (rows && (!channel || channel === u.channel || channel === u.short)) fill((rows[0] - 1) * ts, rows[1] * ts, severity === "defect" ? "--bad" : severity === "caution" ? "--caution" : "--info", 0.75, top, 5 * devicePixelRatio);
  }

  /** @param {any} u */
  function selected(u) {
    if (u.select.width < 4) return;
    const [from, to] = [u.posToVal(u.select.left, "x"), u.posToVal(u.select.left + u.select.width, "x")];
    u.setSelect({ left: 0, top: 0, width: 0, height: 0 }, false);
    if (mode === "zoom") return plots.forEach(p => p.setScale("x", { min: from, max: to }));
    setRange(mode, from, to);
  }

  /** @param {string} purpose @param {number} from @param {number} to */
  function setRange(purpose, from, to) {
    const ts = log.sampleTime(), file = log.file();
    if (!ts || !file) return;
    const skip = Math.max(0, Math.round(from / ts)), take = Math.max(1, Math.round(to / ts) - skip);
    settings.change(({ data }) => {
      const others = (data[purpose] ?? []).filter(f => f.file !== file), name = purpose === "verification" ? { name: `${settings.table.name}, verification` } : {};
      data[purpose] = [...others, { file, skip, take, ...name }];
    });
  }

  async function draw() {
    const file = log.file(), ts = log.sampleTime(), found = log.survey(file ?? "");
    const columns = found.columns.filter(c => !c.problem && ["input", "output", "excitation", "reference"].includes(log.roleOf(c.name))).map(c => c.name);
    const wanted = JSON.stringify([file, ts, columns, columns.map(log.roleOf), [...engine.files.keys()].length]);
    if (wanted !== loaded) {
      loaded = wanted;
      host.replaceChildren();
      spectra.replaceChildren();
      plots = [];
      document.body.classList.toggle("has-signals", columns.length > 0 && !!ts);
      if (!file || !ts || !columns.length) return;
      const answer = await engine.ask({ verb: "traces", file, csv: settings.table.data.csv ?? {}, columns, sample_time: ts });
      if (wanted !== loaded) return;
      if (answer.error) return void host.replaceChildren(element("p", { class: "note" }, answer.error));
      for (const curve of answer.curves) {
        const role = log.roleOf(curve.name);
        const u = curves(host, { x: "", y: withoutUnit(curve.name).slice(0, 16), height: 118, sync: "signals", lines: [{ label: curve.name, colour: { output: "--measured", input: "--soft" }[role] ?? "--excitation", width: 1 }],
          drag: { x: true, y: false, setScale: false }, hooks: { drawClear: [shade], setSelect: [selected] } });
        Object.assign(u, { channel: curve.name, short: Object.values(LISTS).flatMap(list => settings.table.data[list] ?? []).find(c => c.from === curve.name)?.name });
        u.over.addEventListener("dblclick", () => plots.forEach(p => p.setScale("x", { min: 0, max: answer.samples * ts })));
        u.setData([curve.rows.map(row => row * ts), curve.values]);
        u.root.setAttribute("role", "img");
        u.root.setAttribute("aria-label", `${curve.name} over ${readOut(answer.samples * ts)} seconds`);
        plots.push(u);
      }
      host.append(element("p", { class: "caption" }, "Time in seconds. Blue: identified from. Green: verified on. Marks at the upper edge: findings of the check. Double click: the whole record."));
      drawnCurves = answer.curves;
      drawSpectra(answer.curves);
    }
    plots.forEach(u => u.redraw(false));
    check();
  }

  /** Curves over the frequency with their names. @param {HTMLElement} place @param {string} title @param {any[]} all @param {(curve: any) => number[]} of @param {object} how */
  function overFrequency(place, title, all, of, how) {
    const lines = all.map((curve, k) => ({ label: curve.name, colour: PALETTE[k % PALETTE.length] }));
    place.replaceChildren(element("p", { class: "panel-title" }, title), key(lines));
    curves(place, { x: "Frequency (Hz)", y: "", logX: true, height: 210, lines, ...how }).setData(joined(all.map(c => [c.hz, of(c)])));
  }

  /** @param {any[]} all */
  function drawSpectra(all) {
    const left = element("div"), right = element("div", { id: "coherence" });
    spectra.replaceChildren(left, right);
    overFrequency(left, "Spectra, root of the density per Hz", all, c => c.density.map(v => v > 0 ? v : null), { logY: true });
  }

  async function drawCoherence() {
    const place = document.getElementById("coherence"), { data } = settings.table;
    if (!place || !(data.input_excitation || data.reference || data.alpha)) return place?.replaceChildren();
    const answer = await engine.ask({ verb: "coherence", toml: settings.text });
    if (answer.error || !answer.curves.length) return place.replaceChildren();
    overFrequency(place, "Coherence with the known excitation", answer.curves, c => c.coherence, { range: () => [0, 1.02] });
  }

  // The check runs again after each change, once nothing has changed for a moment; what was asked for before the last change is not shown.
  function check() {
    clearTimeout(checking);
    const timer = checking = window.setTimeout(async () => {
      const { data, controller } = settings.table;
      if (!data.inputs.length || !data.outputs.length || !log.sampleTime()) return told([], null, false);
      const needed = controller ? neededBy(controller) : [], whole = controller && !needed.length;
      // What can be said before a controller is described is said: as of an open loop, without the tests of the controller.
      const asked = whole ? settings.text : (await engine.ask({ verb: "toml", table: { ...settings.table, controller: openLoop(data) } })).toml;
      const answer = timer === checking ? await engine.ask({ verb: "check", toml: asked }) : null;
      // A controller without its sign is refused with the sign with which the log agrees.
      const agreed = timer === checking && needed.join() === SIGN ? (await engine.ask({ verb: "check", toml: settings.text })).error?.match(/; the log agrees with [^.]*/) : null;
      if (timer !== checking) return;
      if (answer.error) return told([{ severity: "defect", sentence: answer.error }], null);
      if (whole) told(answer.findings, answer.controller);
      else told(answer.findings.filter(f => f.test !== "controller" && f.test !== "feedback"), needed.length ? { sentence: `Still needed: ${needed.join(", ")}${agreed ?? ""}${optionalOf(controller)}` } : null);
      drawCoherence();
    }, 350);
  }

  /** @param {any[]} found @param {any} controller @param {boolean} ran */
  function told(found, controller, ran = true) {
    findings = found;
    plots.forEach(u => u.redraw(false));
    const line = f => element("li", {}, element("span", { class: `status ${{ defect: "bad", caution: "caution" }[f.severity] ?? ""}`, "aria-hidden": "true" }, { defect: "!", caution: "!" }[f.severity] ?? "i"), element("span", {}, `${f.severity[0].toUpperCase()}${f.severity.slice(1)}: ${f.sentence}`));
    const serious = found.filter(f => f.severity !== "note"), notes = found.filter(f => f.severity === "note");
    listed.replaceChildren(element("ul", { class: "notes plain" }, ...(serious.length ? serious.map(line) : [element("li", {}, ran ? "The check found no defect." : settings.table.data.inputs.length ? "Not checked yet: the check needs an input, an output and the sample time." : "")])),
      ...(notes.length ? [element("details", { open: listed.querySelector("details")?.open ? "" : null }, element("summary", {}, `${notes.length} notes`), element("ul", { class: "notes plain" }, ...notes.map(line)))] : []));
    const sentence = (/** @type {any} */ f) => `Defect: ${f.sentence}`, defects = found.filter(f => f.severity === "defect" && f.test), ofController = defects.find(f => f.test === "controller" || f.test === "feedback");
    saidOfController.textContent = ofController ? sentence(ofController) : controller ? `${controller.sentence}.` : "";
    saidOfController.className = ofController ? "note bad" : "";
    defect.textContent = defects.length ? sentence(defects[0]) : "";
  }

  settings.listen((_, onlyTrial) => { if (!onlyTrial) draw(); });
  return { ofOutputs: () => drawnCurves.filter(c => log.roleOf(c.name) === "output") };
})();
