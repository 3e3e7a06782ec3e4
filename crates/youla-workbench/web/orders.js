// The stabilisation chart: modes of models of all orders over the spectrum of the outputs; an order is picked by pointer or keys.

const orders = (() => {
  const host = /** @type {HTMLElement} */ (document.getElementById("orders")), button = /** @type {HTMLButtonElement} */ (document.getElementById("show-orders"));
  /** @type {any} */
  let plot = null;
  let highest = 24;
  const chosen = () => settings.table.recommended?.order ?? null;

  /** Fixes the order, from the one before it where keys follow each other fast. @param {(before: number | null) => number | null} next */
  function pick(next) {
    return settings.change(table => {
      const order = next(table.recommended?.order ?? null);
      if (order != null) (table.recommended ??= {}).order = Math.max(1, order);
      else if (table.recommended) { delete table.recommended.order; if (!Object.keys(table.recommended).length) delete table.recommended; }
    });
  }

  async function show() {
    button.disabled = true;
    host.replaceChildren(element("p", { class: "caption" }, "Models of all orders are computed …"));
    const answer = await engine.ask({ verb: "orders", toml: settings.text });
    button.disabled = false;
    if (answer.error) return void host.replaceChildren(element("p", { class: "note" }, answer.error));
    draw(answer);
  }

  /** @param {any} found */
  function draw(found) {
    highest = found.highest;
    host.replaceChildren();
    const modes = found.modes.filter(m => m.hz > 0).sort((a, b) => a.hz - b.hz), spectra = signals.ofOutputs();
    const lines = [{ label: "steady", colour: "--recommended" }, { label: "new at this order", colour: "--soft" }];
    host.append(key([...lines, { label: "spectrum of the outputs", colour: "--grid" }]));
    plot = curves(host, { x: "Frequency (Hz)", y: "Order", logX: true, height: 300, lines, points: true, drag: { x: false, y: false }, range: () => [0, highest + 1], hooks: { drawClear: [u => { behind(u, spectra); level(u); }] } });
    plot.setData([modes.map(m => m.hz), modes.map(m => m.steady ? m.order : null), modes.map(m => m.steady ? null : m.order)]);
    Object.assign(plot.root, { tabIndex: 0 });
    plot.root.setAttribute("role", "slider");
    plot.root.setAttribute("aria-label", "Order of the model; arrows choose, Enter identifies, Escape leaves it to the evidence");
    plot.over.addEventListener("click", async event => { const order = Math.round(plot.posToVal(event.offsetY, "y")); await pick(() => order); runs.identify(); });
    plot.root.addEventListener("keydown", event => {
      const step = { ArrowUp: 1, ArrowDown: -1 }[event.key];
      if (step) pick(before => (before ?? 0) + step); else if (event.key === "Enter") runs.identify(); else if (event.key === "Escape") pick(() => null); else return;
      event.preventDefault();
    });
    host.append(element("p", { class: "caption" }, `PBSIDopt on ${found.samples} samples. A click on a height, or arrows and Enter, identifies with that order; Escape leaves the order to the evidence, which is the default.`));
    told();
  }

  // The spectra of the outputs, each over the height of the chart.
  function behind(u, spectra) {
    const { left, top, width, height } = u.bbox, { ctx } = u;
    ctx.save();
    ctx.beginPath();
    ctx.rect(left, top, width, height);
    ctx.clip();
    for (const { hz, density } of spectra) {
      const logs = density.map(v => Math.log10(v)), finite = logs.filter(Number.isFinite), low = Math.min(...finite), high = Math.max(...finite);
      ctx.beginPath();
      hz.forEach((f, k) => { if (Number.isFinite(logs[k])) ctx.lineTo(u.valToPos(f, "x", true), top + height * (1 - 0.95 * (logs[k] - low) / Math.max(1e-9, high - low))); });
      Object.assign(ctx, { strokeStyle: colour("--rule"), lineWidth: 1.5 * devicePixelRatio });
      ctx.stroke();
    }
    ctx.restore();
  }

  function level(u) {
    const order = chosen(), { left, width } = u.bbox, { ctx } = u;
    if (order == null) return;
    ctx.fillStyle = colour("--link");
    ctx.fillRect(left, u.valToPos(order, "y", true) - devicePixelRatio, width, 2 * devicePixelRatio);
  }

  function told() {
    if (!plot) return;
    plot.root.setAttribute("aria-valuenow", chosen() ?? "");
    plot.root.setAttribute("aria-valuetext", chosen() == null ? "by the evidence" : `order ${chosen()}`);
    plot.redraw(false);
  }

  button.addEventListener("click", show);
  settings.listen(() => { button.hidden = !document.body.classList.contains("has-signals"); told(); });
  return { pick };
})();
