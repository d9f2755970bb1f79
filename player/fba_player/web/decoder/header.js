/** Headers of planes and of their parts (ISO/IEC 14496-2, FBA object plane). */
import { OK, OUT_OF_DATA, readBit, readBits } from "./coder.js";
import { Fraction } from "./fraction.js";
import { FACE, GROUPS } from "./slots.js";

export const SKIP_TOO_LONG = 8;
const SKIP_MAX = 15 << 20; // a week at 25 frames/s; more is damage
export const NO_START_CODE = -1;
export const UNDECIDED = -2;
export const DCT = 1;
const MARKER_EVERY = 4;
const LISTS = ["i_max", "i_min", "p_max", "p_min"];

/**
 * Half of an I plane's header, in force until the next I plane with this part. mask: which parameters are sent.
 * types: of each group: 0 none, 1 masked, 2 masked and the others interpolated, 3 all. ranges: four lists, or null.
 * @typedef {{quant: number, types: number[], mask: Uint8Array, gender: number, ranges: (Uint8Array | null)[]}} Part
 *
 * @typedef {{hours: number, minutes: number, marker: number, seconds: number}} TimeCode
 * @typedef {{mask: number, rate: Fraction | null, timeCode: TimeCode | null, skip: number}} Header
 */

/** Thrown where data end inside an element; never reaches a caller of the decoder. */
export class OutOfData extends Error {}

/** Damage at a bit of the data. */
export class Fault extends Error {
  /** @param {string} finding @param {number} bit @param {boolean} [unsupported] */
  constructor(finding, bit, unsupported = false) {
    super(finding);
    this.bit = bit;
    this.unsupported = unsupported;
  }
}

/** Reads bits up to an end; OutOfData beyond. */
export class BitReader {
  /** @param {Uint8Array} data @param {number} bit @param {number} end */
  constructor(data, bit, end) {
    this.data = data;
    this.bit = bit;
    this.end = end;
  }

  /** @param {number} count up to 31 */
  read(count) {
    if (this.bit + count > this.end) throw new OutOfData();
    this.bit += count;
    return readBits(this.data, this.bit - count, count);
  }
}

/**
 * Read number_of_frames_to_skip; return [status, frames, bit behind it or of the error].
 * @param {Uint8Array} data @param {number} bit @param {number} end @returns {[number, number, number]}
 */
export function readSkip(data, bit, end) {
  let skip = 0;
  for (let word = 15; word === 15; ) {
    if (bit + 4 > end) return [OUT_OF_DATA, skip, end];
    word = readBits(data, bit, 4);
    bit += 4;
    skip += word;
    if (skip > SKIP_MAX) return [SKIP_TOO_LONG, skip, bit - 4];
  }
  return [OK, skip, bit];
}

/** @type {Record<number, string>} */
export const FAULTS = {
  2: "22 zero bits are followed by another 0, where a 1 must be inserted; the stream is damaged here or before",
  3: "the arithmetic segment does not end with bits that close it; the stream is damaged here or before",
  7: "fba_object_mask is 0, expected 1 (FAPs), 2 (BAPs) or 3 (both)",
  [SKIP_TOO_LONG]: `number_of_frames_to_skip exceeds ${SKIP_MAX}`,
};

/**
 * Look for alignment and a start code at a bit; return [last byte of the code, bit behind it].
 *
 * The alignment is a 0 and then 1s up to the byte boundary (a whole byte where already aligned), or zeros; behind a
 * start code (afterCode) there is none. NO_START_CODE: a plane begins here. UNDECIDED: the data may end inside a code.
 * @param {Uint8Array} data @param {number} bit @param {number} end @param {boolean} afterCode @returns {[number, number]}
 */
export function findStartCode(data, bit, end, afterCode) {
  const here = bit & 7;
  let aligned = bit;
  if (here === 0) {
    if (bit + 8 > end) return [UNDECIDED, bit];
    if (data[bit >> 3] === 0x7f && !afterCode) aligned += 8;
  } else {
    aligned += 8 - here;
    if (aligned > end) return [UNDECIDED, bit];
    const rest = data[bit >> 3] & (255 >> here);
    if (rest !== 0 && rest !== (255 >> here) >> 1) return [NO_START_CODE, bit];
  }
  for (let position = 0; position < 4; position += 1) {
    if (aligned + 8 * position + 8 > end) return [UNDECIDED, bit];
    const value = data[(aligned >> 3) + position];
    if (position === 3) return [value, aligned + 32];
    if (value !== (position === 2 ? 1 : 0)) break;
  }
  return [NO_START_CODE, bit];
}

/** Read the header of an I plane behind is_intra. @param {BitReader} reader @returns {Header} */
export function readIntraHeader(reader) {
  const mask = reader.read(2);
  if (!mask) throw new Fault(FAULTS[7], reader.bit - 2);
  let rate = null;
  if (reader.read(1)) {
    rate = Fraction.of(16 * reader.read(8) + reader.read(4), 16);
    if (reader.read(1)) rate = rate.times(Fraction.of(1000, 1001));
    if (!rate.numerator) throw new Fault("the frame rate is 0", reader.bit - 13);
  }
  const timeCode = reader.read(1)
    ? { hours: reader.read(5), minutes: reader.read(6), marker: reader.read(1), seconds: reader.read(6) }
    : null;
  let skip = 0;
  if (reader.read(1)) {
    let status;
    [status, skip, reader.bit] = readSkip(reader.data, reader.bit, reader.end);
    if (status === OUT_OF_DATA) throw new OutOfData();
    if (status !== OK) throw new Fault(FAULTS[status], reader.bit);
  }
  return { mask, rate, timeCode, skip };
}

/** Read the header of the FAPs or the BAPs of an I plane. @param {BitReader} reader @param {number} part @returns {Part} */
export function readPart(reader, part) {
  const { columns, members, stops } = GROUPS[part];
  const name = part === FACE ? "fap" : "bap";
  const marker = (/** @type {string} */ where, /** @type {number} */ bit) =>
    new Fault(`marker bit ${where} is 0, expected 1`, bit);
  const quant = reader.read(5);
  /** @type {number[]} */
  const types = [];
  const mask = new Uint8Array(columns);
  stops.forEach((stop, group) => {
    if (reader.bit + 3 > reader.end) throw new OutOfData();
    if (!reader.read(1)) throw marker(`before ${name}_mask_type of group ${group + 1}`, reader.bit - 1);
    const type = reader.read(2);
    if (type === 2 && part !== FACE) {
      const finding = `bap_mask_type of group ${group + 1} is 2 (interpolate), which exists for FAPs only`;
      throw new Fault(finding, reader.bit - 2);
    }
    types.push(type);
    for (let member = group ? stops[group - 1] : 0; member < stop; member += 1) {
      mask[members[member]] = type === 1 || type === 2 ? reader.read(1) : Number(type === 3);
    }
  });
  if (reader.bit + 2 > reader.end) throw new OutOfData();
  const gender = reader.read(1);
  if (reader.read(1) === DCT) {
    throw new Fault(
      `${name.toUpperCase()}s are coded as DCT segments (object_coding_type 1), whose code tables are in no public source`,
      reader.bit - 1,
      true,
    );
  }
  const sent = reader.read(4);
  const ranges = LISTS.map((list, number) => {
    if (!(sent & (8 >> number))) return null;
    const codes = new Uint8Array(columns);
    for (let group = part === FACE ? 1 : 0; group < stops.length; group += 1) { // FAP 1 and 2 have no ranges
      const first = group ? stops[group - 1] : 0;
      for (let member = first; member < stops[group]; member += 1) {
        if ((member - first) % MARKER_EVERY === 0 && !reader.read(1)) {
          throw marker(`in the ${list} range list`, reader.bit - 1);
        }
        if (mask[members[member]]) codes[members[member]] = reader.read(5);
      }
    }
    return codes;
  });
  return { quant, types, mask, gender, ranges };
}
