/**
 * Marks: user data behind the end code, or before the object, that name the table of BAP steps and list the CRC-32 of
 * each I period: 00 00 01 b2 "fba bap_steps=visage;crc32=2;" and the checks, four bytes each.
 */
import { BAP_STEPS } from "./tables.js";

/** @typedef {import("./slots.js").BapSteps} BapSteps */

export const USER_DATA = 0xb2;
export const SEQUENCE = 0xb0;
export const END = 0xb1;
export const OBJECT_CODES = [0xba, 0x01]; // the standard's, and that of old tools
export const PLANE_CODES = [0xbb, 0x03];
export const LAYER_CODES = [0xb0, 0xb5]; // of a visual object sequence and a visual object: they, too, end an object
const NAME = "fba ";
const FIELD = /(bap_steps|crc32)=([^;=\0]{1,24});/sy;
const SIMILAR = /fba |bap_steps=|crc32=/;
const MOST_MARK_BYTES = 64; // within which the words of a mark are complete
const MOST_PERIODS = 1 << 18; // that are checked: three days with an I plane every second

/** Return the byte at which a start code 00 00 01 xx begins, or -1. @param {Uint8Array} data @param {number} from @param {number} stop */
export function findCode(data, from, stop) {
  for (let at = Math.max(from, 0); at + 3 < stop; ) {
    const third = data[at + 2];
    if (third > 1) at += 3;
    else if (third === 1 && !data[at] && !data[at + 1]) return at;
    else at += 1;
  }
  return -1;
}

/** @param {Uint8Array} bytes */
const latin = (bytes) => String.fromCharCode(...bytes);

/**
 * Return the table that the words of a mark name, the byte behind them, and how many checks they count.
 * @param {string} text @returns {[string | null, number, number | null]}
 */
function words(text) {
  /** @type {string | null} */
  let table = null;
  let end = 0;
  if (!text.startsWith(NAME)) return [null, 0, null];
  FIELD.lastIndex = NAME.length;
  for (let field; (field = FIELD.exec(text)); ) {
    end = FIELD.lastIndex;
    if (field[1] === "bap_steps") table ??= field[2];
    else return [table, end, /^\d{1,9}$/.test(field[2]) ? Number(field[2]) : null];
  }
  return [table, end, null];
}

/** Return how many bytes behind its start code a mark needs. @param {Uint8Array} content its beginning @param {number} most I periods */
export function bytesNeeded(content, most) {
  const [, end, count] = words(latin(content.subarray(0, MOST_MARK_BYTES)));
  if (count === null) return MOST_MARK_BYTES;
  return count <= most ? end + 4 * (count + 1) : end;
}

/**
 * Return the mark in user data; null where they are none. checks: null without any that can be relied on.
 * @param {Uint8Array} content behind the start code
 * @returns {{table: BapSteps | null, checks: Uint32Array | null, problems: string[]} | null}
 */
export function readMark(content) {
  const text = latin(content.subarray(0, MOST_MARK_BYTES));
  const head = text.split("\0\0\x01")[0];
  if (!NAME.startsWith(head.slice(0, NAME.length)) && !SIMILAR.test(head)) return null;
  const [named, end, count] = words(text);
  const problems = [];
  let checks = null;
  if (named !== null && !(named in BAP_STEPS)) {
    problems.push(`the stream says that it was made with the BAP steps ${named}, which are not known here`);
  }
  if (count !== null) {
    const stop = end + 4 * count;
    if (content.length < stop + 4) {
      problems.push(`the list of ${count} checks behind the end was cut off; the stream cannot be checked`);
    } else if (bigEndian(content, stop) !== writtenCheck(crc32(content.subarray(0, stop)))) {
      problems.push("the mark behind the end does not match its own CRC-32; the stream cannot be checked");
    } else checks = Uint32Array.from({ length: count }, (_, number) => bigEndian(content, end + 4 * number));
  } else if (!end || end < head.length) problems.push("a mark of the stream was cut off or is damaged");
  const table = named !== null && named in BAP_STEPS ? /** @type {BapSteps} */ (named) : null;
  return { table, checks, problems };
}

/**
 * Return the marks behind the objects of a complete stream: table, first byte of its object, byte behind the words.
 * @param {Uint8Array} data
 */
export function findMarks(data) {
  const marks = [];
  let begin = 0;
  let object = -1;
  for (let at = findCode(data, 0, data.length); at >= 0; at = findCode(data, at + 1, data.length)) {
    if (OBJECT_CODES.includes(data[at + 3])) object = at;
    if (data[at + 3] !== END || findCode(data, at + 4, at + 8) !== at + 4 || data[at + 7] !== USER_DATA) continue;
    const [named, end] = words(latin(data.subarray(at + 8, at + 8 + MOST_MARK_BYTES)));
    if (named === null || !(named in BAP_STEPS)) continue;
    const table = /** @type {BapSteps} */ (named);
    marks.push({ table, begin: Math.max(object, begin), end: at + 8 + end });
    begin = at + 8 + end;
  }
  return marks;
}

const CRC_TABLE = Uint32Array.from({ length: 256 }, (_, byte) => {
  let crc = byte;
  for (let bit = 0; bit < 8; bit += 1) crc = crc & 1 ? (crc >>> 1) ^ 0xedb88320 : crc >>> 1;
  return crc;
});

/** @param {Uint8Array} bytes @param {number} [before] CRC-32 of what stands before them */
function crc32(bytes, before = 0) {
  let crc = ~before;
  for (let at = 0; at < bytes.length; at += 1) crc = CRC_TABLE[(crc ^ bytes[at]) & 255] ^ (crc >>> 8);
  return ~crc >>> 0;
}

/** @param {Uint8Array} bytes @param {number} at */
const bigEndian = (bytes, at) => new DataView(bytes.buffer, bytes.byteOffset + at, 4).getUint32(0);

/** Return a CRC-32 as it is written: with ff for 00, so that no start code appears. @param {number} crc */
function writtenCheck(crc) {
  let written = 0;
  for (let shift = 0; shift < 32; shift += 8) written += (((crc >>> shift) & 255) || 255) * 2 ** shift;
  return written;
}

/**
 * Computes the checks of an object's I periods while its bytes come: an I plane with the planes up to the next one,
 * from its start code, or the byte in which it begins, to the byte before the next period. The first begins with the
 * object's start code.
 */
export class PeriodChecks {
  /** @param {number} [byte] of the stream, at which the object begins */
  constructor(byte = 0) {
    /** Of the periods that have ended: check, first byte, first plane and plane behind the last. @type {[number, number, number, number][]} */
    this.periods = [];
    /** Whether a period was abandoned. */
    this.leftOut = false;
    this._crc = 0;
    this._start = byte;
    this._next = byte; // first byte that is not in the CRC
    this._plane = 0;
    this._open = false; // whether a period has begun
    this._fresh = true; // whether the first period begins where the object does
  }

  get full() {
    return this.periods.length >= MOST_PERIODS;
  }

  /** Take the bytes up to `stop`. @param {Uint8Array} data from the byte `offset` of the stream @param {number} offset @param {number} stop */
  add(data, offset, stop) {
    if (stop <= this._next || !(this._open || this._fresh)) return;
    this._crc = crc32(data.subarray(this._next - offset, stop - offset), this._crc);
    this._next = stop;
  }

  /** Begin the next period. @param {Uint8Array} data @param {number} offset @param {number} bit @param {number} plane */
  beginPeriod(data, offset, bit, plane) {
    this.end(data, offset, Math.ceil(bit / 8), plane);
    if (!this._fresh) {
      this._crc = 0;
      this._start = this._next = Math.floor(bit / 8);
    }
    this._plane = plane;
    this._open = true;
    this._fresh = false;
  }

  /** End the last period before a byte and a plane. @param {Uint8Array} data @param {number} offset @param {number} stop @param {number} plane */
  end(data, offset, stop, plane) {
    if (this._open && !this.full) {
      this.add(data, offset, stop);
      this.periods.push([writtenCheck(this._crc), this._start, this._plane, plane]);
    }
    this._open = false;
  }

  /** Leave out the period that has begun: damage in it was noticed. */
  abandon() {
    this._open = this._fresh = false;
    this.leftOut = true;
  }

  /** Return the periods whose checks are not in a list, in its order. @param {Uint32Array} listed */
  wrong(listed) {
    /** @type {Map<number, {places: number[], next: number}>} */
    const sames = new Map();
    listed.forEach((check, place) => {
      if (!sames.has(check)) sames.set(check, { places: [], next: 0 });
      sames.get(check)?.places.push(place);
    });
    let following = 0;
    return this.periods.filter(([check]) => {
      const same = sames.get(check);
      if (!same) return true;
      while (same.places[same.next] < following) same.next += 1;
      if (same.next === same.places.length) return true;
      following = same.places[same.next] + 1;
      return false;
    });
  }
}
