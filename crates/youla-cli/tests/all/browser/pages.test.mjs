// What holds for every page, at the width of a desktop, of a laptop and of a phone, whatever a run has or has not.

import { after, before, describe, test } from "node:test";
import assert from "node:assert/strict";
import { drawn, launch, open, painted } from "./browser.mjs";

const PAGES = JSON.parse(process.env.YOULA_PAGES);
const SCREENS = { desktop: { width: 1440, height: 900 }, laptop: { width: 1000, height: 720 }, phone: { width: 390, height: 844 } };

let browser;
before(async () => { browser = await launch(); });
after(() => browser.close());

for (const [name, file] of Object.entries(PAGES)) for (const [screen, size] of Object.entries(SCREENS)) {
  describe(`${name} on a ${screen}`, () => {
    let view;
    before(async () => { view = await open(browser, file, size); });
    after(() => view.close());

    test("nothing is complained of, and nothing is fetched", () => assert.deepEqual(view.complaints, []));

    test("no part is wider than the window", async () => {
      const [content, window] = await view.page.evaluate(() => [document.documentElement.scrollWidth, document.documentElement.clientWidth]);
      assert.ok(content <= window, `${content} pixels in ${window}`);
    });

    test("a table that is wider than its place says so", async () => {
      const silent = await view.page.evaluate(() => [...document.querySelectorAll(".scroll")].filter(node => node.checkVisibility() && node.scrollWidth > node.clientWidth + 1)
        .filter(node => !/scroll/.test(getComputedStyle(node, "::before").content)).map(node => node.getAttribute("aria-label") ?? node.getAttribute("aria-labelledby")));
      assert.deepEqual(silent, []);
    });

    test("no text of a heading, a legend or a control is cut", async () => {
      const cut = await view.page.evaluate(() => [...document.querySelectorAll("h1, h2, h3, .legend button, .controls button, .verdict li")]
        .filter(node => node.checkVisibility() && (node.scrollWidth > node.clientWidth + 1 || node.getBoundingClientRect().right > innerWidth + 1)).map(node => node.textContent.slice(0, 60)));
      assert.deepEqual(cut, []);
    });

    test("every figure is drawn", async () => {
      for (const host of await view.page.locator("[data-figure]").all()) {
        const figure = await host.getAttribute("data-figure");
        const canvases = await host.locator("canvas").all(), drawings = await host.locator("svg path").count();
        assert.ok(canvases.length + drawings > 0, `${figure} is empty`);
        for (const canvas of canvases) assert.ok((await painted(canvas)).colours > 2, `${figure} is blank`);
      }
    });

    test("every link leads somewhere", async () => {
      const lost = await view.page.evaluate(() => [...document.querySelectorAll("a[href^='#']")].map(a => a.hash).filter(hash => !document.querySelector(hash)));
      assert.deepEqual(lost, []);
    });

    test("what is drawn is also said", async () => {
      const silent = await view.page.evaluate(() => [...document.querySelectorAll("[role=img], [role=region], nav, button")]
        .filter(node => !(node.getAttribute("aria-label") ?? (node.getAttribute("aria-labelledby") || node.textContent)).trim()).map(node => node.outerHTML.slice(0, 80)));
      assert.deepEqual(silent, []);
      const bare = await view.page.evaluate(() => [...document.querySelectorAll("canvas")].filter(node => !node.closest("[role=img]")).length);
      assert.equal(bare, 0);
    });
  });
}

for (const [name, file] of Object.entries(PAGES)) describe(`${name} otherwise`, () => {
  test("dark: other colours, figures drawn again, text with a contrast of 4.5", async () => {
    const { page, complaints, close } = await open(browser, file, { colorScheme: "light" });
    const ground = () => page.evaluate(() => getComputedStyle(document.body).backgroundColor);
    const contrasts = () => page.evaluate(() => {
      const style = getComputedStyle(document.documentElement);
      const luminance = name => {
        const hex = style.getPropertyValue(name).trim().slice(1), of = k => parseInt(hex.slice(2 * k, 2 * k + 2), 16) / 255;
        const [r, g, b] = [0, 1, 2].map(of).map(v => v <= 0.04045 ? v / 12.92 : ((v + 0.055) / 1.055) ** 2.4);
        return 0.2126 * r + 0.7152 * g + 0.0722 * b;
      };
      const paper = luminance("--paper");
      return ["--ink", "--soft", "--link", "--good", "--bad", "--caution"].map(name => [luminance(name), paper].sort((a, b) => b - a)).map(([a, b]) => (a + 0.05) / (b + 0.05));
    });
    const canvas = page.locator("canvas").first(), figures = await canvas.count() > 0;
    const light = [await ground(), figures && (await painted(canvas)).hash];
    assert.ok((await contrasts()).every(c => c >= 4.5), `light ${await contrasts()}`);
    await page.emulateMedia({ colorScheme: "dark" });
    await drawn(page);
    assert.notEqual(await ground(), light[0]);
    if (figures) assert.notEqual((await painted(canvas)).hash, light[1]);
    assert.ok((await contrasts()).every(c => c >= 4.5), `dark ${await contrasts()}`);
    assert.deepEqual(complaints, []);
    await close();
  });

  test("print: a document without controls", async () => {
    const { page, complaints, close } = await open(browser, file);
    const document = await page.pdf({ format: "A4" });
    assert.ok(document.length > 10_000 && document.subarray(0, 5).toString() === "%PDF-", `${document.length} bytes`);
    await page.emulateMedia({ media: "print" });
    assert.equal(await page.locator("nav").isVisible(), false);
    assert.deepEqual(complaints, []);
    await close();
  });

  test("without scripts the tables are there, and what is missing is said", async () => {
    const { page, close } = await open(browser, file, { javaScriptEnabled: false });
    assert.match(await page.content(), /<noscript>.*drawn by JavaScript/);
    assert.ok(await page.locator("#trust").isVisible() && await page.locator("#run").isVisible());
    for (const table of await page.locator("table").all()) assert.ok(await table.locator("tbody tr").count() > 0);
    await close();
  });
});
