// The controller that ran, in the form in which it was programmed, and the sign of the feedback as a drawing of the loop.

/** A loop without a controller. @param {any} data */
const openLoop = data => ({ state_space: { feedback: "positive", a: [], b: [], c: data.inputs.map(() => []), d: data.inputs.map(() => data.outputs.map(() => 0)) } });

/** Forms with their fields: name, label, kind, unit. @type {Record<string, { name: string, start: any, fields: [string, string, string, string?][] }>} */
const FORMS = {
  pid: { name: "PID, parallel: kp + ki/s + kd s/(1 + tf s)", start: { discretisation: "backward-euler" },
    fields: [["kp", "kp", "gain"], ["ki", "ki", "gain?", "1/s"], ["kd", "kd", "gain?", "s"], ["derivative_filter", "Filter tf", "gain?", "s"], ["discretisation", "Computed by", "rule"], ["delay", "Further delay", "count", "samples"]] },
  ideal_pid: { name: "PID, ideal: kp (1 + 1/(ti s) + td s/(1 + tf s))", start: { discretisation: "backward-euler" },
    fields: [["kp", "kp", "gain"], ["ti", "ti", "gain?", "s"], ["td", "td", "gain?", "s"], ["derivative_filter", "Filter tf", "gain?", "s"], ["discretisation", "Computed by", "rule"], ["delay", "Further delay", "count", "samples"]] },
  cascade: { name: "Cascade: velocity loop inside a position loop", start: { discretisation: "backward-euler", position: {}, velocity: {} },
    fields: [["position.kp", "Position kp", "number", "1/s"], ["velocity.kp", "Velocity kp", "number"], ["velocity.ki", "Velocity ki", "number?", "1/s"], ["velocity_filter", "Filter of the velocity", "number?", "s"], ["velocity_feedforward", "Velocity feedforward", "number?"], ["acceleration_feedforward", "Acceleration feedforward", "number?"], ["discretisation", "Computed by", "rule"], ["delay", "Further delay", "count", "samples"]] },
  difference_equation: { name: "Difference equation in z⁻¹", start: { numerator: [1], denominator: [1] },
    fields: [["numerator", "Numerator, ascending powers of z⁻¹", "list"], ["denominator", "Denominator", "list"], ["delay", "Further delay", "count", "samples"]] },
  transfer_function: { name: "Transfer function in s or z", start: { domain: "continuous", hold: "tustin", numerator: [1], denominator: [1] },
    fields: [["domain", "In", "domain"], ["hold", "Discretised by", "hold"], ["numerator", "Numerator, descending powers", "list"], ["denominator", "Denominator", "list"], ["delay", "Further delay", "count", "samples"]] },
  state_space: { name: "State space, matrices by rows", start: { a: [], b: [], c: [[]], d: [[1]] },
    fields: [["a", "A", "json"], ["b", "B", "json"], ["c", "C", "json"], ["d", "D", "json"]] },
  open_loop: { name: "No controller ran", start: {}, fields: [] },
  json: { name: "JSON as [controller] of run.toml", start: {}, fields: [] },
};
/** Forms of a nominal model. @type {typeof FORMS} */
const NOMINAL = {
  transfer_function: { name: "transfer function in s or z", start: { domain: "continuous", numerator: [1], denominator: [1, 1] },
    fields: [["domain", "In", "domain"], ["numerator", "Numerator, descending powers", "list"], ["denominator", "Denominator", "list"]] },
  state_space: { name: "state space, matrices by rows", start: { domain: "continuous", a: [[-1]], b: [[1]], c: [[1]] },
    fields: [["domain", "In", "domain"], ["a", "A", "json"], ["b", "B", "json"], ["c", "C", "json"], ["d", "D", "json"]] },
};
const CHOICES = /** @type {Record<string, [string, string][]>} */ ({
  rule: [["backward-euler", "backward Euler"], ["tustin", "Tustin"]],
  domain: [["continuous", "s"], ["discrete", "z"]], hold: [["tustin", "Tustin"], ["zoh", "zero-order hold"]],
});

/** How many loops the gains of a PID are those of; 1 for other forms. @param {any} controller */
const loopsOf = controller => Math.max(1, ...Object.values(controller?.pid ?? controller?.ideal_pid ?? {}).map(value => Array.isArray(value) ? value.length : 1));

/** A value of a form, named as for `setKey`. @param {any} of @param {string} path */
const keyOf = (of, path) => path.split(".").reduce((at, name) => at?.[name], of);

const SIGN = "the sign of the feedback";
const and = (/** @type {string[]} */ list) => list.join(", ").replace(/, ([^,]*)$/, " and $1");

/** What must still be stated of a controller. @param {any} controller @returns {string[]} */
function neededBy(controller) {
  const [form, of] = Object.entries(controller)[0], empty = emptyOf(form, of, kind => kind === "number" || kind === "gain");
  return of.feedback ? empty : [...empty, SIGN];
}

/** Labels of the fields of a form that are empty. @param {string} form @param {any} of @param {(kind: string) => boolean} wanted */
const emptyOf = (form, of, wanted) => (FORMS[form]?.fields ?? []).filter(([path, , kind]) => wanted(kind) && keyOf(of, path) == null).map(([, label]) => label);

/** The fields that may stay empty, in a sentence. @param {any} controller */
function optionalOf(controller) {
  const [form, of] = Object.entries(controller)[0], empty = emptyOf(form, of, kind => kind.endsWith("?"));
  return empty.length ? `. ${and(empty)} may stay empty: the controller then has no such part` : "";
}

/** Sets a key, or takes it away; a name with a point is that of a key in a table of its own. @param {any} of @param {string} path @param {any} value */
function setKey(of, path, value) {
  const [table, name] = path.includes(".") ? path.split(".") : ["", path], place = table ? of[table] ??= {} : of;
  if (value === undefined) delete place[name]; else place[name] = value;
}

/** Fields of a form, named as for `setKey`. @param {string} form @param {any} of @param {(name: string, value: any) => void} changes @param {typeof FORMS} forms */
function formFields(form, of, changes, forms = FORMS) {
  return forms[form].fields.filter(([name]) => name !== "hold" || of.domain === "continuous").map(([path, label, kind, unit]) => {
    const name = path.split(".").pop(), value = keyOf(of, path);
    if (CHOICES[kind]) return choiceField({ label, value, options: CHOICES[kind], changed: value => changes(path, value) });
    if (/^(number|gain|count)/.test(kind)) return numberField({ label, unit, name, optional: !["number", "gain"].includes(kind), several: kind.startsWith("gain"), value, changed: value => changes(path, kind === "count" ? Math.max(0, Math.round(value ?? 0)) || undefined : value ?? undefined) });
    const input = element("input", { type: "text", size: 34, value: value === undefined ? "" : kind === "json" ? JSON.stringify(value) : [value].flat(2).join(", "), autocomplete: "off" });
    input.addEventListener("change", () => {
      let read = null;
      try { read = kind === "json" || input.value.includes("[") ? JSON.parse(input.value) : numbersOf(input.value); } catch { read = null; }
      complain(input, read == null && (kind === "json" ? "A matrix by rows, such as [[1, 0], [0, 1]]" : "Numbers with commas between them, such as 1, -0.5"));
      if (read != null) changes(path, read);
    });
    return element("label", { class: "field" }, element("span", {}, label), input);
  });
}

const controllerPart = (() => {
  const place = /** @type {HTMLElement} */ (document.getElementById("controller")), drawing = /** @type {HTMLElement} */ (document.getElementById("loop-drawing"));
  const isOpen = (/** @type {any} */ c) => c?.state_space && c.state_space.a.length === 0 && c.state_space.d.flat().every(v => v === 0);
  const formOf = (/** @type {any} */ c) => !c ? "" : isOpen(c) ? "open_loop" : Object.keys(c)[0] in FORMS ? Object.keys(c)[0] : "json";

  function drawn() {
    const { controller, data } = settings.table, form = formOf(controller), values = controller ? Object.values(controller)[0] : {};
    const options = /** @type {[string, string][]} */ ([["", "choose its form"], ...Object.entries(FORMS).map(([key, f]) => [key, f.name])]);
    const parts = [choiceField({ label: "Controller that ran", value: form, options, changed: chosen => settings.change(table => {
      if (chosen === "" || chosen === "json") delete table.controller;
      else table.controller = chosen === "open_loop" ? openLoop(data) : { [chosen]: { ...(values.feedback && form !== "open_loop" ? { feedback: values.feedback } : {}), ...structuredClone(FORMS[chosen].start) } };
      if (chosen === "json") pasted();
    }) })];
    if (form && form !== "open_loop") {
      parts.push(element("fieldset", { class: "sign" }, element("legend", {}, "Sign in which it is written down; it is never guessed"),
        ...[["negative", "u = K (r − y)"], ["positive", "u = K (y − r)"]].map(([sign, equation]) => {
          const radio = element("input", { type: "radio", name: "feedback", value: sign, checked: values.feedback === sign ? "" : null });
          radio.addEventListener("change", () => settings.change(table => { Object.values(table.controller)[0].feedback = sign; }));
          return element("label", {}, radio, ` ${sign}: ${equation}`);
        })));
    }
    if (FORMS[form]?.fields.length) parts.push(element("div", { class: "fields" }, ...formFields(form, values, (name, value) => settings.change(table => {
      const of = Object.values(table.controller)[0];
      setKey(of, name, value);
      if (name === "domain") value === "discrete" ? delete of.hold : of.hold ??= "tustin";
    }))));
    refill(place, ...parts);
    drawing.innerHTML = loopDrawing(form === "open_loop" ? null : values.feedback ?? "unknown", !!form);
  }

  function pasted() {
    const field = element("textarea", { rows: 6, cols: 60, "aria-label": "Controller as JSON", placeholder: "{\"pid\": {\"feedback\": \"negative\", \"discretisation\": \"tustin\", \"kp\": 2.0, \"ki\": 10.0}}" }), said = element("p", { class: "note", hidden: "" });
    field.addEventListener("change", () => {
      try { const read = JSON.parse(field.value); settings.change(table => { table.controller = read; }); } catch (problem) { said.hidden = false; said.textContent = `This is not JSON: ${/** @type {Error} */ (problem).message}`; }
    });
    place.append(field, said);
    field.focus();
  }

  settings.listen(drawn);
  return { drawn };
})();

// A model of the plant that the user has, for comparison; the result does not rest on it.
(() => {
  const place = /** @type {HTMLElement} */ (document.getElementById("nominal"));
  settings.listen(({ nominal }) => {
    const form = nominal ? Object.keys(nominal)[0] : "", options = /** @type {[string, string][]} */ ([["", "none"], ...Object.entries(NOMINAL).map(([key, f]) => [key, f.name])]);
    if (form && !NOMINAL[form]) options.push([form, "as in run.toml"]);
    refill(place, choiceField({ label: "Nominal model, for comparison", value: form, options, changed: chosen => settings.change(table => {
      if (chosen) table.nominal = { [chosen]: structuredClone(NOMINAL[chosen].start) }; else delete table.nominal;
    }) }), ...(NOMINAL[form] ? formFields(form, nominal[form], (name, value) => settings.change(table => { setKey(table.nominal[form], name, value); }), NOMINAL) : []));
  });
})();

/** The loop as a drawing. @param {string | null} sign null without a controller @param {boolean} known */
function loopDrawing(sign, known) {
  if (!known) return "";
  const box = (x, text) => `<rect x="${x}" y="22" width="70" height="36" rx="3"/><text x="${x + 35}" y="45">${text}</text>`;
  const arrow = (x0, y0, x1, y1) => `<path d="M${x0} ${y0}L${x1} ${y1}" marker-end="url(#tip)"/>`;
  const head = `<svg viewBox="0 0 470 110" class="loop" role="img" aria-label="${sign == null ? "Open loop" : `Loop with ${sign} feedback`}"><defs><marker id="tip" markerWidth="8" markerHeight="8" refX="7" refY="4" orient="auto"><path d="M0 0L8 4L0 8Z" class="solid"/></marker></defs>`;
  const plant = `${box(285, "machine")}${arrow(355, 40, 440, 40)}<text x="450" y="45">y</text><text x="262" y="32">u</text>`;
  if (sign == null) return `${head}${arrow(230, 40, 285, 40)}${plant}</svg>`;
  const [ofR, ofY] = sign === "positive" ? ["−", "+"] : sign === "negative" ? ["+", "−"] : ["?", "?"];
  return `${head}<text x="12" y="45">r</text>${arrow(22, 40, 72, 40)}<circle cx="84" cy="40" r="12"/>${arrow(96, 40, 140, 40)}${box(140, "K")}${arrow(210, 40, 285, 40)}${plant}
    <path d="M400 40V92H84" /><path d="M84 92V52" marker-end="url(#tip)"/><text x="62" y="32" class="sign-mark">${ofR}</text><text x="98" y="70" class="sign-mark">${ofY}</text></svg>`;
}
