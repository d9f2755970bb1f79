/**
 * Use a page in a real browser, without a network: node browse.mjs MODULES < steps.json > results.json
 *
 * MODULES: a folder with playwright-core and puppeteer-core. Input: {browser: "chromium" or "firefox", path of the program,
 * page: a file, or the address of a server, size: [width, height], steps: [...]}. A step has one of: wait (an expression that becomes true), run (an
 * expression, whose value is the result), key, click (a selector inside of the player), drag ([from, to] as shares of the
 * picture), wheel, size, shot (a file to write). Output: {results: one for each step, errors: what the page reported}.
 */
import { createRequire } from "node:module";
import { readFileSync } from "node:fs";

const modules = createRequire(`${process.argv[2]}/`);
const { browser: kind, path, page: file, size, steps } = JSON.parse(readFileSync(0, "utf8"));
const PATIENCE = 120_000;

const [browser, page] = await (kind === "firefox" ? openFirefox() : openChromium());
const errors = [];
page.on("console", (message) => message.type() === "error" && errors.push(message.text()));
page.on("pageerror", (error) => errors.push(String(error.message ?? error)));
await page.goto(file.includes("://") ? file : `file://${file}`);
const results = [];
for (const step of steps) results.push(await take(step));
process.stdout.write(JSON.stringify({ results, errors }));
await browser.close();

async function openChromium() {
  const { chromium } = modules("playwright-core");
  const args = [
    "--no-sandbox", "--use-gl=angle", "--use-angle=gl-egl", "--ignore-gpu-blocklist", "--disable-background-networking",
    "--disable-component-update", "--disable-sync", "--autoplay-policy=no-user-gesture-required",
  ];
  const browser = await chromium.launch({ executablePath: path, args, timeout: PATIENCE });
  const context = await browser.newContext({ viewport: { width: size[0], height: size[1] }, offline: !file.includes("://") });
  context.setDefaultTimeout(PATIENCE);
  return [browser, await context.newPage()];
}

async function openFirefox() {
  const puppeteer = modules("puppeteer-core").default ?? modules("puppeteer-core");
  const browser = await puppeteer.launch({ browser: "firefox", executablePath: path, headless: false, timeout: PATIENCE, protocolTimeout: PATIENCE });
  const page = await browser.newPage();
  page.setDefaultTimeout(PATIENCE);
  await page.setViewport({ width: size[0], height: size[1] }).catch((error) => {
    // Firefox 140 has the size by then, but knows no orientation of screens.
    if (!error.message.includes("setScreenOrientationOverride): unknown command")) throw error;
  });
  return [browser, page];
}

/** The place of an element inside of the player, in pixels. */
function placeOf(selector) {
  return page.evaluate((sought) => {
    const { left, top, width, height } = document.querySelector("fba-player").shadowRoot.querySelector(sought).getBoundingClientRect();
    return [left, top, width, height];
  }, selector);
}

/** Wait for an expression; the page's own policy forbids what the libraries do for that. */
async function until(expression) {
  const end = Date.now() + PATIENCE;
  while (!(await page.evaluate(expression))) {
    if (Date.now() > end) throw new Error(`never true: ${expression}; the page said: ${errors.join("; ")}`);
    await new Promise((done) => setTimeout(done, 50));
  }
  return true;
}

/** Press a key, perhaps with Shift. */
async function press(parts, key) {
  const [name, held] = parts.length > 1 ? [parts[1], parts[0]] : [key, null];
  if (held) await page.keyboard.down(held);
  await page.keyboard.press(name);
  if (held) await page.keyboard.up(held);
  return null;
}

/** Wait until the page has handled the input before: Firefox hands it on later than it answers. */
async function settle() {
  await page.evaluate("new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(() => done(null))))");
  return null;
}

async function take(step) {
  if (step.wait) return until(step.wait);
  if (step.run) return page.evaluate(step.run);
  if (step.key) return press(step.key.split("+").filter(Boolean), step.key).then(settle);
  if (step.size) return kind === "firefox" ? page.setViewport({ width: step.size[0], height: step.size[1] }) : page.setViewportSize({ width: step.size[0], height: step.size[1] });
  if (step.shot) return page.screenshot({ path: step.shot }).then(() => null);
  if (step.click) {
    const [left, top, width, height] = await placeOf(step.click);
    await page.mouse.click(left + width * (step.at ?? 0.5), top + height / 2);
    return settle();
  }
  const [left, top, width, height] = await placeOf(".stage canvas");
  if (step.wheel) {
    await page.mouse.move(left + width / 2, top + height / 2);
    if (kind === "firefox") await page.mouse.wheel({ deltaY: step.wheel });
    else await page.mouse.wheel(0, step.wheel);
    return null;
  }
  const [from, to] = step.drag;
  await page.mouse.move(left + width * from[0], top + height * from[1]);
  await page.mouse.down();
  await page.mouse.move(left + width * to[0], top + height * to[1], { steps: 5 });
  await page.mouse.up();
  return settle();
}
