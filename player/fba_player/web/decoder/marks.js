/**
 * Marks: user data behind the end code, or before the object, that name the table of BAP steps and list the CRC-32 of
 * each I period: 00 00 01 b2 "fba bap_steps=visage;crc32=2;" and the checks, four bytes each.
 */
import { END, OBJECT_CODES, USER_DATA, findCode } from "./bits.js";
import { BAP_STEPS } from "./tables.js";

/** @typedef {import("./parameters.js").BapSteps} BapSteps */

const NAME = "fba ";
const FIELD = /(bap_steps|crc32)=([^;=\0]{1,24});/sy;
const MOST_MARK_BYTES = 64; // within which the words of a mark are complete
const MOST_PERIODS = 1 << 18; // that are checked: three days with an I plane every second

/**
 * Read the words of a mark. table: null where they name none that exists. end: byte behind them. count: of checks, null
 * without them.
 * @param {Uint8Array} content behind the start code
 */
function readWords(content) {
  const text = String.fromCharCode(...content.subarray(0, MOST_MARK_BYTES));
  let [named, end] = ["", 0];
  /** @type {number | null} */
  let count = null;
  FIELD.lastIndex = NAME.length;
  for (let field; text.startsWith(NAME) && (field = FIELD.exec(text)); ) {
    end = FIELD.lastIndex;
    if (field[1] === "crc32") {
      if (/^\d{1,9}$/.test(field[2])) count = Number(field[2]);
      break;
    }
    named ||= field[2];
  }
  const table = Object.hasOwn(BAP_STEPS, named) ? /** @type {BapSteps} */ (named) : null;
  return { text, named, table, end, count };
}

/** Return how many bytes behind its start code a mark needs. @param {Uint8Array} content its beginning @param {number} most I periods */
export function bytesNeeded(content, most) {
  const { end, count } = readWords(content);
  if (count === null) return MOST_MARK_BYTES;
  return count <= most ? end + 4 * (count + 1) : end;
}

/**
 * Return the mark in user data; null where they are none. checks: null without any that can be relied on.
 * @param {Uint8Array} content behind the start code
 * @returns {{table: BapSteps | null, checks: Uint32Array | null, problems: string[]} | null}
 */
export function readMark(content) {
  const { text, named, table, end, count } = readWords(content);
  const head = text.split(/\0\0\x01/)[0];
  if (!NAME.startsWith(head.slice(0, NAME.length)) && !/fba |bap_steps=|crc32=/.test(head)) return null;
  const problems = [];
  let checks = null;
  if (named && !table) problems.push(`the mark names unknown BAP steps, ${named}`);
  if (count !== null) {
    const stop = end + 4 * count;
    if (content.length < stop + 4) {
      problems.push(`the mark is cut off: not all ${count} checks are there`);
    } else if (bigEndian(content, stop) !== writtenCheck(crc32(content.subarray(0, stop)))) {
      problems.push("the mark does not match its CRC-32: checks not used");
    } else checks = Uint32Array.from({ length: count }, (_, place) => bigEndian(content, end + 4 * place));
  } else if (!end || end < head.length) problems.push("the mark is cut off or damaged");
  return { table, checks, problems };
}

/**
 * Return the marks behind the objects of a complete stream: table, first byte of its object, byte behind the words.
 * @param {Uint8Array} data
 */
export function findMarks(data) {
  const marks = [];
  let begin = 0;
  for (let at = findCode(data, 0, data.length); at >= 0; at = findCode(data, at + 1, data.length)) {
    if (OBJECT_CODES.includes(data[at + 3])) begin = at;
    if (data[at + 3] !== END || findCode(data, at + 4, at + 8) !== at + 4 || data[at + 7] !== USER_DATA) continue;
    const { table, end } = readWords(data.subarray(at + 8));
    if (!table) continue;
    marks.push({ table, begin, end: at + 8 + end });
    begin = at + 8 + end;
  }
  return marks;
}

const CRC_TABLE = Uint32Array.from({ length: 256 }, (_, crc) => {
  for (let bit = 0; bit < 8; bit += 1) crc = crc & 1 ? (crc >>> 1) ^ 0xedb88320 : crc >>> 1;
  return crc;
});

/** @param {Uint8Array} bytes @param {number} [before] CRC-32 of what stands before them */
function crc32(bytes, before = 0) {
  let crc = ~before;
  for (let at = 0; at < bytes.length; at += 1) crc = CRC_TABLE[(crc ^ bytes[at]) & 255] ^ (crc >>> 8);
  return ~crc;
}

/** @param {ArrayLike<number>} bytes @param {number} at */
const bigEndian = (bytes, at) => ((bytes[at] << 24) | (bytes[at + 1] << 16) | (bytes[at + 2] << 8) | bytes[at + 3]) >>> 0;

/** Return a CRC-32 as it is written: with ff for 00, so that no start code appears. @param {number} crc */
const writtenCheck = (crc) => bigEndian([24, 16, 8, 0].map((shift) => (crc >>> shift) & 255 || 255), 0);

/**
 * Computes the checks of an object's I periods while its bytes come: an I plane with the planes up to the next one,
 * from its start code, or the byte in which it begins, to the byte before the next period. The first begins with the
 * object's start code.
 */
export class PeriodChecks {
  /** @param {number} [byte] of the stream, at which the object begins */
  constructor(byte = 0) {
    /** Of the periods that have ended: check, first byte, first plane and plane behind the last. @type {[number, number, number, number][]} */
    this._periods = [];
    /** Whether a period was abandoned. */
    this._leftOut = false;
    this._crc = 0;
    this._start = byte;
    this._next = byte; // first byte that is not in the CRC
    this._plane = 0;
    this._open = false; // whether a period has begun
    this._fresh = true; // whether the first period begins where the object does
  }

  get _full() {
    return this._periods.length >= MOST_PERIODS;
  }

  /** Take the bytes up to `stop`. @param {Uint8Array} data from the byte `offset` of the stream @param {number} offset @param {number} stop */
  _add(data, offset, stop) {
    if (stop <= this._next || !(this._open || this._fresh)) return;
    this._crc = crc32(data.subarray(this._next - offset, stop - offset), this._crc);
    this._next = stop;
  }

  /** Begin the next period. @param {Uint8Array} data @param {number} offset @param {number} bit @param {number} plane */
  _begin(data, offset, bit, plane) {
    this._end(data, offset, Math.ceil(bit / 8), plane);
    if (!this._fresh) {
      this._crc = 0;
      this._start = this._next = Math.floor(bit / 8);
    }
    this._plane = plane;
    this._open = true;
    this._fresh = false;
  }

  /** End the last period before a byte and a plane. @param {Uint8Array} data @param {number} offset @param {number} stop @param {number} plane */
  _end(data, offset, stop, plane) {
    if (this._open && !this._full) {
      this._add(data, offset, stop);
      this._periods.push([writtenCheck(this._crc), this._start, this._plane, plane]);
    }
    this._open = false;
  }

  /** Leave out the period that has begun: damage in it was noticed. */
  _abandon() {
    this._open = this._fresh = false;
    this._leftOut = true;
  }

  /** Return the periods whose checks are not in a list, in its order. @param {Uint32Array} listed */
  _wrong(listed) {
    /** Places in the list that each check has, the first one last. @type {Map<number, number[]>} */
    const places = new Map();
    for (let place = listed.length - 1; place >= 0; place -= 1) {
      if (!places.get(listed[place])?.push(place)) places.set(listed[place], [place]);
    }
    let following = 0;
    return this._periods.filter(([check]) => {
      const same = places.get(check) ?? [];
      let place;
      do place = same.pop();
      while (place !== undefined && place < following);
      if (place === undefined) return true;
      following = place + 1;
      return false;
    });
  }
}
