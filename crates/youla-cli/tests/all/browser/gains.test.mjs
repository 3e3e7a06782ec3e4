// Gains on trial in the workbench: that they stay, and how they are judged beside the controller that ran.

import assert from "node:assert/strict";
import { join } from "node:path";
import { test } from "node:test";
import { open } from "./browser.mjs";
import { browser, folder, withResult } from "./workbench.mjs";

const gainFields = (page, name) => page.locator(`#gain-fields .fields input[data-name=${name}]`);

async function tried(page, name, value) {
  await gainFields(page, name).fill(value);
  await page.keyboard.press("Tab");
  await page.waitForFunction(([name, value]) => String(settings.trial?.pid[name]) === value, [name, value]);
}

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
