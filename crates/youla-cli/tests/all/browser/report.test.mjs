// What a reader does with the report of a run: look, zoom, read, hide, change the view; with mouse and with keys.

import { after, before, beforeEach, afterEach, describe, test } from "node:test";
import assert from "node:assert/strict";
import { drag, drawn, launch, open, painted, readingAt } from "./browser.mjs";

const PAGES = JSON.parse(process.env.YOULA_PAGES);
let browser, view, page;
before(async () => { browser = await launch(); });
after(() => browser.close());
beforeEach(async () => { view = await open(browser, PAGES.demo); page = view.page; });
afterEach(async () => { assert.deepEqual(view.complaints, []); await view.close(); });

const stackOf = part => page.locator(`#${part} .stack`).first();

describe("the first screen", () => {
  for (const [width, height] of [[1440, 900], [1180, 720]]) test(`answers at ${width} x ${height}, in six lines with evidence, the sixth the warning of a loop with little damping`, async () => {
    await page.setViewportSize({ width, height });
    const lines = page.locator("#trust .verdict > li");
    assert.equal(await lines.count(), 6);
    assert.equal(await page.locator("#trust .verdict .evidence").count(), 6);
    assert.ok((await lines.last().innerText()).includes("peak sensitivity"));
    const last = await lines.last().boundingBox();
    assert.ok(last.y + last.height <= height, `the last line ends at ${last.y + last.height}`);
  });

  test("shows the response of the recommended model before any record", async () => {
    const top = async part => (await page.locator(`#${part}`).boundingBox()).y;
    assert.ok(await top("frequency") < 600, `${await top("frequency")}`);
    // On the second screen.
    assert.ok(await top("modes") < 1800, `${await top("modes")}`);
    const tops = [];
    for (const part of ["trust", "frequency", "modes", "recommended", "verification", "residuals", "poles", "order", "data", "run"]) tops.push(await top(part));
    assert.deepEqual(tops, [...tops].sort((a, b) => a - b));
  });

  test("leads to the evidence", async () => {
    await page.locator("#trust .evidence", { hasText: "residuals" }).click();
    const top = await page.locator("#residuals").evaluate(node => node.getBoundingClientRect().top);
    assert.ok(top >= -1 && top < 200, `${top}`);
  });
});

describe("figures over time", () => {
  test("zoom by dragging, for all panels at once, and back", async () => {
    const stack = stackOf("verification");
    await stack.scrollIntoViewIfNeeded();
    await page.locator("#verification").getByRole("button", { name: "Everything", exact: true }).click();
    const [start, middle] = [await readingAt(page, stack, 0.002), await readingAt(page, stack, 0.5)];
    const before = await painted(stack.locator("canvas").last());
    await drag(page, stack, 0.5, 0.75);
    const zoomed = await readingAt(page, stack, 0.002);
    assert.ok(Math.abs(zoomed - middle) < 0.02 * (middle - start), `${zoomed} after ${middle}`);
    assert.notEqual((await painted(stack.locator("canvas").last())).hash, before.hash, "the residual beneath follows");
    await stack.locator(".u-over").first().dblclick();
    assert.ok(Math.abs(await readingAt(page, stack, 0.002) - start) < 0.02 * (middle - start));
  });

  test("read out and zoom with keys", async () => {
    const stack = stackOf("verification");
    await stack.focus();
    const reading = async () => Number((await stack.locator(".where").textContent()).match(/[\d.]+/)?.[0]);
    await page.keyboard.press("ArrowRight");
    const first = await reading();
    await page.keyboard.press("Shift+ArrowRight");
    assert.ok(await reading() > first);
    const before = await painted(stack.locator("canvas").first());
    await page.keyboard.press("+");
    await drawn(page);
    assert.notEqual((await painted(stack.locator("canvas").first())).hash, before.hash);
  });

  test("hide and show a curve by its name", async () => {
    const part = page.locator("#verification"), entry = part.locator(".legend button", { hasText: "Hansen G(S)" });
    const canvas = part.locator("canvas").first(), before = await painted(canvas);
    await entry.click();
    assert.equal(await entry.getAttribute("aria-pressed"), "false");
    await drawn(page);
    assert.notEqual((await painted(canvas)).hash, before.hash);
    await entry.press("Enter");
    assert.equal(await entry.getAttribute("aria-pressed"), "true");
    await page.mouse.move(0, 0);
    await drawn(page);
    assert.equal((await painted(canvas)).hash, before.hash);
  });

  test("change the output that is compared", async () => {
    const part = page.locator("#verification"), before = await painted(part.locator("canvas").first());
    await part.getByRole("button", { name: "y_v" }).click();
    assert.notEqual((await painted(part.locator("canvas").first())).hash, before.hash);
    assert.match(await part.locator(".caption").textContent(), /^y_v of /);
  });
});

describe("frequency responses", () => {
  test("as Bode diagram, Nyquist diagram and singular values", async () => {
    const part = page.locator("#frequency"), show = name => part.getByRole("button", { name, exact: true }).click();
    // Magnitude, phase, coherence, deviation by its causes.
    assert.equal(await part.locator("canvas").count(), 4);
    await show("Nyquist");
    assert.ok(await part.locator(".legend button", { hasText: "recommended, 95 %" }).isVisible(), "regions");
    assert.equal(await part.locator("canvas").count(), 1);
    assert.match(await part.getByRole("img", { name: /^Locus/ }).getAttribute("aria-label"), /y_h from u_h/);
    await part.getByRole("button", { name: "y_v from u_h" }).click();
    assert.match(await part.locator(".caption").textContent(), /y_v from u_h/);
    await show("Singular values");
    assert.equal(await part.locator("canvas").count(), 1);
    assert.equal(await part.getByRole("group", { name: "Response of" }).isVisible(), false);
    await show("Bode");
    assert.equal(await part.locator("canvas").count(), 4);
  });
});

describe("the map of poles and zeros", () => {
  const map = () => page.locator("#poles .stack").first();
  const marks = async () => (await painted(map().locator("canvas"))).hash;

  test("shows both, zooms with keys and by dragging, and returns", async () => {
    await map().scrollIntoViewIfNeeded();
    assert.ok(await page.locator("#poles .legend button", { hasText: "zeros" }).count() > 0);
    const whole = await marks(), changed = async () => { await drawn(page); return await marks() !== whole; };
    await map().focus();
    await page.keyboard.press("+");
    assert.ok(await changed());
    await page.keyboard.press("0");
    assert.ok(!await changed());
    await drag(page, map(), 0.3, 0.6, 0.3);
    assert.ok(await changed());
    await map().locator(".u-over").dblclick();
    await page.mouse.move(0, 0);
    assert.ok(!await changed());
  });

  test("hides a model by its name", async () => {
    const before = await marks();
    await page.locator("#poles .legend button", { hasText: "Hansen G(S)" }).last().click();
    await drawn(page);
    assert.notEqual(await marks(), before);
  });
});

test("keys alone reach every figure and every control", async () => {
  const reached = await page.evaluate(() => {
    const wanted = [...document.querySelectorAll(".stack, .controls button, .legend button, .evidence")].filter(node => node.checkVisibility());
    return wanted.filter(node => node.tabIndex < 0).map(node => node.outerHTML.slice(0, 80));
  });
  assert.deepEqual(reached, []);
  await page.keyboard.press("Tab");
  assert.equal(await page.evaluate(() => document.activeElement.className), "skip");
});
