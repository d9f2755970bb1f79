/** The page of `fba export`: shows the streams that are inside it, or those that arrive. */
import { streamUrl } from "./live.js";
import { readModel } from "./model.js";

/**
 * What the page holds. data, figures: base64, the figures gzipped as well. audio: a data URI. live: whether streams come from
 * where the page came from.
 * @typedef {{
 *   title: string, sources: {name: string, data: string, bapSteps?: "iso" | "visage"}[], figures: string[], audio?: string,
 *   audioOffset?: number, view?: string, loop?: boolean, live?: boolean,
 * }} Content
 */

/** @param {string} text base64 */
function bytesOf(text) {
  const { fromBase64 } = /** @type {{fromBase64?: (text: string) => Uint8Array}} */ (/** @type {unknown} */ (Uint8Array));
  if (fromBase64) return fromBase64.call(Uint8Array, text); // browsers since 2025
  const letters = atob(text);
  const bytes = new Uint8Array(letters.length);
  for (let k = 0; k < letters.length; k += 1) bytes[k] = letters.charCodeAt(k);
  return bytes;
}

/** Show what a page holds in its player; errors stand on the page. @param {string} text the content, as JSON */
export function startPage(text) {
  start(JSON.parse(text)).catch((error) => {
    const line = document.createElement("p");
    line.setAttribute("role", "alert");
    line.textContent = `this page cannot be shown: ${error?.message ?? error}`;
    document.body.prepend(line);
  });
}

/** @param {Content} content */
async function start(content) {
  const player = /** @type {import("./element.js").FBAPlayer} */ (document.querySelector("fba-player"));
  const model = readModel(...content.figures.map(bytesOf));
  if (content.view) player.setAttribute("view", content.view);
  if (content.loop) player.loop = true;
  if (content.audio) player.setAudio(content.audio, content.audioOffset ?? 0);
  if (content.live) {
    const number = Number(new URLSearchParams(location.search).get("n") ?? 0);
    player.showLive(streamUrl(location.href.replace(/[?#].*/, ""), number), await model);
    return;
  }
  const sources = content.sources.map(({ name, data, bapSteps }) => ({ name, bytes: bytesOf(data), ...(bapSteps ? { bapSteps } : {}) }));
  await player.show(sources, model);
  followLink(player);
  addEventListener("hashchange", () => followLink(player));
  addEventListener("keydown", (event) => {
    if (event.target === document.body) player.shadowRoot?.querySelector(".player")?.dispatchEvent(new KeyboardEvent("keydown", event));
  });
}

/** Go to the time of the page's address, `#t=3.2`. @param {import("./element.js").FBAPlayer} player */
function followLink(player) {
  const time = Number(new URLSearchParams(location.hash.slice(1)).get("t") ?? NaN);
  if (Number.isFinite(time)) player.currentTime = time;
}
