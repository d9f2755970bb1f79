/** The controls of a player: their elements, icons and keys. */
import { SPEEDS } from "./playback.js";

const ICONS = {
  play: '<path class="solid" d="M6 4l10 6-10 6z"/>',
  pause: '<path d="M7 4v12M13 4v12"/>',
  back: '<path d="M14 5l-7 5 7 5zM5 5v10"/>',
  ahead: '<path d="M6 5l7 5-7 5zM15 5v10"/>',
  loop: '<path d="M4 9V8a3 3 0 0 1 3-3h9M13 2l3 3-3 3M16 11v1a3 3 0 0 1-3 3H4M7 18l-3-3 3-3"/>',
  sound: '<path d="M3 8v4h3l4 4V4L6 8zM13 7a4 4 0 0 1 0 6M15 4.5a8 8 0 0 1 0 11"/>',
  silent: '<path d="M3 8v4h3l4 4V4L6 8zM13 8l4 4M17 8l-4 4"/>',
  curves: '<path d="M2 10h3l2-6 4 12 3-8 1.500 2H18"/>',
  facts: '<circle cx="10" cy="10" r="7.500"/><path d="M10 9v5M10 6.200v.1"/>',
  keys: '<rect x="2" y="5" width="16" height="10" rx="2"/><path d="M5 8.500h.1M8 8.500h.1M11 8.500h.1M14 8.500h.1M6 12h8"/>',
  full: '<path d="M3 7V3h4M13 3h4v4M17 13v4h-4M7 17H3v-4"/>',
};

/** Names of the views, in the order of their keys. */
export const VIEW_NAMES = /** @type {[string, string][]} */ ([
  ["front", "front"],
  ["three-quarter", "three quarters"],
  ["profile", "side"],
  ["body", "whole body"],
]);

/** Keys of the desktop player that work here, and what they do. */
const KEYS = /** @type {[string[], string][]} */ ([
  [["Space"], "play, pause"],
  [["S"], "stop at the current time"],
  [["←", "→"], "one frame back, ahead"],
  [["Shift ←", "Shift →"], "ten frames back, ahead"],
  [["Home", "End"], "first, last frame"],
  [["[", "]"], "beginning, end of the loop here"],
  [["\\"], "remove the marks of the loop"],
  [["L"], "loop on, off"],
  [["+", "-"], "faster, slower"],
  [["0"], "normal speed"],
  [["I"], "motion between frames smooth, or frame by frame"],
  [["V"], "sound on, off"],
  [["1", "2", "3", "4"], "front, three quarters, side, whole body"],
  [["R"], "reset the view"],
  [["F5", "E"], "curves"],
  [["F2"], "facts about the stream"],
  [["H"], "hide everything but the picture"],
  [["F", "F11"], "full screen"],
  [["F1", "?"], "these keys"],
]);

/** Return the picture of a button. @param {keyof typeof ICONS} name */
export function iconOf(name) {
  return `<svg viewBox="0 0 20 20" aria-hidden="true">${ICONS[name]}</svg>`;
}

/** @param {string} action @param {keyof typeof ICONS} picture @param {string} label @param {string} [more] */
function button(action, picture, label, more = "") {
  return `<button type="button" data-do="${action}" aria-label="${label}" title="${label}" ${more}>${iconOf(picture)}</button>`;
}

/** The inside of a player. */
export const TEMPLATE = `
<div class="player" part="player" tabindex="0" role="group" aria-label="animation player">
  <div class="stage" part="stage">
    <canvas role="img" aria-label="animated figure"></canvas>
    <div class="names" aria-hidden="true"></div>
    <nav class="streams" aria-label="streams"></nav>
    <div class="toast" role="status"></div>
    <div class="message" role="alert" hidden></div>
  </div>
  <div class="panel lanes" hidden>
    <div class="row"><label>curves <input type="search" list="parameters" placeholder="add a parameter: name or number" aria-label="add a curve"></label>
    <datalist id="parameters"></datalist>${button("reset-curves", "loop", "curves that move most")}</div>
    <canvas role="img" aria-label="visemes, expressions and curves over time"></canvas>
  </div>
  <div class="panel facts" hidden></div>
  <div class="panel keys" hidden><table>${KEYS.map(([keys, what]) => `<tr><td>${keys.map((key) => `<kbd>${key}</kbd>`).join(" ")}</td><td>${what}</td></tr>`).join("")}</table></div>
  <div class="bar" part="bar">
    <div class="track"><canvas aria-hidden="true"></canvas><input type="range" min="0" max="1" step="any" value="0" aria-label="time"></div>
    <div class="row" role="toolbar" aria-label="controls">
      ${button("back", "back", "one frame back")}
      ${button("play", "play", "play")}
      ${button("ahead", "ahead", "one frame ahead")}
      <span class="time"><span class="now">0:00.00</span> <small class="all"></small></span>
      <span class="space"></span>
      ${button("loop", "loop", "loop", 'aria-pressed="false"')}
      ${button("sound", "sound", "sound", 'aria-pressed="true" hidden')}
      <select data-do="speed" aria-label="speed">${SPEEDS.map((speed) => `<option value="${speed}"${speed === 1 ? " selected" : ""}>${speed}×</option>`).join("")}</select>
      <select data-do="view" aria-label="view"><option value="">view</option>${VIEW_NAMES.map(([value, name]) => `<option value="${value}">${name}</option>`).join("")}</select>
      ${button("curves", "curves", "curves", 'aria-pressed="false" aria-expanded="false"')}
      ${button("facts", "facts", "facts about the stream", 'aria-pressed="false" aria-expanded="false"')}
      ${button("keys", "keys", "keys", 'aria-pressed="false" aria-expanded="false"')}
      ${button("full", "full", "full screen")}
    </div>
  </div>
</div>`;

/** Return a time as minutes, seconds and hundredths. @param {number} seconds */
export function clockText(seconds) {
  const hundredths = Math.round(Math.abs(seconds) * 100);
  const part = (/** @type {number} */ value) => String(value).padStart(2, "0");
  const [minutes, rest] = [Math.floor(hundredths / 6000), hundredths % 6000];
  const hours = minutes >= 60 ? `${Math.floor(minutes / 60)}:${part(minutes % 60)}` : String(minutes);
  return `${seconds < 0 ? "-" : ""}${hours}:${part(Math.floor(rest / 100))}.${part(rest % 100)}`;
}
