/**
 * What a plane carries. Every number of it has a slot, 0..371:
 *
 * 0..2 are the viseme (select1, select2, blend), 3..6 the expression (select1, intensity1, select2, intensity2), 7..72
 * FAPs 3..68, 73..75 the flags viseme_def, init_face and expression_def, 76..371 BAPs 1..296.
 */
import { BAP_GROUPS, BAP_LIMITS, BAP_STEPS, FAP_GROUPS, FAP_LIMITS, FAP_STEPS, STEPS } from "./tables.js";

/** "iso": the standard's table of BAP steps; "visage": that of a vendor's tools. @typedef {"iso" | "visage"} BapSteps */

export const FACE = 1; // bits of fba_object_mask
export const BODY = 2;
export const SLOTS = 372;
export const FIRST_FAP = 7;
export const FLAGS = 73;
export const FIRST_BAP = 76;
const INTENSITY_MAX = 63;
const HIGHEST_AMOUNT = 2 * INTENSITY_MAX; // quantisers round past 0..63
const SELECT_LIMITS = [14, 14, 0, 6, 0, 6, 0];
const BAP_SCALES = [
  0, 1, 2, 3, 5, 7, 9, 11, 14, 17, 20, 23, 27, 31, 35, 39, 43, 47, 52, 57, 62, 67, 72, 77, 82, 88, 94, 100, 106, 113,
  120, 127,
];
export const RANGE_UNIT = 60;

/** Columns of each group, from 0 in coding order: of FAPs at FACE, of BAPs at BODY. */
export const GROUPS = [[], groups(FAP_GROUPS), groups(BAP_GROUPS)];
export const COLUMNS = GROUPS.map((group) => group.flat());
/** Slots of the first columns. */
export const BASE = [0, FIRST_FAP - 2, FIRST_BAP];

/** @param {string} digits */
function groups(digits) {
  /** @type {number[][]} */
  const members = [];
  [...digits].forEach((digit, column) => (members[parseInt(digit, 36)] ??= []).push(column));
  return members;
}

/** @param {number} slot below 7 */
const isAmount = (slot) => !SELECT_LIMITS[slot]; // viseme blend, expression intensities

/** Return the divisor of range limits, which is the factor of table steps. @param {number} part @param {number} quant */
export const scaleOf = (part, quant) => Math.max(part === FACE ? quant : BAP_SCALES[quant], 1);

/** Return the largest value of a viseme or expression in an I plane. @param {number} slot below 7 @param {number} quant */
export function amountLimit(slot, quant) {
  return SELECT_LIMITS[slot] || Math.floor((INTENSITY_MAX + (quant >> 1)) / (quant || 1));
}

/** Return the quantiser step of a slot. @param {number} slot @param {number} quant @param {BapSteps} table */
export function stepOf(slot, quant, table) {
  if (!quant) return 1;
  if (slot < FIRST_FAP) return isAmount(slot) ? quant : 1;
  if (slot < FLAGS) return STEPS[parseInt(FAP_STEPS[slot - FIRST_FAP], 36)] * quant;
  return STEPS[parseInt(BAP_STEPS[table][slot - FIRST_BAP] ?? "0", 36)] * scaleOf(BODY, quant);
}

/** The lowest value that each slot may have, and the highest. */
export const LOWEST = new Int32Array(SLOTS).fill(-(2 ** 31));
export const HIGHEST = new Int32Array(SLOTS).fill(2 ** 31 - 1);
for (let slot = 0; slot < FIRST_FAP; slot += 1) {
  LOWEST[slot] = isAmount(slot) ? -HIGHEST_AMOUNT : 0;
  HIGHEST[slot] = SELECT_LIMITS[slot] || HIGHEST_AMOUNT;
}

/** Default ranges as magnitudes, of all slots I max, I min, P max, P min; NaN for extension BAPs, which have none. */
export const DEFAULT_LIMITS = [0, 1, 2, 3].map((list) =>
  Float32Array.from({ length: SLOTS }, (_, slot) => {
    const [table, first] = slot < FLAGS ? [FAP_LIMITS[list >> 1], FIRST_FAP] : [BAP_LIMITS[Math.min(list, 2)], FIRST_BAP];
    return RANGE_UNIT * parseInt(table[slot - first] ?? "", 36);
  }),
);

/** Return the name of a slot's parameter. @param {number} slot */
export function label(slot) {
  if (slot < FIRST_FAP) return slot < 3 ? "FAP 1 (viseme)" : "FAP 2 (expression)";
  return slot < FLAGS ? `FAP ${slot - FIRST_FAP + 3}` : `BAP ${slot - FIRST_BAP + 1}`;
}
