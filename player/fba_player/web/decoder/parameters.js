/**
 * What a plane carries. Every number of it has a slot, 0..371:
 *
 * 0..2 are the viseme (select1, select2, blend), 3..6 the expression (select1, intensity1, select2, intensity2), 7..72
 * FAPs 3..68, 73..75 the flags viseme_def, init_face and expression_def, 76..371 BAPs 1..296.
 */
import { BAP_GROUPS, FAP_GROUPS, LIMITS, STEPS, STEP_PLACES } from "./tables.js";

/** "iso": the standard's table of BAP steps; "visage": that of a vendor's tools. @typedef {keyof typeof STEP_PLACES} BapSteps */

export const FACE = 1; // bits of fba_object_mask
export const BODY = 2;
export const SLOTS = 372;
export const FIRST_FAP = 7;
export const FLAGS = 73;
export const FIRST_BAP = 76;
export const RANGE_UNIT = 60;
let scale = 0;
const BAP_SCALES = [..."01112222333344444455555556666777"].map((more) => (scale += Number(more))); // 0 to 127

/** Of the face at FACE, of the body at BODY: number of columns; those of each group, in coding order; slot of column 0. @type {[number, number[][], number][]} */
export const PARTS = [[0, [], 0], [68, groups(FAP_GROUPS), FIRST_FAP - 2], [296, groups(BAP_GROUPS), FIRST_BAP]];

/** @param {string} digits */
function groups(digits) {
  /** @type {number[][]} */
  const members = [];
  [...digits].forEach((digit, column) => (members[parseInt(digit, 36)] ??= []).push(column));
  return members;
}

/** Highest value of viseme and expression; 126 for amounts, as quantisers round past 63, which may be negative. */
export const HIGHEST = [14, 14, 126, 6, 126, 6, 126];
/** @param {number} slot below 7 */
export const lowest = (slot) => (HIGHEST[slot] > 14 ? -126 : 0);

/** Return the divisor of range limits, which is the factor of table steps. @param {number} part @param {number} quant */
export const scaleOf = (part, quant) => (part === FACE ? quant : BAP_SCALES[quant]) || 1;

/** Return the largest value of a viseme or expression in an I plane. @param {number} slot below 7 @param {number} quant */
export const amountLimit = (slot, quant) =>
  lowest(slot) ? Math.floor((63 + (quant >> 1)) / (quant || 1)) : HIGHEST[slot];

/** Return the quantiser step of a slot; selects have none. @param {number} slot @param {BapSteps} table @param {number} scale 0 without a quantiser */
export const stepOf = (slot, table, scale) => (STEPS[+STEP_PLACES[table][slot]] ?? 1) * scale || 1;

/** Default ranges as magnitudes, in units of 60, of all slots I max, I min, P max, P min; extension BAPs have none. */
export const DEFAULT_LIMITS = LIMITS.map((list) => [...list].map((digit) => parseInt(digit, 36)));

/** Return the name of a slot's parameter. @param {number} slot */
export const label = (slot) =>
  slot < FLAGS ? `FAP ${slot < FIRST_FAP ? 1 + +(slot > 2) : slot - 4}` : `BAP ${slot - 75}`;
