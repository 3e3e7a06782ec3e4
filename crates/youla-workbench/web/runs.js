// Identification and its results: verdict, report, comparison of two results, files.

const runs = (() => {
  const by = (/** @type {string} */ id) => /** @type {any} */ (document.getElementById(id));
  const start = by("identify"), stop = by("cancel"), progress = by("progress"), bar = by("progress-bar"), verdict = by("verdict"), frame = by("report"), list = by("run-list"), order = by("order");
  /** Finished runs by their folders. @type {Map<string, { name: string, sentence: string, reasons: string[], summary: any, toml?: string }>} */
  const done = new Map();
  let shown = "", next = 1, running = false;
  const fileOf = (/** @type {string} */ run, /** @type {string} */ name) => engine.files.get(`${run}/${name}`);
  const text = (/** @type {Uint8Array} */ bytes) => new TextDecoder().decode(bytes);
  const trusted = (/** @type {any} */ summary) => summary?.recommended?.trusted === true;

  /** A name that no run has. @param {string} stem */
  function free(stem) {
    let name = stem;
    for (let k = 2; done.has(name); k++) name = `${stem}-${k}`;
    return name;
  }

  function unused() {
    while (done.has(`run-${String(next).padStart(3, "0")}`)) next++;
    return `run-${String(next++).padStart(3, "0")}`;
  }

  async function identify() {
    if (running) return;
    running = start.disabled = true;
    await settings.settled();
    const asked = settings.text, out = unused(), begun = performance.now();
    stop.hidden = bar.hidden = false;
    bar.value = 0;
    refuse("");
    const ticking = setInterval(() => { const s = (performance.now() - begun) / 1000; progress.dataset.seconds = s.toFixed(1); progress.textContent = `${progress.dataset.stage ?? "starting"}, ${s.toFixed(0)} s${remaining(s)}`; }, 250);
    const answer = await engine.ask({ verb: "identify", toml: asked, out }, { collect: out, said: line => {
      const [at, of, stage] = line.split(" ");
      if (!stage) return;
      [bar.value, bar.max, progress.dataset.stage] = [Number(at) - 1, Number(of), `stage ${at} of ${of}, ${stage}`];
    } });
    clearInterval(ticking);
    running = start.disabled = false;
    stop.hidden = bar.hidden = true;
    const seconds = (performance.now() - begun) / 1000;
    progress.textContent = answer.cancelled ? "Cancelled; log and settings are as they were." : answer.error ? "" : `Finished in ${seconds.toFixed(1)} s.`;
    if (answer.cancelled) return;
    if (answer.error) return refuse(answer.error);
    Object.assign(known, { samples: samples(), seconds });
    done.set(out, { name: out, sentence: answer.sentence, reasons: answer.reasons, summary: answer.summary, toml: asked });
    show(out);
  }

  // The time that the same samples took before says what remains.
  const known = { samples: 0, seconds: 0 };
  const samples = () => ["estimation", "verification"].flatMap(p => settings.table.data[p] ?? []).reduce((sum, f) => sum + (f.take ?? 0), 0);
  function remaining(seconds) {
    if (!known.seconds) return "";
    const left = known.seconds * Math.max(0.2, samples() / Math.max(1, known.samples)) - seconds;
    return left > 0.5 ? `, about ${left.toFixed(0)} s to go` : "";
  }

  /** Says why what was asked for is not done, above the result that is still shown. @param {string} why */
  function refuse(why) {
    by("refused").replaceChildren(...(why ? [line("bad", why)] : []));
  }

  const line = (/** @type {string} */ kind, /** @type {string} */ sentence) => element("p", { class: `headline verdict-line ${kind}` }, element("span", { class: `status ${kind}`, "aria-hidden": "true" }, kind === "good" ? "✓" : "!"), sentence);

  /** @param {string} kind @param {string} sentence @param {string[]} reasons */
  function told(kind, sentence, reasons) {
    verdict.replaceChildren(line(kind, sentence), ...(reasons.length ? [element("ul", { class: "points" }, ...reasons.map(r => element("li", {}, r)))] : []));
  }

  // A result of other settings than those on the page says so.
  function aged() {
    const of = done.get(shown)?.toml, stale = of != null && of !== settings.text;
    document.body.classList.toggle("stale", stale);
    by("stale").textContent = stale ? `This is ${shown}: the settings have changed since.` : "";
  }

  /** @param {string} run */
  function show(run) {
    const found = done.get(run);
    if (!found) return;
    shown = run;
    refuse("");
    document.body.classList.add("has-run");
    told(trusted(found.summary) ? "good" : "caution", found.sentence, found.reasons);
    framed(text(fileOf(run, "report.html") ?? new Uint8Array()), false);
    listed();
    aged();
    gains.show(run);
    document.dispatchEvent(new CustomEvent("run-shown", { detail: run }));
  }

  function listed() {
    const names = [...done.keys()];
    order.hidden = false;
    const pick = (/** @type {string} */ label, /** @type {string} */ value) => choiceField({ label, value, options: names.map(n => /** @type {[string, string]} */ ([n, `${n}: ${done.get(n)?.name}`.replace(/^(.*): \1$/, "$1")])), changed: chosen => { if (label === "Result") show(chosen); else other = chosen; } });
    const save = (/** @type {string} */ label, /** @type {() => void} */ action) => element("button", { type: "button", class: "action", onclick: action }, label);
    if (!names.includes(other) || other === shown) other = names.find(n => n !== shown) ?? "";
    list.replaceChildren(pick("Result", shown), ...(names.length > 1 ? [pick("Compare with", other), save("Compare", compare)] : []),
      save("Save report.html", () => download(`${shown}-report.html`, fileOf(shown, "report.html"))), save("Save run folder (zip)", archive), save("Save run.toml", () => download("run.toml", new TextEncoder().encode(settings.text))));
  }
  let other = "";

  async function compare() {
    if (!other) return;
    const answer = await engine.ask({ verb: "compare", runs: [shown, other] });
    if (answer.error) return refuse(answer.error);
    framed(answer.html, true);
    by("close-comparison").scrollIntoView();
  }

  /** @param {string} html @param {boolean} compares whether it is that of a comparison, which can be closed */
  function framed(html, compares) {
    frame.srcdoc = `${html}<script>(${reporting})()<\/script>`;
    by("close-comparison").hidden = !compares;
  }

  // The frame is as high as its report, so that the page alone scrolls: it tells its height and the place of each part to which a link leads.
  function reporting() {
    const root = document.documentElement, told = (/** @type {object} */ what) => parent.postMessage(what, "*");
    const height = () => told({ height: Math.ceil(root.getBoundingClientRect().height) });
    new ResizeObserver(height).observe(root);
    // A frame that is out of sight is not rendered, so that nothing observes its size: the size is asked for once more when all of it is there.
    addEventListener("load", height);
    // The address of the frame is none that its own links could lead to.
    addEventListener("click", event => {
      const link = event.target instanceof Element && event.target.closest("a[href^='#']"), part = link && document.querySelector(link.getAttribute("href") ?? "");
      if (!part) return;
      event.preventDefault();
      told({ place: part.getBoundingClientRect().top });
    });
  }

  addEventListener("message", ({ source, data }) => {
    if (source !== frame.contentWindow) return;
    if (data.height > 0) frame.style.height = `${data.height + 2}px`;
    if (Number.isFinite(data.place)) scrollTo({ top: scrollY + frame.getBoundingClientRect().top + data.place });
  });

  async function archive() {
    const file = `${shown}.zip`, answer = await engine.ask({ verb: "archive", run: shown, file }, { collect: file });
    if (answer.error) return refuse(answer.error);
    download(file, engine.files.get(file));
  }

  /** Opens a run folder whose files are there, as one that was dropped. @param {string} run */
  function dropped(run) {
    const [summary, report] = ["summary.json", "report.json"].map(name => fileOf(run, name));
    const status = by("log-status");
    if (!summary || !report) return void (status.textContent = `${run} is no run folder: it has no summary.json or no report.json.`);
    try {
      const read = JSON.parse(text(summary));
      done.set(run, { name: run, sentence: JSON.parse(text(report)).verdict[0].text, reasons: read.recommended?.reasons ?? [], summary: read });
    } catch { return void (status.textContent = `summary.json or report.json of ${run} is not what a run writes.`); }
    status.textContent = `The run folder ${run} is open: its result is shown under Model.`;
    show(run);
  }

  start.addEventListener("click", identify);
  stop.addEventListener("click", () => engine.cancel());
  by("close-comparison").addEventListener("click", () => show(shown));
  order.querySelector("input").addEventListener("change", (/** @type {any} */ event) => { const value = numberOf(event.target.value); orders.pick(() => value == null ? null : Math.round(value)); });
  settings.listen(table => {
    const { data, controller } = table, pid = controller?.pid ?? controller?.ideal_pid;
    const needed = [!data.inputs.length && "an input", !data.outputs.length && "an output", !log.sampleTime() && "the sample time", ...(controller ? neededBy(controller) : ["the controller that ran"])].filter(Boolean);
    const names = (/** @type {any[]} */ list) => list.map(c => c.from ?? c.name).join(", ");
    const loops = loopsOf(controller);
    const many = !!pid && !needed.length && (data.inputs.length !== loops || data.outputs.length !== loops);
    start.disabled = running || needed.length > 0 || many;
    by("missing").textContent = needed.length ? `Still needed: ${needed.join(", ")}.` : many
      ? `${loops === 1 ? "A PID drives one input and reads one output" : `The gains are those of ${loops} loops`}, but the inputs are ${names(data.inputs)} and the outputs ${names(data.outputs)}. Is one of them the excitation, or not used? The gains of several loops have semicolons between them: 2; 1.5.` : "";
    aged();
    order.querySelector("input").value = table.recommended?.order ?? "";
  });
  return { identify, show, dropped, free, done, get shown() { return shown; } };
})();

/** Hands a file to the user. @param {string} name @param {Uint8Array | undefined} bytes */
function download(name, bytes) {
  if (!bytes) return;
  const address = URL.createObjectURL(new Blob([/** @type {any} */ (bytes)])), link = element("a", { href: address, download: name });
  link.click();
  setTimeout(() => URL.revokeObjectURL(address), 1000);
}
