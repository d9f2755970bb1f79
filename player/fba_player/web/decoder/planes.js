/** Reads the planes of an object (ISO/IEC 14496-2, FBA object plane), and keeps the state between them. */
import { read } from "./bits.js";
import { decodeSegment, learn, newModel } from "./coder.js";
import { Fraction } from "./fraction.js";
import {
  BODY, FACE, FIRST_BAP, FIRST_FAP, FLAGS, FLAG_SLOTS, HIGHEST, PARTS, RANGE_UNIT, SLOTS, DEFAULT_LIMITS, amountLimit, label,
  lowest, scaleOf, stepOf,
} from "./parameters.js";

const SKIP_MAX = 15 << 20; // a week at 25 frames/s; more is damage
const MARKER_EVERY = 4;

/**
 * What an I plane's header says of a part, in force until the next I plane with this part. mask: which parameters are
 * sent. interpolated: which others are to be interpolated. slots: those that are sent, in coding order. segments: of the
 * arithmetic coder, as [first, behind the last] of these slots, and bits that follow.
 * @typedef {{mask: Uint8Array, interpolated: Uint8Array, _slots: Int32Array, _segments: [number, number, number][]}} Part
 *
 * seconds: since midnight. marker: the marker bit in it.
 * @typedef {{_seconds: number, _marker: number}} TimeCode
 *
 * A plane. face, body: null where the plane carries none. row: values of the face's slots, then of the body's, then the
 * flags viseme_def, init_face and expression_def. bit, stop: where it lies. doubtful: it depends on ranges that may have
 * been replaced in a lost plane. rate, timeCode: of I planes that send one.
 * @typedef {{intra: boolean, rate?: Fraction, timeCode?: TimeCode, skip: number, face: Part | null, body: Part | null,
 *   row: Int32Array, bit: number, stop: number, doubtful: boolean}} Plane
 */

const numbers = () => new Int32Array(SLOTS);

/**
 * Return the functions of a reader of planes.
 * @param {import("./bits.js").Input} input
 * @param {(finding: string, bit: number, kind?: "unsupported") => never} fail throws an FbaError for the plane
 */
export function planeReader(input, fail) {
  /** Of the slots that were sent so far. @type {import("./coder.js").Model[]} */
  const models = [];
  const minimum = [numbers(), numbers()]; // smallest levels in P planes, in I planes
  const step = numbers();
  const last = numbers();
  // Of the plane that is being read:
  const symbols = numbers();
  const values = numbers();
  /** Of the object's BAP steps. @type {import("./parameters.js").BapSteps} */
  let table;
  /** Ranges of the slots: I max, I min, P max, P min. @type {Float32Array[]} */
  let limits;
  /** Of the face at FACE, of the body at BODY. @type {(Part | undefined)[]} */
  let settings;
  let doubtfulRanges = 0; // parts whose ranges may have been replaced in a lost plane

  const bits = (/** @type {number} */ count) => read(input, count);

  /** Reset settings behind damage: P planes are errors up to the next I plane. Ranges stay, as the best guess. */
  function forgetValues() {
    settings = [];
    doubtfulRanges = FACE | BODY;
  }

  /** Read a plane; throw OUT_OF_DATA or an FbaError. @returns {Plane} */
  function readPlane() {
    const bit = input._bit;
    const intra = bits(1) > 0;
    const mask = bits(2);
    if (!mask) fail("object mask 0", bit + 1);
    /** @type {Plane["rate"]} */
    let rate;
    /** @type {Plane["timeCode"]} */
    let timeCode;
    if (intra && bits(1)) {
      const sixteenths = bits(12); // frame_rate and seconds, with 8 and 4 bits
      rate = new Fraction(sixteenths * 125, bits(1) ? 2002 : 2000);
      if (!sixteenths) fail("frame rate 0", input._bit - 13);
    }
    if (intra && bits(1)) {
      const minutes = bits(5) * 60 + bits(6);
      const marker = bits(1);
      timeCode = { _seconds: minutes * 60 + bits(6), _marker: marker };
    }
    const parts = [FACE, BODY].filter((part) => mask & part);
    if (!intra && parts.some((part) => !settings[part])) fail("a P plane before the I plane of its part", bit);
    const skip = bits(1) && readSkip();
    let size = FLAG_SLOTS.length;
    values.fill(0, FLAGS, FIRST_BAP);
    const used = parts.map((part) => {
      const now = intra ? readPart(part) : /** @type {Part} */ (settings[part]);
      const begin = input._bit;
      for (const [first, stop, flags] of now._segments) {
        decodeSegment(input, fail, models, now._slots, first, stop, intra, symbols);
        for (let flag = 1; flag <= flags; flag += 1) values[FLAGS + flags + flag - 2] = bits(1);
      }
      if (intra) computeValues(now, intra, begin);
      size += now._slots.length;
      return now;
    });
    if (!intra) for (const part of used) computeValues(part, intra, bit);
    // Nothing is wrong with the plane: only now it changes what later ones depend on.
    parts.forEach((part, at) => (settings[part] = used[at]));
    const row = new Int32Array(size);
    let place = 0;
    for (const slots of [...used.map((part) => part._slots), FLAG_SLOTS]) {
      for (const slot of slots) {
        if (!intra && place < size - 3) learn(models[slot], symbols[slot]);
        row[place++] = last[slot] = values[slot];
      }
    }
    return {
      intra, rate, timeCode, skip, row, bit, stop: input._bit, face: mask & FACE ? used[0] : null,
      body: mask & BODY ? used[used.length - 1] : null, doubtful: (mask & doubtfulRanges) > 0,
    };
  }

  /** Compute the values of symbols, which must lie within the bounds. @param {Part} part @param {boolean} intra @param {number} bit that is named in an error */
  function computeValues({ _slots: slots }, intra, bit) {
    for (const slot of slots) {
      const value = (symbols[slot] + minimum[Number(intra)][slot]) * step[slot] + (intra ? 0 : last[slot]);
      if (value !== (value | 0) || (slot < FIRST_FAP && (value < lowest(slot) || value > HIGHEST[slot]))) {
        fail(`${label(slot)} out of range`, bit);
      }
      values[slot] = value;
    }
  }

  /** Read the header of a part of an I plane, and prepare the slots that it sends. @param {number} part */
  function readPart(part) {
    const [groups, base] = PARTS[part];
    const mask = new Uint8Array(groups.flat().length);
    const interpolated = mask.slice();
    /** Columns that are sent. @type {number[]} */
    const columns = [];
    const quant = bits(5);
    for (const group of groups) {
      const type = bits(3); // 4 none, 5 masked, 6 masked and the others interpolated, 7 all
      if (type < 4) failMarker(3);
      if (type === 6 && part === BODY) fail("BAPs to interpolate", input._bit - 2);
      for (const column of group) {
        if ((mask[column] = type % 4 % 3 ? bits(1) : Number(type > 6))) columns.push(column);
        else interpolated[column] = Number(type === 6);
      }
    }
    if (bits(2) & 1) fail("DCT segments", input._bit - 1, "unsupported"); // the bit before it is the gender
    const sent = bits(4);
    const ranges = limits.map((list, number) => {
      const range = list.slice();
      if (sent & (8 >> number)) {
        for (const group of groups.slice(Number(part === FACE))) { // FAP 1 and 2 have no ranges
          group.forEach((column, member) => {
            if (member % MARKER_EVERY === 0 && !bits(1)) failMarker(1);
            if (mask[column]) range[base + column] = RANGE_UNIT * bits(5);
          });
        }
      }
      return range;
    });
    limits = ranges;
    if (sent === 15) doubtfulRanges &= ~part;

    let now = settings[part];
    if (!now || !same(mask, now.mask) || !same(interpolated, now.interpolated)) {
      now = { mask, interpolated, ...layout(part, base, columns) };
    }
    const scale = scaleOf(part, quant);
    let lacking = SLOTS; // first slot without a range
    for (const slot of now._slots) {
      let [iMax, iMin, pMax, pMin] = limits.map((list) => Math.floor(list[slot] / scale));
      if (slot < FIRST_FAP) {
        iMin = 0;
        iMax = pMax = pMin = amountLimit(slot, quant);
      }
      if (iMax + iMin + pMax + pMin >= 0) models[slot] = newModel(iMax + iMin + 1, pMax + pMin + 1);
      else lacking = Math.min(lacking, slot);
      minimum[0][slot] = -pMin;
      minimum[1][slot] = -iMin;
      step[slot] = stepOf(slot, table, quant && scale);
    }
    if (lacking < SLOTS) fail(`no range for ${label(lacking)}`, input._bit);
    return now;
  }

  /** @param {number} back bits from here to the marker */
  const failMarker = (back) => fail("marker bit 0", input._bit - back);

  /** Read number_of_frames_to_skip. */
  function readSkip() {
    let skip = 0;
    let word;
    do {
      skip += word = bits(4);
      if (skip > SKIP_MAX) fail("too many frames to skip", input._bit - 4);
    } while (word === 15);
    return skip;
  }

  return {
    /** Reset all state. @param {import("./parameters.js").BapSteps} bapSteps in this object */
    _beginObject(bapSteps) {
      table = bapSteps;
      limits = DEFAULT_LIMITS;
      forgetValues();
      doubtfulRanges = 0;
    },
    _forgetValues: forgetValues,
    _read: readPlane,
  };
}

/** @param {Uint8Array} one @param {Uint8Array} other */
const same = (one, other) => one.every((value, at) => value === other[at]);

/** Return slots and segments of the columns that are sent. @param {number} part @param {number} base @param {number[]} columns */
function layout(part, base, columns) {
  /** @type {[number, number, number][]} */
  const segments = [];
  /** @type {number[]} */
  const slots = [];
  const add = (/** @type {number} */ flags, /** @type {number[]} */ ...more) =>
    segments.push([slots.length, slots.push(...more), flags]);
  if (part === FACE) {
    if (columns[0] === 0) {
      add(1, 0, 1, 2);
      columns.shift();
    }
    if (columns[0] === 1) {
      add(2, 3, 4, 5, 6);
      columns.shift();
    }
  }
  add(0, ...columns.map((column) => base + column));
  return { _slots: Int32Array.from(slots), _segments: segments };
}
