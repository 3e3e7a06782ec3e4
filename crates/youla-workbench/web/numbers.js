// Numbers as people write them.

/** A number with a decimal point or a decimal comma; null for anything else. @param {string} text */
function numberOf(text) {
  const plain = text.trim().replace("−", "-"), value = Number(/^[^.]*,[^.,]*$/.test(plain) ? plain.replace(",", ".") : plain);
  return plain !== "" && Number.isFinite(value) ? value : null;
}

/** Numbers separated by blanks, semicolons or commas; with semicolons, or blanks alone, a comma is a decimal sign. Null where one cannot be read.
 * @param {string} text @returns {number[] | null} */
function numbersOf(text) {
  const plain = text.trim().replace(/^\[|\]$/g, "").trim(), parts = plain.includes(";") ? plain.split(";") : /,\s|^[^\s]*$/.test(plain) ? plain.split(",") : plain.split(/\s+/);
  const values = parts.map(part => numberOf(part));
  return plain === "" || values.includes(null) ? null : /** @type {number[]} */ (values);
}

/** A heading without the unit in brackets behind it. @param {string} heading */
const withoutUnit = heading => heading.replace(/\s*[[(][^\])]*[\])]\s*$/, "");

/** Says beside a field what it takes, and that the value before still counts; nothing where it is right.
 * @param {HTMLInputElement} input @param {string | false} what */
function complain(input, what) {
  input.setAttribute("aria-invalid", String(!!what));
  input.setCustomValidity(what || "");
  input.parentElement?.querySelector(".wrong")?.remove();
  if (what) input.after(element("em", { class: "wrong", role: "alert" }, `${what}. Until then the value before counts.`));
}

/** Gains of the loops as one types them. @param {number | number[] | null | undefined} value */
const gainText = value => value == null ? "" : [value].flat().join("; ");

/** A field for a number or, where `several` may be given, one for each loop with semicolons between them.
 * @param {{ label: string, value?: number | number[] | null, unit?: string, changed: (value: any) => void, optional?: boolean, name?: string, several?: boolean }} of */
function numberField({ label, value, unit, changed, optional, name, several }) {
  const input = element("input", { type: "text", inputmode: "decimal", size: 10, value: gainText(value), "data-name": name, autocomplete: "off", title: several ? "A number, or one for each loop: 2; 1.5" : null });
  input.addEventListener("change", () => {
    const empty = input.value.trim() === "", read = numberOf(input.value) ?? (several && input.value.includes(";") ? numbersOf(input.value) : null), wrong = read == null && !(empty && optional);
    complain(input, wrong && `A number, such as 0.5 or 2e-3${several ? ", or one for each loop, such as 2; 1.5" : ""}`);
    if (!wrong) changed(read);
  });
  return element("label", { class: "field" }, element("span", {}, unit ? `${label} (${unit})` : label), input);
}

/** Puts new fields in place of those there; the focus, and text that is being typed, stay at the field of the same name.
 * @param {HTMLElement} place @param {any[]} parts */
function refill(place, ...parts) {
  const name = (/** @type {any} */ node) => [node.tagName, node.type === "radio" ? node.value : "", node.getAttribute("aria-label") ?? node.closest("label")?.textContent ?? node.textContent].join();
  const active = /** @type {any} */ (place.contains(document.activeElement) ? document.activeElement : null), typed = active?.type === "text" && active.value !== active.defaultValue;
  place.replaceChildren(...parts.filter(part => part != null));
  const next = active && /** @type {any} */ ([...place.querySelectorAll("input, select, textarea, button")].find(node => name(node) === name(active)));
  next?.focus({ preventScroll: true });
  if (!next || !typed) return;
  next.value = active.value;
  next.setSelectionRange(active.selectionStart, active.selectionEnd);
  // A browser tells of no change that it has not seen being typed.
  next.addEventListener("blur", () => next.dispatchEvent(new Event("change")), { once: true });
}

/** A choice. @param {{ label: string, value: string, options: [string, string][], changed: (value: string) => void }} of */
function choiceField({ label, value, options, changed }) {
  const select = element("select", { "aria-label": label }, ...options.map(([key, name]) => element("option", { value: key, selected: key === value ? "" : null }, name)));
  select.addEventListener("change", () => changed(select.value));
  return element("label", { class: "field" }, element("span", {}, label), select);
}
