// The log: files that are dropped or opened, their columns, and the role of each.

const ROLES = /** @type {[string, string][]} */ ([["", "not used"], ["time", "time"], ["input", "input u"], ["output", "output y"], ["excitation", "excitation d"], ["reference", "reference r"]]);
/** Lists of run.toml by role. @type {Record<string, string>} */
const LISTS = { input: "inputs", output: "outputs", excitation: "input_excitation", reference: "reference" };

const log = (() => {
  const status = /** @type {HTMLElement} */ (document.getElementById("log-status")), place = /** @type {HTMLElement} */ (document.getElementById("columns"));
  /** What the survey of each file found. @type {Map<string, any>} */
  const surveys = new Map();
  const stem = (/** @type {string} */ name) => name.replace(/\.[^.]*$/, "");
  const shown = (/** @type {string} */ file) => surveys.get(file) ?? { columns: [], csv: {} };

  /** The file that the settings name first. @returns {string | undefined} */
  const file = () => settings.table.data.estimation?.[0]?.file;

  /** The records that the settings name. @returns {any[]} */
  const named = () => [...(settings.table.data.estimation ?? []), ...(settings.table.data.verification ?? [])];
  const survey = (/** @type {string} */ path) => engine.ask({ verb: "survey", file: path, csv: settings.table.data.csv ?? {} });

  /** @param {Iterable<File>} list */
  async function opened(list) {
    const files = [...list], folder = files[0]?.webkitRelativePath.split("/")[0];
    if (!folder) { for (const one of files) await openedOne(one); return; }
    for (const one of files) engine.put(one.webkitRelativePath, new Uint8Array(await one.arrayBuffer()));
    runs.dropped(folder);
  }

  /** @param {File} one */
  async function openedOne(one) {
    status.textContent = `Reading ${one.name} …`;
    const path = one.name, bytes = new Uint8Array(await one.arrayBuffer());
    if (path.endsWith(".toml")) return ofSettings(path, new TextDecoder().decode(bytes));
    engine.put(path, bytes);
    if (path.endsWith(".zip") && await ofArchive(path)) return;
    const found = await survey(path);
    if (found.error) {
      engine.files.delete(path);
      status.textContent = found.error;
      return;
    }
    surveys.set(path, found);
    const good = found.columns.filter(c => !c.problem), rows = Math.max(...good.map(c => c.rows));
    status.textContent = `${path}: ${good.length} columns, ${rows} rows.` + (found.csv.decimal === "comma" ? " Read with a decimal comma." : "");
    if (named().some(f => f.file === path)) return settings.told();
    await settings.change(table => {
      const { data } = table, first = !data.estimation?.length || !surveys.has(data.estimation[0].file);
      if (!first) return void data.estimation.push({ file: path });
      table.name = stem(path.split("/").pop() ?? path);
      const split = Math.floor(2 * rows / 3);
      data.estimation = [{ file: path, take: split }];
      data.verification = [{ file: path, skip: split, name: `${table.name}, second part` }];
      if (found.csv.decimal === "comma" || found.csv.delimiter !== "detect") data.csv = found.csv;
      if (!data.inputs.length && !data.outputs.length) suggest(data, good);
    });
    drawn();
  }

  /** Opens the run folder that an archive holds. @param {string} path */
  async function ofArchive(path) {
    const run = runs.free(stem(path)), answer = await engine.ask({ verb: "unpack", file: path, out: run }, { collect: `${run}/` });
    if (!answer.run) return false;
    engine.files.delete(path);
    runs.dropped(run);
    return true;
  }

  /** Takes a run.toml; a file has no folder here, so that its paths become names of files. @param {string} path @param {string} text */
  async function ofSettings(path, text) {
    const why = await settings.read(text);
    if (why) { status.textContent = `${path}: ${why}`; return; }
    const names = /** @type {string[]} */ ([]), bare = (/** @type {any} */ of) => { if (of?.file) { of.file = of.file.split(/[\\/]/).pop(); names.push(of.file); } };
    await settings.change(table => {
      const { data, controller, nominal } = table;
      [...(data.estimation ?? []), ...(data.verification ?? []), ...(data.response ?? []), controller?.model_file, nominal?.model_file].forEach(bare);
    });
    const missing = [...new Set(names)].filter(name => !engine.files.has(name));
    status.textContent = `${path}: settings are taken.` + (missing.length ? ` Drop the files that they name: ${missing.join(", ")}.` : "");
    await surveyAgain();
  }

  /** Roles as the headings suggest them. @param {any} data @param {any[]} columns */
  function suggest(data, columns) {
    for (const column of columns) if (column.role) give(data, column, column.role);
    for (const [list, as] of [["input_excitation", "inputs"], ["reference", "outputs"]]) if (data[list] && data[list].length !== data[as].length) delete data[list];
  }

  /** Whether a column is that of the time, or the one from which its seconds are computed. @param {any} data @param {string} name */
  const isTime = (data, name) => data.time_column === name || data.computed?.seconds?.startsWith(`'${name}'`);

  /** @param {any} data @param {any} column @param {string} role */
  function give(data, column, role) {
    const name = column.name;
    for (const list of Object.values(LISTS)) if (data[list]) data[list] = data[list].filter(c => (c.from ?? c.name) !== name);
    if (isTime(data, name)) { delete data.time_column; delete data.computed; }
    if (role === "time") {
      if (column.to_seconds) { data.computed = { seconds: `'${name}' ${column.to_seconds}` }; data.time_column = "seconds"; } else data.time_column = name;
      delete data.sample_time;
    } else if (role) {
      const short = column.unit ? withoutUnit(name) || name : name;
      (data[LISTS[role]] ??= []).push({ name: short, ...(short === name ? {} : { from: name }), ...(column.unit ? { unit: column.unit } : {}) });
    }
    for (const list of ["input_excitation", "reference"]) if (data[list] && !data[list].length) delete data[list];
  }

  /** @param {string} name */
  function roleOf(name) {
    const { data } = settings.table;
    if (isTime(data, name)) return "time";
    return Object.keys(LISTS).find(role => data[LISTS[role]]?.some(c => (c.from ?? c.name) === name)) ?? "";
  }

  /** Seconds between samples: declared, or the step of the time column. */
  function sampleTime() {
    const { data } = settings.table, time = shown(file() ?? "").columns.find(c => roleOf(c.name) === "time");
    if (data.sample_time) return data.sample_time;
    if (!time) return null;
    const step = time.step ?? (time.high - time.low) / Math.max(1, time.rows - 1);
    return step * (time.to_seconds ? 1 / Number(time.to_seconds.replace(/[^0-9.e]/g, "")) : 1);
  }

  function drawn() {
    const { data } = settings.table, path = file(), found = path ? shown(path) : { columns: [] };
    const rows = found.columns.map(column => {
      const role = roleOf(column.name), select = element("select", { "aria-label": `Role of ${column.name}`, disabled: column.problem ? "" : null },
        ...ROLES.map(([key, name]) => element("option", { value: key, selected: key === role ? "" : null }, name)));
      select.addEventListener("change", () => settings.change(({ data }) => give(data, column, select.value)));
      return element("tr", { "data-role": role }, element("th", { scope: "row" }, column.name), element("td", {}, select),
        ...(column.problem ? [element("td", { colspan: 4 }, `no channel: ${column.problem}`)] : [
          element("td", { class: "number" }, readOut(column.low)), element("td", { class: "number" }, readOut(column.high)), element("td", {}, column.unit ?? ""),
          element("td", {}, column.low === column.high ? "constant" : column.step ? `even steps of ${readOut(column.step)}` : "")]));
    });
    const head = ["Column", "Role", "Lowest", "Highest", "Unit", ""].map((text, k) => element("th", { class: k === 2 || k === 3 ? "number" : null, scope: "col" }, text));
    if (!rows.length) return place.replaceChildren();
    const needed = data.time_column ? null : numberField({ label: "Sample time", unit: "s", value: data.sample_time, changed: value => settings.change(t => { t.data.sample_time = value; }) });
    refill(place, element("div", { class: "scroll" }, element("table", {}, element("thead", {}, element("tr", {}, ...head)), element("tbody", {}, ...rows))),
      element("div", { class: "fields" }, needed, choiceField({ label: "Take out of every channel", value: data.detrend ?? "mean", options: [["mean", "the mean"], ["linear", "a straight line"], ["none", "nothing"]],
        changed: value => settings.change(t => { t.data.detrend = value; }) })));
  }

  /** Surveys the files that the settings name, as after a saved page was opened. */
  async function surveyAgain() {
    for (const { file: path } of named()) {
      if (surveys.has(path) || !engine.files.has(path)) continue;
      const found = await survey(path);
      if (!found.error) surveys.set(path, found);
    }
    settings.told();
  }

  settings.listen(drawn);
  return { surveyAgain, opened, file, survey: shown, sampleTime, roleOf };
})();
