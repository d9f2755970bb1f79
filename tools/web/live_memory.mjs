/**
 * Watch a live page in a browser for minutes, and print how much memory the browser takes meanwhile:
 *
 *     fba serve hello.fap --loop --port 8080 &
 *     node tools/web/live_memory.mjs http://127.0.0.1:8080/ --minutes 30 [--browser firefox]
 *
 * Memory is that of the browser and all processes below it, without what they share with others (Linux). Firefox needs a
 * display (xvfb-run). Exits with 1 where the second half of the time takes over 10 % more than the first, or no frame comes.
 */
import { execFileSync } from "node:child_process";
import { readFileSync, readdirSync } from "node:fs";
import { createRequire } from "node:module";
import { parseArgs } from "node:util";

const GROWTH = 1.1; // of the median of the second half over that of the first, without the first sixth
const SAMPLES = 60;

const { values, positionals } = parseArgs({
  allowPositionals: true,
  options: { minutes: { type: "string", default: "30" }, browser: { type: "string", default: "chromium" } },
});
const modules = createRequire(new URL("../../player/fba_player/web/package.json", import.meta.url));
const { browser, page, process: root } = await open(values.browser);
await page.goto(positionals[0]);
await page.evaluate(() => {
  window.arrived = 0;
  document.querySelector("fba-player").addEventListener("frames", ({ detail }) => (window.arrived += detail));
});

const samples = [];
const pause = (Number(values.minutes) * 60_000) / SAMPLES;
let shown = 0;
for (let number = 1; number <= SAMPLES; number += 1) {
  await new Promise((done) => setTimeout(done, pause));
  shown = await page.evaluate(() => window.arrived);
  samples.push(memory(root));
  console.log(`${((number * pause) / 60_000).toFixed(1)} min: ${samples.at(-1).toFixed(0)} MB, ${shown} frames`);
}
await browser.close();

const settled = samples.slice(SAMPLES / 6);
const [first, second] = [settled.slice(0, settled.length / 2), settled.slice(settled.length / 2)].map(median);
console.log(`median of the first half ${first.toFixed(0)} MB, of the second ${second.toFixed(0)} MB`);
process.exit(shown > 0 && second <= GROWTH * first ? 0 : 1);

async function open(kind) {
  const path = execFileSync("sh", ["-c", kind === "firefox" ? "command -v firefox-esr || command -v firefox" : "command -v chromium"], { encoding: "utf8" }).trim();
  const puppeteer = modules("puppeteer-core").default ?? modules("puppeteer-core");
  const args = ["--no-sandbox", "--use-gl=angle", "--use-angle=gl-egl", "--ignore-gpu-blocklist"];
  const browser = await puppeteer.launch(
    kind === "firefox" ? { browser: "firefox", executablePath: path, headless: false } : { executablePath: path, args },
  );
  const page = await browser.newPage();
  await page.setViewport({ width: 480, height: 360 });
  return { browser, page, process: browser.process().pid };
}

/** Return the megabytes of a process and of those below it. */
function memory(root) {
  const parents = new Map();
  for (const name of readdirSync("/proc").filter((entry) => /^\d+$/.test(entry))) {
    const parent = Number(read(`/proc/${name}/stat`).split(") ").pop().split(" ")[1]);
    parents.set(parent, [...(parents.get(parent) ?? []), Number(name)]);
  }
  const below = (number) => [number, ...(parents.get(number) ?? []).flatMap(below)];
  const own = (number) => [...read(`/proc/${number}/smaps_rollup`).matchAll(/^Private_\w+:\s+(\d+) kB/gm)];
  return below(root).flatMap(own).reduce((sum, [, kilobytes]) => sum + Number(kilobytes), 0) / 1024;
}

/** Return the content of a file of a process, "" of one that has ended. */
function read(path) {
  try {
    return readFileSync(path, "utf8");
  } catch {
    return "";
  }
}

function median(numbers) {
  return [...numbers].sort((one, other) => one - other)[numbers.length >> 1];
}
