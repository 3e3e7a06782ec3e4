// The page: dropping, keys, run.toml, saving, and what a saved page brings with it.

(() => {
  const by = (/** @type {string} */ id) => /** @type {any} */ (document.getElementById(id));
  const toml = by("toml"), why = by("toml-error"), undo = by("undo"), redo = by("redo");

  addEventListener("dragover", event => { event.preventDefault(); document.body.classList.add("dragging"); });
  addEventListener("dragleave", event => { if (!event.relatedTarget) document.body.classList.remove("dragging"); });
  addEventListener("drop", async event => {
    event.preventDefault();
    document.body.classList.remove("dragging");
    const entries = [...(event.dataTransfer?.items ?? [])].map(item => item.webkitGetAsEntry?.()).filter(entry => entry?.isDirectory);
    // Some browsers show the folders that are dropped on a page from the disk, and keep the files in them from it.
    const kept = (/** @type {any} */ error) => { by("log-status").textContent = `The browser does not hand over the files of a folder dropped on a page from the disk (${error?.name}): open it by "open a run folder".`; };
    if (entries.length) for (const entry of entries) await folder(/** @type {any} */ (entry), entry?.name ?? "").then(() => runs.dropped(entry?.name ?? ""), kept);
    else log.opened(event.dataTransfer?.files ?? []);
  });
  by("open-file").addEventListener("change", event => { log.opened([...event.target.files]); });
  by("open-folder").addEventListener("change", event => { log.opened([...event.target.files]); });

  /** Takes all files of a folder that was dropped. @param {any} entry @param {string} path */
  async function folder(entry, path) {
    const reader = entry.createReader();
    for (;;) {
      const entries = await new Promise((resolve, reject) => reader.readEntries(resolve, reject));
      if (!entries.length) break;
      for (const one of entries) {
        if (one.isDirectory) { await folder(one, `${path}/${one.name}`); continue; }
        const file = await new Promise((resolve, reject) => one.file(resolve, reject));
        engine.put(`${path}/${one.name}`, new Uint8Array(await file.arrayBuffer()));
      }
    }
  }

  settings.listen(() => {
    if (document.activeElement !== toml) toml.value = settings.text;
    tell({ settings: settings.text });
    undo.disabled = !settings.canUndo;
    redo.disabled = !settings.canRedo;
  });
  toml.addEventListener("change", async () => {
    const problem = await settings.read(toml.value);
    why.textContent = problem ?? "";
    toml.setAttribute("aria-invalid", String(!!problem));
  });
  undo.addEventListener("click", () => settings.undo());
  redo.addEventListener("click", () => settings.redo());
  addEventListener("keydown", event => {
    const writing = event.target instanceof HTMLTextAreaElement || event.target instanceof HTMLInputElement && event.target.type === "text" && event.target.value !== event.target.defaultValue;
    if (!(event.ctrlKey || event.metaKey) || writing) return;
    const key = event.key.toLowerCase();
    if (key === "z") { event.preventDefault(); event.shiftKey ? settings.redo() : settings.undo(); }
    if (key === "y") { event.preventDefault(); settings.redo(); }
    if (key === "enter") runs.identify();
  });

  // The page with its log, settings and results inside: the same file, with one more element.
  async function save() {
    const packed = [];
    for (const [path, bytes] of engine.files) packed.push([path, await text64(bytes)]);
    const state = JSON.stringify({ toml: settings.text, trial: settings.trial, files: packed, runs: [...runs.done], shown: runs.shown }).replaceAll("<", "\\u003c");
    const page = `<!doctype html>\n${own.slice(0, own.lastIndexOf("</body>"))}<script type="application/json" id="saved">${state}<\/script>\n</body></html>\n`;
    download(`${settings.table.name || "workbench"}.html`, new TextEncoder().encode(page));
  }
  by("save").addEventListener("click", save);

  /** @param {Uint8Array} bytes @returns {Promise<string>} */
  async function text64(bytes) {
    const packed = new Blob([/** @type {any} */ (bytes)]).stream().pipeThrough(new CompressionStream("gzip")), url = new FileReader();
    const blob = await new Response(packed).blob();
    return new Promise(resolve => { url.onload = () => resolve(String(url.result).split(",")[1] ?? ""); url.readAsDataURL(blob); });
  }

  async function restored() {
    const saved = document.getElementById("saved");
    if (!saved) return;
    const state = JSON.parse(saved.textContent ?? "");
    for (const [path, packed] of state.files) {
      const raw = Uint8Array.from(atob(packed), c => c.charCodeAt(0)), stream = new Blob([raw]).stream().pipeThrough(new DecompressionStream("gzip"));
      engine.put(path, new Uint8Array(await new Response(stream).arrayBuffer()));
    }
    await settings.restore({ text: state.toml, trial: state.trial });
    await log.surveyAgain();
    for (const [name, run] of state.runs) runs.done.set(name, run);
    runs.show(state.shown);
  }

  // In a notebook the page is a frame: files and settings come from outside, settings and summaries go there.
  const outside = parent === window ? null : parent, tell = (/** @type {any} */ said) => outside?.postMessage({ youla: said }, "*");
  addEventListener("message", async ({ source, data }) => {
    if (source !== outside || !data?.youla?.files) return;
    if (data.youla.settings) await settings.read(data.youla.settings);
    for (const [name, bytes] of Object.entries(data.youla.files)) await log.opened([new File([bytes], name)]);
  });
  document.addEventListener("run-shown", event => tell({ summary: runs.done.get(/** @type {CustomEvent} */ (event).detail)?.summary }));

  engine.start();
  controllerPart.drawn();
  engine.ready().then(() => { document.body.classList.add("ready"); by("log-status").textContent ||= "Ready. Nothing that you open here leaves this page."; tell({ ready: true }); return restored(); },
    problem => { by("log-status").textContent = `The method cannot be started in this browser: ${problem.message}`; });
})();
