/** Reads the planes of an object (ISO/IEC 14496-2, FBA object plane), and keeps the state between them. */
import { Fault } from "./bits.js";
import { DAMAGED, Model, decodeSegment } from "./coder.js";
import { Fraction } from "./fraction.js";
import {
  BASE, BODY, COLUMNS, DEFAULT_LIMITS, FACE, FIRST_BAP, FIRST_FAP, GROUPS, HIGHEST, LOWEST, RANGE_UNIT, SLOTS,
  amountLimit, label, scaleOf, stepOf,
} from "./parameters.js";

/** @typedef {import("./bits.js").Bits} Bits */

const SKIP_MAX = 15 << 20; // a week at 25 frames/s; more is damage
const MARKER_EVERY = 4;
const FLAG_COUNT = 3; // viseme_def, init_face, expression_def
const NAMES = ["", "FAPs", "BAPs"];
const LISTS = ["i_max", "i_min", "p_max", "p_min"];

/**
 * What an I plane's header says of a part, in force until the next I plane with this part. mask: which parameters are
 * sent. interpolated: which others are to be interpolated. slots: those that are sent, in coding order. segments: of the
 * arithmetic coder, as [first, behind the last] of these slots, and bits that follow.
 * @typedef {{mask: Uint8Array, interpolated: Uint8Array, slots: Int32Array, segments: [number, number, number][]}} Part
 *
 * seconds: since midnight.
 * @typedef {{seconds: number, text: string, marker: number}} TimeCode
 *
 * A plane. face, body: null where the plane carries none. row: values of the face's slots, then of the body's, then the
 * flags viseme_def, init_face and expression_def. bit, stop: where it lies. doubtful: it depends on ranges that may have
 * been replaced in a lost plane. rate, timeCode: of I planes that send one.
 * @typedef {{intra: boolean, rate: Fraction | null, timeCode: TimeCode | null, skip: number, face: Part | null,
 *   body: Part | null, row: Int32Array, bit: number, stop: number, doubtful: boolean}} Plane
 */

export class PlaneReader {
  constructor() {
    /** Of the slots that were sent so far. @type {Model[]} */
    this._models = [];
    this._minimum = [new Int32Array(SLOTS), new Int32Array(SLOTS)]; // smallest levels in P planes, in I planes
    this._step = new Int32Array(SLOTS);
    this._last = new Int32Array(SLOTS);
    // Of the plane that is being read:
    this._symbols = new Int32Array(SLOTS);
    this._values = new Int32Array(SLOTS);
    this._flags = new Int32Array(FLAG_COUNT);
    /** Of the object's BAP steps. @type {import("./parameters.js").BapSteps} */
    this._table = "iso";
    /** Ranges of the slots: I max, I min, P max, P min. @type {Float32Array[]} */
    this._limits = [];
    /** Of the face at FACE, of the body at BODY. @type {(Part | undefined)[]} */
    this._settings = [];
    this._doubtfulRanges = 0; // parts whose ranges may have been replaced in a lost plane
  }

  /** Reset all state. @param {import("./parameters.js").BapSteps} table of the BAP steps in this object */
  _beginObject(table) {
    this._table = table;
    this._limits = DEFAULT_LIMITS.map((list) => list.slice());
    this._forgetValues();
    this._doubtfulRanges = 0;
  }

  /** Reset settings behind damage: P planes are errors up to the next I plane. Ranges stay, as the best guess. */
  _forgetValues() {
    this._settings = [];
    this._doubtfulRanges = FACE | BODY;
  }

  /** Read a plane; throw OUT_OF_DATA or a Fault. @param {Bits} bits @returns {Plane} */
  _read(bits) {
    const bit = bits._bit;
    const intra = bits._read(1) > 0;
    const mask = bits._read(2);
    if (!mask) throw new Fault("fba_object_mask is 0, expected 1 to 3", bit + 1);
    const { rate, timeCode } = intra ? readClock(bits) : { rate: null, timeCode: null };
    const parts = mask === 3 ? [FACE, BODY] : [mask];
    const missing = intra ? undefined : parts.find((part) => !this._settings[part]);
    if (missing) throw new Fault(`a P plane carries ${NAMES[missing]}, but no I plane of the object before it does`, bit);
    const skip = bits._read(1) ? readSkip(bits) : 0;
    /** @type {Part[]} */
    const used = [];
    let size = FLAG_COUNT;
    this._flags.fill(0);
    for (const part of parts) {
      const settings = intra ? this._readPart(bits, part) : /** @type {Part} */ (this._settings[part]);
      const begin = bits._bit;
      for (const [first, stop, flags] of settings.segments) {
        decodeSegment(bits, this._models, settings.slots, first, stop, !intra, this._symbols);
        for (let flag = 0; flag < flags; flag += 1) this._flags[flags - 1 + flag] = bits._read(1);
      }
      if (intra) this._computeValues(settings.slots, true, begin);
      used.push(settings);
      size += settings.slots.length;
    }
    if (!intra) for (const { slots } of used) this._computeValues(slots, false, bit);
    // Nothing is wrong with the plane: only now it changes what later ones depend on.
    const row = new Int32Array(size);
    let place = 0;
    parts.forEach((part, at) => {
      this._settings[part] = used[at];
      for (const slot of used[at].slots) {
        if (!intra) this._models[slot]._learn(this._symbols[slot]);
        row[place++] = this._last[slot] = this._values[slot];
      }
    });
    row.set(this._flags, place);
    return {
      intra, rate, timeCode, skip, row, bit, stop: bits._bit, face: mask & FACE ? used[0] : null,
      body: mask & BODY ? used[used.length - 1] : null, doubtful: (mask & this._doubtfulRanges) > 0,
    };
  }

  /**
   * Compute the values of symbols, which must lie within the bounds.
   * @param {Int32Array} slots @param {boolean} intra @param {number} bit that is named in an error
   */
  _computeValues(slots, intra, bit) {
    const minimum = this._minimum[Number(intra)];
    for (let position = 0; position < slots.length; position += 1) {
      const slot = slots[position];
      const value = (this._symbols[slot] + minimum[slot]) * this._step[slot] + (intra ? 0 : this._last[slot]);
      if (value < LOWEST[slot] || value > HIGHEST[slot]) {
        throw new Fault(`${label(slot)} gets a value outside ${LOWEST[slot]}..${HIGHEST[slot]}${DAMAGED}`, bit);
      }
      this._values[slot] = value;
    }
  }

  /** Read the header of a part of an I plane, and prepare the slots that it sends. @param {Bits} bits @param {number} part @returns {Part} */
  _readPart(bits, part) {
    const groups = GROUPS[part];
    const columns = COLUMNS[part];
    const mask = new Uint8Array(columns.length);
    const interpolated = new Uint8Array(columns.length);
    const quant = bits._read(5);
    groups.forEach((group, number) => {
      const type = bits._read(3) - 4; // 0 none, 1 masked, 2 masked and the others interpolated, 3 all
      if (type < 0) throw markerFault(`before the mask type of group ${number + 1} of ${NAMES[part]}`, bits._bit - 3);
      if (type === 2 && part === BODY) {
        const finding = `the mask type of group ${number + 1} of BAPs is 2 (interpolate), which only FAPs have`;
        throw new Fault(finding, bits._bit - 2);
      }
      for (const column of group) {
        mask[column] = type % 3 ? bits._read(1) : Number(type === 3);
        interpolated[column] = Number(type === 2 && !mask[column]);
      }
    });
    if (bits._read(2) & 1) { // the bit before it is the gender
      const finding = `${NAMES[part]} are coded as DCT segments, whose tables are in no public source`;
      throw new Fault(finding, bits._bit - 1, "unsupported");
    }
    const sent = bits._read(4);
    const ranges = LISTS.map((list, number) => {
      /** Slots and their codes. @type {[number, number][]} */
      const codes = [];
      if (sent & (8 >> number)) {
        for (const group of groups.slice(Number(part === FACE))) { // FAP 1 and 2 have no ranges
          group.forEach((column, member) => {
            const marked = member % MARKER_EVERY > 0 || bits._read(1);
            if (!marked) throw markerFault(`in the ${list} range list`, bits._bit - 1);
            if (mask[column]) codes.push([BASE[part] + column, bits._read(5)]);
          });
        }
      }
      return codes;
    });
    ranges.forEach((codes, list) => codes.forEach(([slot, code]) => (this._limits[list][slot] = RANGE_UNIT * code)));
    if (sent === 15) this._doubtfulRanges &= ~part;

    let settings = this._settings[part];
    if (!settings || !same(mask, settings.mask) || !same(interpolated, settings.interpolated)) {
      settings = { mask, interpolated, ...layout(part, columns.filter((column) => mask[column])) };
    }
    const scale = scaleOf(part, quant);
    const level = (/** @type {number} */ list, /** @type {number} */ slot) => Math.floor(this._limits[list][slot] / scale);
    let lacking = SLOTS; // first slot without a range
    for (const slot of settings.slots) {
      const amount = slot < FIRST_FAP ? amountLimit(slot, quant) : null;
      const iMin = amount === null ? level(1, slot) : 0;
      const pMin = amount ?? level(3, slot);
      const intraSize = (amount ?? level(0, slot)) + iMin + 1;
      const size = (amount ?? level(2, slot)) + pMin + 1;
      if (Number.isNaN(intraSize + size)) lacking = Math.min(lacking, slot);
      else (this._models[slot] ??= new Model())._begin(intraSize, size, pMin);
      this._minimum[0][slot] = -pMin;
      this._minimum[1][slot] = -iMin;
      this._step[slot] = stepOf(slot, quant, this._table);
    }
    if (lacking < SLOTS) {
      throw new Fault(`${label(lacking)} is sent, but no range for it, and it has no default`, bits._bit);
    }
    return settings;
  }
}

/** @param {Uint8Array} one @param {Uint8Array} other */
const same = (one, other) => one.every((value, at) => value === other[at]);

/** Return slots and segments of the columns that are sent. @param {number} part @param {number[]} columns */
function layout(part, columns) {
  /** @type {[number, number, number][]} */
  const segments = [];
  /** @type {number[]} */
  const slots = [];
  const add = (/** @type {number[]} */ more, /** @type {number} */ flags) =>
    segments.push([slots.length, slots.push(...more), flags]);
  if (part === FACE) {
    if (columns.includes(0)) add([0, 1, 2], 1);
    if (columns.includes(1)) add([3, 4, 5, 6], 2);
    columns = columns.filter((column) => column > 1);
  }
  add(columns.map((column) => BASE[part] + column), 0);
  return { slots: Int32Array.from(slots), segments };
}

/** @param {string} where @param {number} bit */
const markerFault = (where, bit) => new Fault(`marker bit ${where} is 0, expected 1`, bit);

/** Read the frame rate and the time code of an I plane. @param {Bits} bits @returns {{rate: Fraction | null, timeCode: TimeCode | null}} */
function readClock(bits) {
  let rate = null;
  if (bits._read(1)) {
    const sixteenths = bits._read(12); // frame_rate and seconds, with 8 and 4 bits
    rate = bits._read(1) ? new Fraction(sixteenths * 1000, 16 * 1001) : new Fraction(sixteenths, 16);
    if (!sixteenths) throw new Fault("the frame rate is 0", bits._bit - 13);
  }
  if (!bits._read(1)) return { rate, timeCode: null };
  const [hours, minutes, marker, seconds] = [5, 6, 1, 6].map((count) => bits._read(count));
  const text = [hours, ...[minutes, seconds].map((part) => String(part).padStart(2, "0"))].join(":");
  return { rate, timeCode: { seconds: (hours * 60 + minutes) * 60 + seconds, text, marker } };
}

/** Read number_of_frames_to_skip. @param {Bits} bits */
function readSkip(bits) {
  let skip = 0;
  for (let word = 15; word === 15; ) {
    word = bits._read(4);
    skip += word;
    if (skip > SKIP_MAX) throw new Fault(`number_of_frames_to_skip exceeds ${SKIP_MAX}`, bits._bit - 4);
  }
  return skip;
}
