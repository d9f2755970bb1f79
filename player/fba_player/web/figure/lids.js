/** Lids that go along with the gaze, as they are shown: what `_lids.py` of the desktop player does. */
import { checkedNumber, checkedNumbers } from "./container.js";

const [UPPER, LOWER, PITCH] = [[18, 19], [20, 21], [24, 25]]; // columns, left and right: upper lids, lower lids, gaze
const CLOSED = 1024;
const [UPPER_FOLLOWS, LOWER_FOLLOWS] = [0.6, 0.3]; // shares of the pupil's way that the lids make
const PITCH_UNIT = 1e-5; // radians, positive downwards

/** Eyes whose gaze lids follow. @typedef {{side: number, reach: number}[]} Gazes */

/** Return the side of each eyeball, 0 left, 1 right, and its radius in units of FAPs of lids. @param {Record<string, any>[]} eyes of a header @returns {Gazes} */
export function readGazes(eyes) {
  return eyes.map(({ numbers }) => {
    const [side, radius, , , step] = checkedNumbers(numbers, "an eye", 5);
    return { side: checkedNumber(side, "the side of an eye", 2), reach: step > 0 ? radius / step : 0 };
  });
}

/** Add to FAPs of the lids what the gaze asks for, less where they are closed. @param {Gazes} gazes @param {Float64Array} faps */
export function followGaze(gazes, faps) {
  for (const { side, reach } of gazes) {
    const pitch = faps[PITCH[side]] * PITCH_UNIT;
    if (pitch === 0) continue;
    const open = Math.min(Math.max(1 - (faps[UPPER[side]] + faps[LOWER[side]]) / CLOSED, 0), 1);
    const way = Math.sin(pitch) * reach * open;
    faps[UPPER[side]] += UPPER_FOLLOWS * way;
    faps[LOWER[side]] -= LOWER_FOLLOWS * way;
  }
}
