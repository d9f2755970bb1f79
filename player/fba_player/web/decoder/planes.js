/** Reads the planes of an object (ISO/IEC 14496-2, FBA object plane), and keeps the state between them. */
import { read } from "./bits.js";
import { UNUSED, decodeSegment, learn } from "./coder.js";
import { fraction } from "./fraction.js";
import {
  BODY, FACE, FIRST_FAP, HIGHEST, PARTS, RANGE_UNIT, DEFAULT_LIMITS, amountLimit, label,
  lowest, scaleOf, stepOf,
} from "./parameters.js";

const SKIP_MAX = 15 << 20; // a week at 25 frames/s; more is damage
const MARKER_EVERY = 4;
/** Segments of FAP 1 and 2. @type {[number[], number][]} */
const VISEME_AND_EXPRESSION = [[[0, 1, 2], 1], [[3, 4, 5, 6], 2]];

/**
 * What an I plane's header says of a part, in force until the next I plane with this part. mask: which parameters are
 * sent. interpolated: which others are to be interpolated. slots: those that are sent, in coding order. segments: of the
 * arithmetic coder, their slots and how many flags follow.
 * @typedef {{mask: Uint8Array, interpolated: Uint8Array, _slots: number[], _segments: [number[], number][]}} Part
 *
 * seconds: since midnight. marker: the marker bit in it.
 * @typedef {{_seconds: number, _marker: number}} TimeCode
 *
 * A plane. face, body: undefined where the plane carries none. row: values of the face's slots, then of the body's, then the
 * flags viseme_def, init_face and expression_def. bit, stop: where it lies. doubtful: it depends on ranges that may have
 * been replaced in a lost plane. rate, timeCode: of I planes that send one.
 * @typedef {{_rate?: import("./fraction.js").Fraction, _timeCode?: TimeCode, _skip: number, _face?: Part,
 *   _body?: Part, _row: Int32Array, _stop: number, _shown: {bit: number, intra: boolean, doubtful: boolean}}} Plane
 */

/**
 * Return the functions of a reader of planes.
 * @param {import("./bits.js").Input} input
 * @param {(finding: string, bit: number, kind?: "unsupported") => never} fail throws an FbaError for the plane
 */
export function planeReader(input, fail) {
  /** Of the slots that were sent so far. @type {import("./coder.js").Model[]} */
  const models = [];
  /** Of the object's BAP steps. @type {import("./parameters.js").BapSteps} */
  let table;
  /** Ranges of the slots, in units of 60: I max, I min, P max, P min. @type {number[][]} */
  let limits;
  /** Of the face at FACE, of the body at BODY, as far as they were sent. @type {Part[]} */
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
    /** @type {Plane["_rate"]} */
    let rate;
    /** @type {Plane["_timeCode"]} */
    let timeCode;
    if (intra && bits(1)) {
      const sixteenths = bits(12); // frame_rate and seconds, with 8 and 4 bits
      rate = fraction(sixteenths * 125, bits(1) ? 2002 : 2000);
      if (!sixteenths) fail("frame rate 0", input._bit - 13);
    }
    if (intra && bits(1)) {
      const minutes = bits(5) * 60 + bits(6);
      const marker = bits(1);
      timeCode = { _seconds: minutes * 60 + bits(6), _marker: marker };
    }
    const parts = [FACE, BODY].filter((part) => mask & part);
    if (!intra && parts.some((part) => !settings[part])) fail("P plane before an I plane", bit);
    const skip = bits(1) && readSkip();
    const flags = [0, 0, 0];
    let size = 3;
    /** @type {Part[]} */
    const used = [];
    for (const part of parts) {
      const { _slots: slots, _segments: segments } = (used[part] = intra ? readPart(part) : settings[part]);
      const begin = input._bit;
      for (const [among, count] of segments) {
        decodeSegment(input, fail, models, among, intra);
        for (let flag = 0; flag < count; flag += 1) flags[count - 1 + flag] = bits(1);
      }
      if (intra) computeValues(slots, intra, begin);
      size += slots.length;
    }
    if (!intra) for (const part of parts) computeValues(used[part]._slots, intra, bit);
    // Nothing is wrong with the plane: only now it changes what later ones depend on.
    Object.assign(settings, used);
    const row = new Int32Array(size);
    let at = 0;
    for (const part of parts) {
      for (const slot of used[part]._slots) {
        const model = models[slot];
        if (!intra) learn(model, model._symbol);
        row[at++] = model._last = model._value;
      }
    }
    row.set(flags, at);
    return {
      _rate: rate, _timeCode: timeCode, _skip: skip, _row: row, _stop: input._bit,
      _face: used[FACE], _body: used[BODY],
      _shown: { bit, intra, doubtful: (mask & doubtfulRanges) > 0 },
    };
  }

  /** Compute the values of symbols, which must lie within the bounds. @param {number[]} slots @param {boolean} intra @param {number} bit that is named in an error */
  function computeValues(slots, intra, bit) {
    for (const slot of slots) {
      const model = models[slot];
      const value = (model._symbol - (intra ? model._intraMin : model._min)) * model._step + (intra ? 0 : model._last);
      if (value !== (value | 0) || (slot < FIRST_FAP && (value < lowest(slot) || value > HIGHEST[slot]))) {
        fail(`${label(slot)} out of range`, bit);
      }
      model._value = value;
    }
  }

  /** Read the header of a part of an I plane, and prepare the slots that it sends. @param {number} part */
  function readPart(part) {
    const [size, groups, base] = PARTS[part];
    const mask = new Uint8Array(size);
    const interpolated = mask.slice();
    /** @type {number[]} */
    const slots = [];
    const quant = bits(5);
    for (const group of groups) {
      const type = bits(3); // 4 none, 5 masked, 6 masked and the others interpolated, 7 all
      if (type < 4) failMarker(3);
      if (type === 6 && part === BODY) fail("BAPs to interpolate", input._bit - 2);
      for (const column of group) {
        if ((mask[column] = type % 4 % 3 ? bits(1) : +(type > 6))) slots.push(base + column);
        else interpolated[column] = +(type === 6);
      }
    }
    if (bits(2) & 1) fail("DCT segments", input._bit - 1, "unsupported"); // the bit before it is the gender
    const sent = bits(4);
    const ranges = limits.map((list, number) => {
      const range = list.slice();
      if (sent & (8 >> number)) {
        for (const group of groups.slice(+(part === FACE))) { // FAP 1 and 2 have no ranges
          group.forEach((column, member) => {
            if (member % MARKER_EVERY === 0 && !bits(1)) failMarker(1);
            if (mask[column]) range[base + column] = bits(5);
          });
        }
      }
      return range;
    });
    limits = ranges;
    if (sent === 15) doubtfulRanges &= ~part;

    let now = settings[part];
    if (!now || !same(mask, now.mask) || !same(interpolated, now.interpolated)) {
      const segments = VISEME_AND_EXPRESSION.filter((_, column) => part === FACE && mask[column]);
      segments.push([slots.filter((slot) => slot >= FIRST_FAP), 0]);
      now = { mask, interpolated, _slots: segments.flatMap(([among]) => among), _segments: segments };
    }
    const scale = scaleOf(part, quant);
    for (const slot of now._slots) {
      let [intraMax, intraMin, max, min] = limits.map((list) => Math.floor((RANGE_UNIT * list[slot]) / scale));
      if (slot < FIRST_FAP) {
        intraMin = 0;
        intraMax = max = min = amountLimit(slot, quant);
      }
      const levels = max + min + 1;
      if (!(intraMax + intraMin + levels > 0)) fail(`no range for ${label(slot)}`, input._bit);
      models[slot] = /** @type {import("./coder.js").Model} */ ({
        _intraSize: intraMax + intraMin + 1, _size: levels, _intraMin: intraMin, _min: min, _step: stepOf(slot, table, quant && scale),
        _total: levels, _belowUsual: min, _added: UNUSED, _tree: UNUSED,
      });
    }
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
      if (skip > SKIP_MAX) fail("too many frames skipped", input._bit - 4);
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
