/** The keys of the desktop player. */
import { VIEW_NAMES } from "./controls.js";
import { SPEEDS } from "./playback.js";

/** @typedef {import("./element.js").FBAPlayer} FBAPlayer */

/** What keys do: by their name, with Shift as "Shift+". @type {Record<string, (player: FBAPlayer) => unknown>} */
const ACTIONS = {
  " ": (player) => (player.paused ? player.play() : player.pause()),
  "s": (player) => player.pause(),
  "ArrowLeft": (player) => step(player, -1),
  "ArrowRight": (player) => step(player, 1),
  "Shift+ArrowLeft": (player) => step(player, -10),
  "Shift+ArrowRight": (player) => step(player, 10),
  "Home": (player) => (player.currentTime = 0),
  "End": (player) => (player.frame = player.frames - 1),
  "[": (player) => mark(player, player.currentTime, player.range?.[1] ?? player.duration),
  "]": (player) => mark(player, player.range?.[0] ?? 0, player.currentTime),
  "\\": (player) => (player.range = null),
  "l": (player) => {
    player.loop = !player.loop;
    player.toast(player.loop ? "loop" : "no loop");
  },
  "+": (player) => change(player, 1),
  "=": (player) => change(player, 1),
  "-": (player) => change(player, -1),
  "0": (player) => (player.playbackRate = 1),
  "i": (player) => {
    player.smooth = !player.smooth;
    player.toast(player.smooth ? "smooth motion" : "frame by frame");
  },
  "v": (player) => (player.muted = !player.muted),
  "r": (player) => (player.view = ""),
  "e": (player) => player.toggle("lanes"),
  "F5": (player) => player.toggle("lanes"),
  "F2": (player) => player.toggle("facts"),
  "F1": (player) => player.toggle("keys"),
  "?": (player) => player.toggle("keys"),
  "h": (player) => player.toggleAttribute("controls"),
  "f": (player) => player.toggleFullScreen(),
  "F11": (player) => player.toggleFullScreen(),
};
VIEW_NAMES.forEach(([name], at) => (ACTIONS[String(at + 1)] = (player) => (player.view = name)));

/** Do what a key is for; return whether it is for anything. @param {FBAPlayer} player @param {KeyboardEvent} event */
export function handleKey(player, event) {
  if (event.ctrlKey || event.metaKey || event.altKey) return false;
  const target = /** @type {HTMLElement} */ (event.target);
  const written = target instanceof HTMLInputElement && target.type !== "range";
  if (written || target instanceof HTMLSelectElement || (target instanceof HTMLButtonElement && event.key === " ")) return false;
  const name = event.key.length === 1 ? event.key.toLowerCase() : event.key;
  const action = ACTIONS[event.shiftKey && event.key.startsWith("Arrow") ? `Shift+${name}` : name];
  if (!action) return false;
  action(player);
  return true;
}

/** @param {FBAPlayer} player @param {number} by */
function step(player, by) {
  player.pause();
  player.frame += by;
}

/** @param {FBAPlayer} player @param {number} from @param {number} to */
function mark(player, from, to) {
  player.range = from < to ? [from, to] : null;
  player.loop = true;
}

/** @param {FBAPlayer} player @param {number} by steps of the speed */
function change(player, by) {
  const at = SPEEDS.findIndex((speed) => speed >= player.playbackRate - 1e-9);
  player.playbackRate = SPEEDS[Math.min(Math.max((at < 0 ? SPEEDS.length - 1 : at) + by, 0), SPEEDS.length - 1)];
  player.toast(`${player.playbackRate}×`);
}
