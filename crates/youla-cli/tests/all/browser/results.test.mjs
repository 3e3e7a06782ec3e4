// What the workbench says of a controller, of a refusal and of its results, and where it says so.

import assert from "node:assert/strict";
import { test } from "node:test";
import { axis, csv, field, identified, opened, says, withResult } from "./workbench.mjs";

test("what is still needed, a defect with its remedy and a refusal stand where they are looked for", async () => {
  const { page, complaints, close } = await opened();
  await page.setInputFiles("#open-file", csv("axis.csv", axis({ samples: 6000 })));
  await page.waitForSelector("#traces canvas");
  await page.selectOption("#controller select >> nth=0", "pid");
  await says(page, "controller-said", /^Still needed: kp, the sign of the feedback\. ki, kd and Filter tf may stay empty/);
  await field(page, "kp", "0.4");
  await says(page, "controller-said", /^Still needed: the sign of the feedback; the log agrees with/);
  assert.doesNotMatch(await page.textContent("#findings"), /Defect/);
  assert.equal(await page.textContent("#missing"), "Still needed: the sign of the feedback.");
  for (const [label, value] of [["ki", "6"], ["kd", "0.002"]]) await field(page, label, value);
  await page.check("input[name=feedback][value=positive]");
  for (const place of ["controller-said", "defect"]) await says(page, place, /^Defect: .*with the opposite sign: change `feedback`/);
  await page.check("input[name=feedback][value=negative]");
  await says(page, "controller-said", /agrees with the log/);
  assert.equal(await page.textContent("#defect"), "");
  await identified(page);
  // The parts that verify are made to overlap those that identify.
  await page.evaluate(() => settings.change(({ data }) => { data.verification[0].skip = 100; }));
  await page.waitForSelector("body.stale");
  await page.click("#identify");
  await page.waitForSelector("#refused .verdict-line", { timeout: 100000 });
  assert.match(await page.textContent("#refused"), /would verify nothing/);
  assert.deepEqual(await page.evaluate(() => ["refused", "verdict"].map(id => getComputedStyle(document.getElementById(id)).opacity)), ["1", "0.55"]);
  assert.match(await page.textContent("#verdict"), /^✓Trusted/);
  assert.deepEqual(complaints, []);
  await close();
});

test("the report is as high as it is long, its links lead, and a comparison is closed", async () => {
  const { page, complaints, close } = await withResult();
  await page.waitForFunction(() => document.getElementById("report").clientHeight > 2000);
  const report = page.frameLocator("#report"), frame = page.locator("#report");
  assert.ok(await report.locator("html").evaluate(node => node.scrollHeight <= innerHeight + 1 && node.scrollWidth <= innerWidth), "the frame has no bars");
  await report.locator("#trust .evidence").first().click();
  await page.waitForFunction(() => scrollY > document.getElementById("report").offsetTop + 500);
  await page.getByRole("link", { name: "Skip the report" }).click();
  await page.waitForFunction(() => Math.abs(document.getElementById("gains").getBoundingClientRect().top) < 100);
  await page.fill("#order input", "4");
  await page.keyboard.press("Tab");
  await page.click("#identify");
  await page.getByRole("button", { name: "Compare", exact: true }).click({ timeout: 100000 });
  await page.waitForSelector("#close-comparison:not([hidden])");
  assert.doesNotMatch(await frame.getAttribute("srcdoc"), /<h1>axis<\/h1>/);
  await page.click("#close-comparison");
  await page.waitForFunction(() => /<h1>axis<\/h1>/.test(document.getElementById("report").srcdoc));
  assert.ok(await page.isHidden("#close-comparison"));
  assert.deepEqual(complaints, []);
  await close();
});
