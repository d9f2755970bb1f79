/**
 * Slots: the numbers 0..371 of everything that a plane carries, and the tables of what they hold.
 *
 * 0..2 are the viseme (select1, select2, blend), 3..6 the expression (select1, intensity1, select2, intensity2), 7..72
 * FAPs 3..68, 73..75 the flags viseme_def, init_face and expression_def, 76..371 BAPs 1..296.
 */
import { BAP_GROUPS, BAP_LIMITS, BAP_STEPS, FAP_GROUPS, FAP_LIMITS, FAP_STEPS } from "./tables.js";
import { SLOTS } from "./coder.js";

/** "iso": the standard's table of BAP steps; "visage": that of a vendor's tools. @typedef {"iso" | "visage"} BapSteps */

export const FACE = 1; // bits of fba_object_mask
export const BODY = 2;
export const FIRST_FAP = 7;
export const FLAGS = 73;
export const FIRST_BAP = 76;
export const FAPS = 68;
export const BAPS = 296;
const AMOUNTS = [2, 4, 6]; // viseme blend, expression intensities
const INTENSITY_MAX = 63;
const SELECT_LIMITS = [14, 14, 0, 6, 0, 6, 0];
const BAP_SCALES = [
  0, 1, 2, 3, 5, 7, 9, 11, 14, 17, 20, 23, 27, 31, 35, 39, 43, 47, 52, 57, 62, 67, 72, 77, 82, 88, 94, 100, 106, 113,
  120, 127,
];
const RANGE_UNIT = 60;
const UNDEFINED = -1; // limit of an extension BAP before a range was sent for it

/**
 * Groups of a part. members: columns from 0 in coding order. stops: where each group ends in it.
 * @type {Record<number, {columns: number, members: Int32Array, stops: number[]}>}
 */
export const GROUPS = { [FACE]: groups(FAP_GROUPS, FAPS), [BODY]: groups(BAP_GROUPS, BAPS) };

/** @param {number[][]} listed numbers of each group @param {number} columns */
function groups(listed, columns) {
  let stop = 0;
  return {
    columns,
    members: Int32Array.from(listed.flat(), (number) => number - 1),
    stops: listed.map((group) => (stop += group.length)),
  };
}

/** Return the first slot of a part, and the slot behind its last. @param {number} part */
export function slotsOf(part) {
  return part === FACE ? [0, FLAGS] : [FIRST_BAP, SLOTS];
}

/** Return the divisor of range limits, which is the factor of table steps. @param {number} part @param {number} quant */
export function scaleOf(part, quant) {
  return Math.max(part === FACE ? quant : BAP_SCALES[quant], 1);
}

/** Return the largest value of a viseme or expression in an I plane. @param {number} slot below 7 @param {number} quant */
export function amountLimit(slot, quant) {
  if (!AMOUNTS.includes(slot)) return SELECT_LIMITS[slot];
  return quant ? Math.floor((INTENSITY_MAX + (quant >> 1)) / quant) : INTENSITY_MAX;
}

/** Return the quantiser step of a slot. @param {number} slot @param {number} quant @param {BapSteps} table */
export function stepOf(slot, quant, table) {
  if (!quant) return 1;
  if (slot >= FIRST_BAP) return BAP_STEPS[table][slot - FIRST_BAP] * scaleOf(BODY, quant);
  if (slot >= FIRST_FAP) return FAP_STEPS[slot - FIRST_FAP] * quant;
  return AMOUNTS.includes(slot) ? quant : 1;
}

/** Return [lowest, highest] value that a slot may have. @param {number} slot */
export function bounds(slot) {
  if (AMOUNTS.includes(slot)) return [-2 * INTENSITY_MAX, 2 * INTENSITY_MAX]; // quantisers round past 0..63
  if (slot < FIRST_FAP) return [0, SELECT_LIMITS[slot]];
  return [-(2 ** 31), 2 ** 31 - 1];
}

/** Return the default ranges as magnitudes, four lists of all slots: I max, I min, P max, P min. */
export function defaultLimits() {
  const limits = [0, 1, 2, 3].map(() => new Int32Array(SLOTS));
  for (let fap = 0; fap < FAPS - 2; fap += 1) {
    for (let list = 0; list < 4; list += 1) limits[list][FIRST_FAP + fap] = FAP_LIMITS[list >> 1][fap] * RANGE_UNIT;
  }
  for (let bap = 0; bap < BAPS; bap += 1) {
    for (let list = 0; list < 4; list += 1) {
      limits[list][FIRST_BAP + bap] = bap in BAP_LIMITS[list] ? BAP_LIMITS[list][bap] * RANGE_UNIT : UNDEFINED;
    }
  }
  return limits;
}

/**
 * Take the ranges that an I plane sends.
 * @param {Int32Array[]} limits @param {number} part @param {import("./header.js").Part} settings
 */
export function takeRanges(limits, part, settings) {
  const first = part === FACE ? FIRST_FAP - 2 : FIRST_BAP;
  settings.ranges.forEach((codes, list) => {
    if (!codes) return;
    for (let column = part === FACE ? 2 : 0; column < codes.length; column += 1) {
      if (settings.mask[column]) limits[list][first + column] = RANGE_UNIT * codes[column];
    }
  });
}

/** Return the first BAP that is sent without a range, from 1, or 0. @param {Int32Array[]} limits @param {Uint8Array} mask */
export function undefinedBap(limits, mask) {
  const lacks = (/** @type {number} */ bap) => limits.some((list) => list[FIRST_BAP + bap] === UNDEFINED);
  return mask.findIndex((sent, bap) => sent > 0 && lacks(bap)) + 1;
}

/** Return the name of a slot's parameter. @param {number} slot */
export function label(slot) {
  if (slot < 3) return `FAP 1 viseme_${["select1", "select2", "blend"][slot]}`;
  if (slot < FIRST_FAP) return `FAP 2 expression_${["select1", "intensity1", "select2", "intensity2"][slot - 3]}`;
  return slot < FLAGS ? `FAP ${slot - FIRST_FAP + 3}` : `BAP ${slot - FIRST_BAP + 1}`;
}

/** Slots in coding order, and segments: [first position, position behind the last, flag bits behind it]. */
export class Layout {
  /** @param {Uint8Array | null} face mask of FAPs @param {Uint8Array | null} body mask of BAPs */
  constructor(face, body) {
    /** @type {number[]} */
    const order = [];
    /** @type {[number, number, number][]} */
    const segments = [];
    const add = (/** @type {number[]} */ slots, /** @type {number} */ flags) => {
      segments.push([order.length, order.length + slots.length, flags]);
      order.push(...slots);
    };
    if (face) {
      if (face[0]) add([0, 1, 2], 1);
      if (face[1]) add([3, 4, 5, 6], 2);
      const low = [];
      for (let column = 2; column < FAPS; column += 1) if (face[column]) low.push(FIRST_FAP - 2 + column);
      add(low, 0);
    }
    if (body) add([...GROUPS[BODY].members].filter((column) => body[column]).map((column) => FIRST_BAP + column), 0);
    this.order = Int32Array.from(order);
    this.segments = segments;
  }
}
