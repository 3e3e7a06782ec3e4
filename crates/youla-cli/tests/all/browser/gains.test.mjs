// Gains on trial in the workbench: that they stay, and how they are judged beside the controller that ran.

import assert from "node:assert/strict";
import { join } from "node:path";
import { test } from "node:test";
import { drawn, open, painted } from "./browser.mjs";
import { browser, folder, judged, opened, withResult } from "./workbench.mjs";

const gainFields = (page, name) => page.locator(`#gain-fields .fields input[data-name=${name}]`);

async function tried(page, name, value) {
  await gainFields(page, name).fill(value);
  await page.keyboard.press("Tab");
  await page.waitForFunction(([name, value]) => String(settings.trial?.pid[name]) === value, [name, value]);
}

test("a run folder opens from its zip file, and models that the log contradicts are counted", async () => {
  const first = await withResult();
  const [saved] = await Promise.all([first.page.waitForEvent("download"), first.page.getByRole("button", { name: "Save run folder (zip)" }).click()]), path = join(folder, saved.suggestedFilename());
  await saved.saveAs(path);
  const verdict = await first.page.textContent("#verdict");
  // A name that is taken gets a number.
  await first.page.setInputFiles("#open-file", path);
  await first.page.waitForFunction(() => runs.shown === "run-001-2");
  await first.close();
  const { page, complaints, close } = await opened();
  await page.setInputFiles("#open-file", path);
  await judged(page, /^Stable on all 100 models of the region/);
  assert.ok((await page.textContent("#verdict")).startsWith(verdict));
  assert.equal(await page.textContent("#log-status"), "The run folder run-001 is open: its result is shown under Model.");
  // A controller that ran at the limit of stability does not stabilise a part of the region.
  const left = await page.evaluate(async () => {
    const file = "run-001/2-factor/controller.json", ran = JSON.parse(new TextDecoder().decode(engine.files.get(file)));
    const times = (factor, rows) => rows.map(row => row.map(v => factor * v));
    for (let low = 1, high = 100; ;) {
      const factor = (low + high) / 2;
      engine.put(file, new TextEncoder().encode(JSON.stringify({ ...ran, c: times(factor, ran.c), d: times(factor, ran.d) })));
      const { draws } = await engine.ask({ verb: "draw", run: "run-001" });
      if (draws > 0 && draws < 100) return draws;
      if (draws) low = factor; else high = factor;
    }
  });
  await page.evaluate(() => runs.show("run-001"));
  await judged(page, new RegExp(`^Stable on all ${left} models that the controller that ran stabilises; .*does not stabilise ${100 - left} of 100 models drawn from the region, which the log contradicts`));
  assert.deepEqual(complaints, []);
  await close();
});

test("gains on trial stay, are undone in order, and are in a saved page", async () => {
  const { page, complaints, close } = await withResult();
  assert.ok(await page.isDisabled("#gains-reset"));
  await tried(page, "kp", "0.5");
  await tried(page, "kd", "0.003");
  await page.getByRole("slider", { name: /^kp/ }).fill("-0.5");
  await page.waitForFunction(() => settings.trial.pid.kp < 0.2);
  const kp = await page.evaluate(() => settings.trial.pid.kp);
  // Another result, and the first again.
  await page.fill("#order input", "4");
  await page.keyboard.press("Tab");
  await page.click("#identify");
  await page.waitForFunction(() => runs.shown === "run-002" && document.body.classList.contains("has-gains"), null, { timeout: 100000 });
  await page.selectOption('[aria-label="Result"]', "run-001");
  await page.waitForFunction(() => runs.shown === "run-001" && document.body.classList.contains("has-gains"));
  assert.equal(await gainFields(page, "kp").inputValue(), String(kp));
  const [saved] = await Promise.all([page.waitForEvent("download"), page.click("#save")]), path = join(folder, "trial.html");
  await saved.saveAs(path);
  // Backwards: the order, the slider, kd, kp, the sign of the feedback.
  await page.locator("h1").click();
  const back = async what => { await page.keyboard.press("Control+z"); await page.waitForFunction(what); };
  await back(() => !settings.text.includes("order = 4") && settings.trial.pid.kp < 0.2);
  await back(() => settings.trial.pid.kp === 0.5 && settings.trial.pid.kd === 0.003);
  await back(() => settings.trial.pid.kd === 0.002);
  await back(() => settings.trial === null && settings.text.includes('feedback = "negative"'));
  await back(() => !settings.text.includes("feedback"));
  for (let k = 0; k < 3; k++) await page.keyboard.press("Control+y");
  await page.waitForFunction(() => settings.trial?.pid.kd === 0.003);
  await page.waitForFunction(() => document.querySelector("#gain-fields .fields input[data-name=kd]").value === "0.003");
  await page.click("#gains-reset");
  await page.waitForFunction(() => settings.trial === null && document.querySelector("#gain-fields .fields input[data-name=kp]").value === "0.4");
  assert.deepEqual(complaints, []);
  await close();
  const again = await open(browser, path);
  await again.page.waitForSelector("body.has-gains");
  assert.equal(await gainFields(again.page, "kp").inputValue(), String(kp));
  // The next result does not take the name of one that is there.
  await again.page.click("#identify");
  await again.page.waitForFunction(() => runs.shown === "run-003", null, { timeout: 100000 });
  assert.deepEqual(again.complaints, []);
  await again.close();
});

test("gains are judged beside the controller that ran, and nothing moves under the pointer", async () => {
  const { page, complaints, close } = await withResult({ colorScheme: "light" });
  const figures = () => page.locator("#gain-figures tbody tr").evaluateAll(rows => rows.map(row => [...row.cells].map(cell => cell.textContent)));
  assert.deepEqual((await figures()).filter(([, here, there, worse]) => here !== there || worse), []);
  const place = () => page.evaluate(() => ["#gain-fields .fields", "#gain-verdict", "#gain-plots"].map(of => document.querySelector(of).getBoundingClientRect().top - document.getElementById("gains").getBoundingClientRect().top)), first = await place();
  const locus = page.locator("canvas.locus"), light = (await painted(locus)).hash;
  await page.emulateMedia({ colorScheme: "dark" });
  await drawn(page);
  assert.notEqual((await painted(locus)).hash, light, "the locus is drawn again in other colours");
  const worse = async () => (await figures()).filter(row => row[3] === "worse").map(row => row[0]);
  await tried(page, "kd", "0.006");
  await judged(page, /^Stable on all 100 models of the region; peak sensitivity 1\.4/);
  assert.deepEqual(await worse(), ["Peak sensitivity", "Peak sensitivity, at worst over the region", "Gain margin, largest stable factor", "Delay margin", "S is below −3 dB up to"]);
  assert.equal(await page.textContent("#gain-caution"), "");
  await tried(page, "kd", "0.014");
  await judged(page, /^Little margin: stable on all 100 models of the region, but the peak sensitivity is 2\.3/);
  assert.deepEqual(await place(), first);
  assert.ok((await worse()).includes("Phase margin"));
  await tried(page, "kd", "0.03");
  await judged(page, /^Nearly unstable: stable on all 100 models/);
  assert.equal(await page.getAttribute("#gain-verdict", "class"), "headline bad");
  assert.match(await page.textContent("#gain-caution"), /^Nearly unstable: peak sensitivity \d+/);
  const [gains] = await Promise.all([page.waitForEvent("download"), page.click("#gains-save")]);
  assert.equal(gains.suggestedFilename(), "controller.json");
  assert.equal(await page.textContent("#gains-saved"), "Saved as controller.json.");
  await tried(page, "kd", "0.3");
  await judged(page, /^Unstable on the recommended model/);
  assert.deepEqual(await place(), first);
  assert.deepEqual(complaints, []);
  await close();
});
