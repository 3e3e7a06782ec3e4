// Pages in headless Chromium, with everything that they complain about.

import { chromium } from "playwright-core";

const QUIET = ["--no-sandbox", "--disable-gpu", "--disable-quic", "--no-first-run", "--disable-background-networking", "--disable-component-update", "--disable-sync"];

export const launch = () => chromium.launch({ executablePath: process.env.YOULA_CHROMIUM, args: QUIET });

// Opens a file; `complaints` collects errors of the console, exceptions and requests for anything but the file.
export async function open(browser, file, { width = 1440, height = 900, ...options } = {}) {
  const context = await browser.newContext({ viewport: { width, height }, ...options });
  const page = await context.newPage(), complaints = [];
  page.on("console", message => { if (["error", "warning"].includes(message.type())) complaints.push(message.text()); });
  page.on("pageerror", error => complaints.push(error.message));
  page.on("request", request => { if (!/^(file|data|blob):/.test(request.url())) complaints.push(`request of ${request.url()}`); });
  await page.goto(`file://${file}`);
  if (options.javaScriptEnabled !== false) await drawn(page);
  return { page, complaints, close: () => context.close() };
}

// Waits until what was asked for is on the screen.
export const drawn = page => page.evaluate(() => new Promise(done => requestAnimationFrame(() => requestAnimationFrame(done))));

// A digest of what a canvas shows, and whether it shows more than one colour.
export const painted = canvas => canvas.evaluate(node => {
  const copy = new OffscreenCanvas(node.width, node.height).getContext("2d", { willReadFrequently: true });
  copy.drawImage(node, 0, 0);
  const pixels = new Uint32Array(copy.getImageData(0, 0, node.width, node.height).data.buffer);
  let hash = 17;
  for (const pixel of pixels) hash = (Math.imul(hash, 31) + pixel) | 0;
  return { hash, colours: new Set(pixels).size };
});

// The reading of a stack with the pointer at a share of the width of its first panel.
export async function readingAt(page, stack, share) {
  const box = await stack.locator(".u-over").first().boundingBox();
  await page.mouse.move(box.x + share * box.width, box.y + box.height / 2);
  await drawn(page);
  const text = await stack.locator(".where").textContent();
  return Number(text.replace("\u2212", "-").match(/-?\d+(\.\d+)?/)?.[0]);
}

// From one share of the width to another and, for a plane, as far down.
export async function drag(page, stack, from, to, down = 0) {
  const box = await stack.locator(".u-over").first().boundingBox(), y = box.y + (0.5 - down / 2) * box.height;
  await page.mouse.move(box.x + from * box.width, y);
  await page.mouse.down();
  await page.mouse.move(box.x + to * box.width, y + down * box.height, { steps: 5 });
  await page.mouse.up();
}
