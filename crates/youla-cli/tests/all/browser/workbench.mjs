// The workbench with a log of a simulated axis.

import { mkdtempSync, writeFileSync } from "node:fs";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { after, before } from "node:test";
import { launch, open } from "./browser.mjs";

export const { workbench, program, scripts } = JSON.parse(process.env.YOULA_WORKBENCH);
export const folder = mkdtempSync(join(tmpdir(), "youla-workbench-"));
export let browser;
before(async () => { browser = await launch(); });
after(() => browser.close());

// Uniform numbers of a linear congruential generator (Numerical Recipes), and normal ones by the sum of twelve.
function chance(seed) {
  let state = seed >>> 0;
  const uniform = () => (state = (Math.imul(state, 1664525) + 1013904223) >>> 0) / 2 ** 32;
  return { uniform, normal: () => Array.from({ length: 12 }, uniform).reduce((a, b) => a + b) - 6 };
}

// A light resonance at 40 Hz, damping 3 %, under a PID computed by backward differences, with a binary excitation at the input.
export function axis({ samples = 12000, channels = 1, seed = 3 } = {}) {
  const ts = 1e-3, rows = [], { uniform, normal } = chance(seed);
  const loops = Array.from({ length: channels }, (_, k) => {
    const w = 2 * Math.PI * (40 + 15 * k), r = Math.exp(-0.03 * w * ts), p = 2 * r * Math.cos(w * ts * Math.sqrt(1 - 0.03 ** 2));
    return { p, q: r * r, b: 0.5 * (1 - p + r * r), x: [0, 0], u: [0, 0], sum: 0, e: 0, v: 0, d: 0 };
  });
  for (let k = 0; k < samples; k++) {
    const us = [], ys = [], ds = [];
    for (const one of loops) {
      const x = one.p * one.x[0] - one.q * one.x[1] + one.b * (one.u[0] + one.u[1]);
      one.x = [x, one.x[0]];
      one.v = 0.9 * one.v + 0.01 * normal();
      if (k % 5 === 0) one.d = uniform() < 0.5 ? -0.5 : 0.5;
      const e = -(x + one.v);
      one.sum += e * ts;
      const u = 0.4 * e + 6 * one.sum + 0.002 * (e - one.e) / ts + one.d;
      [one.e, one.u] = [e, [u, one.u[0]]];
      us.push(u); ys.push(-e); ds.push(one.d);
    }
    rows.push([k * ts, ...us, ...ys, ...ds]);
  }
  const names = role => loops.map((_, k) => channels === 1 ? role : `${role}${k + 1}`);
  return { names: ["time [s]", ...names("u"), ...names("y"), ...names("d")], rows };
}

export function csv(name, { names, rows }, { separator = ",", decimal = "." } = {}) {
  const path = join(folder, name), number = value => String(Number(value.toPrecision(9))).replace(".", decimal);
  writeFileSync(path, [names.join(separator), ...rows.map(row => row.map(number).join(separator))].join("\n") + "\n");
  return path;
}

export async function opened(options) {
  const found = await open(browser, workbench, options);
  await found.page.waitForSelector("body.ready");
  return found;
}

export async function field(page, label, value) {
  const input = page.locator("#controller .fields label.field", { hasText: label }).first().locator("input");
  await input.fill(value);
  await input.press("Tab");
  await page.waitForFunction(() => document.activeElement !== null);
}

// The controller of the axis; with `asked` the page is left to say which sign the log agrees with.
export async function pid(page, asked = false) {
  await page.selectOption("#controller select >> nth=0", "pid");
  for (const [label, value] of [["kp", "0,4"], ["ki", "6"], ["kd", "0.002"]]) await field(page, label, value);
  if (asked) await page.waitForFunction(() => document.getElementById("controller-said").textContent.includes("the log agrees with negative"));
  await page.check("input[name=feedback][value=negative]");
}

export async function identified(page) {
  await page.waitForFunction(() => !document.getElementById("identify").disabled);
  await page.click("#identify");
  await page.waitForSelector(".verdict-line", { timeout: 100000 });
  return page.textContent("#verdict");
}

// A page with the axis, its controller and a first result.
export async function withResult(options, log = axis({ samples: 6000 })) {
  const found = await opened(options), { page } = found;
  await page.setInputFiles("#open-file", csv("axis.csv", log));
  await page.waitForSelector("#traces canvas");
  await pid(page);
  await identified(page);
  await judged(page, /table on all 100 models/);
  return found;
}

export const says = (page, id, what) => page.waitForFunction(([id, what]) => new RegExp(what).test(document.getElementById(id).textContent), [id, what.source]);
export const judged = (page, what) => says(page, "gain-verdict", what);
