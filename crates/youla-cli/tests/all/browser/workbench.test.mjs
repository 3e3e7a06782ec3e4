// The workbench: from a log to a verdict and other gains, by pointer and keyboard, with the method in the page.

import assert from "node:assert/strict";
import { execFileSync } from "node:child_process";
import { readFileSync, writeFileSync } from "node:fs";
import { join } from "node:path";
import { test } from "node:test";
import { open } from "./browser.mjs";
import { axis, browser, csv, field, folder, identified, opened, pid, program, scripts, workbench } from "./workbench.mjs";

const kept = (page, name) => page.evaluate(name => new TextDecoder().decode(engine.files.get(name) ?? new Uint8Array()), name);

test("from a log to a verdict and other gains", async () => {
  const { page, complaints, close } = await opened();
  await page.setInputFiles("#open-file", csv("axis.csv", axis()));
  await page.waitForSelector("#traces canvas");
  assert.deepEqual(await page.locator("#columns select").evaluateAll(all => all.slice(0, 4).map(s => s.value)), ["time", "input", "output", "excitation"]);
  await pid(page, true);
  await page.waitForFunction(() => document.getElementById("controller-said").textContent.includes("agrees with the log"));
  assert.match(await page.textContent("#findings"), /no defect/);
  assert.equal(await page.getAttribute("svg.loop", "aria-label"), "Loop with negative feedback");
  assert.match(await identified(page), /Trusted for this loop/);
  assert.match(await page.frameLocator("#report").locator("h1").textContent(), /axis/);

  // The same text by the program gives the same model.
  writeFileSync(join(folder, "run.toml"), await page.inputValue("#toml"));
  execFileSync(program, ["identify", "run.toml", "--out", "by-program", "--quiet"], { cwd: folder });
  const [here, there] = [await kept(page, "run-001/response.json"), readFileSync(join(folder, "by-program/response.json"), "utf8")].map(text => JSON.parse(text));
  assert.equal(JSON.stringify(Object.keys(here)), JSON.stringify(Object.keys(there)));
  const [a, b] = [numbers(here), numbers(there)], largest = Math.max(...b.map(Math.abs));
  assert.equal(a.length, b.length);
  a.forEach((value, k) => assert.ok(Math.abs(value - b[k]) <= 1e-6 * Math.max(Math.abs(b[k]), 1e-6 * largest), `${value} for ${b[k]}`));

  // The run folder of the program opens as well.
  await page.setInputFiles("#open-folder", join(folder, "by-program"));
  await page.waitForFunction(() => runs.shown === "by-program" && document.body.classList.contains("has-gains"));

  // Gains: the running ones are stable on the region, a hundred times kp is not, and then nothing is drawn as safe.
  await page.waitForFunction(() => document.getElementById("gain-verdict").textContent.startsWith("Stable on all"));
  const gain = page.locator("#gain-fields .fields label.field", { hasText: "kp" }).first().locator("input");
  await gain.fill("40");
  await gain.press("Tab");
  await page.waitForFunction(() => document.getElementById("gain-verdict").textContent.startsWith("Unstable"));
  assert.ok(await page.locator("#gain-plots.unsafe").count());
  const slider = page.locator("#gain-fields input[type=range]").first();
  await slider.focus();
  await slider.press("Home");
  assert.deepEqual(complaints, []);
  await close();
});

// All numbers of a result, in order.
function numbers(value) {
  if (typeof value === "number") return [value];
  return value && typeof value === "object" ? Object.keys(value).sort().flatMap(key => numbers(value[key])) : [];
}

test("an order is picked from the stabilisation chart", async () => {
  const { page, complaints, close } = await opened();
  await page.setInputFiles("#open-file", csv("axis.csv", axis({ samples: 6000 })));
  await page.waitForSelector("#traces canvas");
  await pid(page);
  await page.click("#show-orders");
  const chart = page.locator("#orders .uplot");
  await chart.waitFor();
  await chart.focus();
  for (let k = 0; k < 4; k++) await chart.press("ArrowUp");
  await page.waitForFunction(() => document.getElementById("toml").value.includes("order = 4"));
  await chart.press("Enter");
  await page.waitForSelector(".verdict-line", { timeout: 100000 });
  assert.equal(JSON.parse(await kept(page, "run-001/summary.json")).recommended.order, 4);
  // A nominal model is stated and compared.
  await page.selectOption("#nominal select >> nth=0", "transfer_function");
  await page.waitForFunction(() => document.getElementById("toml").value.includes("[nominal.transfer_function]"));
  for (const [label, value] of [["Numerator", "63165"], ["Denominator", "1, 15, 63165"]]) {
    const input = page.locator("#nominal label.field", { hasText: label }).locator("input");
    await input.fill(value);
    await input.press("Tab");
  }
  await page.click("#identify");
  await page.waitForFunction(() => engine.files.has("run-002/summary.json"), null, { timeout: 100000 });
  assert.ok((await kept(page, "run-002/report.json")).includes("nominal G(0)"), "the nominal model is compared");
  await chart.press("Escape");
  await page.waitForFunction(() => !document.getElementById("toml").value.includes("order = "));
  assert.deepEqual(complaints, []);
  await close();
});

test("every choice is a line of run.toml, undone and redone", async () => {
  const { page, complaints, close } = await opened();
  await page.setInputFiles("#open-file", csv("axis.csv", axis({ samples: 3000 })));
  await page.waitForSelector("#traces canvas");
  const text = () => page.inputValue("#toml");
  const first = await text();
  await pid(page);
  await page.waitForFunction(() => document.getElementById("toml").value.includes("kd = 0.002"));
  await page.locator("h1").click();
  for (let k = 0; k < 5; k++) { await page.keyboard.press("Control+z"); await page.waitForTimeout(60); }
  assert.equal(await text(), first);
  await page.keyboard.press("Control+y");
  await page.waitForFunction(() => document.getElementById("toml").value.includes("[controller.pid]"));
  // A range is dragged on the trace.
  await page.getByRole("button", { name: "verify on it" }).click();
  const box = await page.locator("#traces .u-over").first().boundingBox();
  await page.mouse.move(box.x + 0.5 * box.width, box.y + 20);
  await page.mouse.down();
  await page.mouse.move(box.x + 0.75 * box.width, box.y + 20, { steps: 4 });
  await page.mouse.up();
  await page.waitForFunction(() => /\[\[data\.verification\]\][^[]*skip = 1[45]\d\d/.test(document.getElementById("toml").value));
  // Text that cannot be read is said, and nothing is lost.
  await page.fill("#toml", "name = ");
  await page.locator("h1").click();
  await page.waitForFunction(() => document.getElementById("toml-error").textContent !== "");
  assert.deepEqual(complaints, []);
  await close();
});

test("decimal commas, two inputs and two outputs, a page that is saved and opened again", async () => {
  const { page, complaints, close } = await opened({ colorScheme: "dark" });
  await page.setInputFiles("#open-file", csv("paar.csv", axis({ channels: 2 }), { separator: ";", decimal: "," }));
  await page.waitForSelector("#traces canvas");
  assert.match(await page.textContent("#log-status"), /decimal comma/);
  // A PID in each loop: lists, and a slider for each.
  await page.selectOption("#controller select >> nth=0", "pid");
  for (const [label, value] of [["kp", "0,4; 0,4"], ["ki", "6; 6"], ["kd", "0,002"]]) await field(page, label, value);
  await page.check("input[name=feedback][value=negative]");
  assert.match(await page.inputValue("#toml"), /kp = \[0\.4, 0\.4\]/);
  assert.match(await identified(page), /Trusted for this loop/);
  const stable = () => page.waitForFunction(() => document.getElementById("gain-verdict").textContent.startsWith("Stable on all"));
  await stable();
  const before = await page.textContent("#gain-verdict");
  await page.getByRole("slider", { name: /^kp, loop 2/ }).fill("0.1");
  await page.waitForFunction(before => document.getElementById("gain-verdict").textContent !== before, before);
  await stable();
  assert.match(await page.locator("#gain-fields .fields input[data-name=kp]").inputValue(), /^0\.4; 0\.50/);
  const [saved] = await Promise.all([page.waitForEvent("download"), page.click("#save")]);
  const path = join(folder, "saved.html");
  await saved.saveAs(path);
  assert.deepEqual(complaints, []);
  await close();
  const again = await open(browser, path, { width: 390, height: 800 });
  await again.page.waitForSelector("body.has-run");
  await again.page.waitForFunction(() => document.getElementById("gain-verdict").textContent.startsWith("Stable on all"));
  assert.match(await again.page.textContent("#verdict"), /Trusted/);
  assert.ok(await again.page.evaluate(() => document.documentElement.scrollWidth <= innerWidth + 1), "nothing is wider than a phone");
  assert.deepEqual(again.complaints, []);
  await again.close();
});

test("files that are no logs, a wrong sign, a run that is cancelled", async () => {
  const { page, complaints, close } = await opened();
  const hostile = { "empty.csv": "", "words.csv": "a,b\nc,d\n", "short.npz": "PK\u0003\u0004", "head.mat": "MATLAB 5.0 MAT-file, nothing", "rows.csv": "t,u,y\n0,1,2\n1,2\n" };
  for (const [name, content] of Object.entries(hostile)) {
    writeFileSync(join(folder, name), content);
    await page.setInputFiles("#open-file", join(folder, name));
    await page.waitForFunction(() => !/^Reading|^Ready|^$/.test(document.getElementById("log-status").textContent));
    const said = await page.textContent("#log-status");
    assert.ok(said.includes(name) && !/panicked|unreachable/.test(said), said);
    await page.evaluate(() => { document.getElementById("log-status").textContent = ""; });
  }
  await page.setInputFiles("#open-file", csv("axis.csv", axis()));
  await page.waitForSelector("#traces canvas");
  await pid(page);
  await page.check("input[name=feedback][value=positive]");
  await page.waitForFunction(() => /feedback/.test(document.getElementById("findings").textContent) && /Defect/.test(document.getElementById("findings").textContent));
  await page.waitForFunction(() => !document.getElementById("identify").disabled);
  await page.click("#identify");
  await page.click("#cancel");
  await page.waitForFunction(() => document.getElementById("progress").textContent.startsWith("Cancelled"));
  await page.check("input[name=feedback][value=negative]");
  assert.match(await identified(page), /Trusted for this loop/);
  assert.deepEqual(complaints, []);
  await close();
});

test("what is typed while the page computes stays, and so does the focus", async () => {
  const { page, complaints, close } = await opened();
  await page.setInputFiles("#open-file", csv("axis.csv", axis({ samples: 3000 })));
  await page.waitForSelector("#traces canvas");
  // Answers come late, as those for a long log do, and each redraws the fields while the next is typed.
  await page.evaluate(() => { const ask = engine.ask; engine.ask = async (...all) => { await new Promise(done => setTimeout(done, 150)); return ask(...all); }; });
  const fields = page.locator("#controller .fields input"), toml = () => page.inputValue("#toml");
  for (const [form, values] of [["pid", { kp: "0,4", ki: "6", kd: "0.002", tf: "0.0001" }], ["cascade", { "Position kp": "12", "Velocity kp": "0.5", "Velocity ki": "3", "Filter of": "0.0002" }]]) {
    await page.selectOption("#controller select >> nth=0", form);
    await page.waitForSelector(`#controller .fields label:has-text("${Object.keys(values)[0]}")`);
    await fields.first().focus();
    for (const value of Object.values(values)) { await page.keyboard.type(value, { delay: 40 }); await page.keyboard.press("Tab"); }
    const last = values.tf ? /derivative_filter = 0.0001/ : /velocity_filter = 0.0002/;
    for (let k = 0; k < 100 && !last.test(await toml()); k++) await new Promise(done => setTimeout(done, 50));
    for (const [k, value] of Object.values(values).entries()) assert.equal(await fields.nth(k).inputValue(), value.replace(",", "."));
    assert.equal(await page.evaluate(() => document.activeElement.closest("label").textContent), await page.locator("#controller .fields label").nth(4).textContent());
  }
  const { position, velocity } = await page.evaluate(() => settings.table.controller.cascade);
  assert.deepEqual([position, velocity], [{ kp: 12 }, { kp: 0.5, ki: 3 }]);
  assert.deepEqual(complaints, []);
  await close();
});

test("in the frame of a notebook", async () => {
  const text = readFileSync(csv("axis.csv", axis({ samples: 3000 })), "utf8");
  // A document of its own, whose policy lets the frame run.
  const context = await browser.newContext(), page = await context.newPage();
  await page.goto("about:blank");
  const said = await page.evaluate(([html, text]) => new Promise(done => {
    const frame = document.createElement("iframe"), heard = {};
    frame.setAttribute("sandbox", "allow-scripts allow-downloads");
    addEventListener("message", ({ source, data }) => {
      if (source !== frame.contentWindow) return;
      if (data.youla.ready) frame.contentWindow.postMessage({ youla: { files: { "axis.csv": new TextEncoder().encode(text) } } }, "*");
      Object.assign(heard, data.youla);
      if (heard.settings?.includes("axis.csv")) done(heard.settings);
    });
    frame.srcdoc = html;
    document.body.append(frame);
  }), [readFileSync(workbench, "utf8"), text]);
  assert.match(said, /file = "axis.csv"/);
  await context.close();
});

test("the scripts agree with their types", () => {
  for (const project of ["tsconfig.json", "tsconfig.worker.json"]) execFileSync(process.execPath, ["node_modules/typescript/bin/tsc", "-p", join(scripts, project)], { stdio: "inherit" });
});
