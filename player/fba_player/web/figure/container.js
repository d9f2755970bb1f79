/** Reads the files of `fba_player.web`: named numbers and arrays. `_container.py` describes them. */
import { FbaError } from "../decoder/errors.js";

/**
 * [type, rows, columns, first byte, coding] of an array.
 * @typedef {[string, number, number, number, string]} Entry
 * @typedef {{array: number, step: number, origin: number[]}} Fractions
 * What gives arrays. @typedef {Pick<Container, "integers" | "fractions" | "indices" | "file">} Arrays
 * @typedef {Uint8Array | Int8Array | Uint16Array | Int16Array | Uint32Array | Int32Array} Integers
 */

const TYPES = { u1: Uint8Array, i1: Int8Array, u2: Uint16Array, i2: Int16Array, u4: Uint32Array, i4: Int32Array };
const MAGIC = 0x57414246; // "FBAW"
const START = 8;
export const MOST_NUMBERS = 64_000_000;

/** @param {string} finding @returns {never} */
export function refuse(finding) {
  throw new FbaError("damage", `the model ${finding}`, undefined, undefined, "make it again with fba export");
}

/** Fail unless a number of a header is finite, and whole and below a limit where one is given. @param {unknown} value @param {string} what @param {number} [limit] @returns {number} */
export function checkedNumber(value, what, limit) {
  const good = typeof value === "number" && Number.isFinite(value) && (limit === undefined || (Number.isInteger(value) && value >= 0 && value < limit));
  return good ? value : refuse(`has ${String(JSON.stringify(value)).slice(0, 60)} as ${what}${limit === undefined ? "" : `, expected 0 to ${limit - 1}`}`);
}

/** Return the column of a FAP. @param {unknown} fap its number, from 1 */
export function checkedFap(fap) {
  return checkedNumber(Number(fap) - 1, "a FAP, less 1,", 68);
}

/** Return numbers of a header, as many as given. @param {unknown} values @param {string} what @param {number} [count] */
export function checkedNumbers(values, what, count) {
  if (!Array.isArray(values) || (count !== undefined && values.length !== count)) return refuse(`lacks the ${count ?? ""} numbers of ${what}`);
  return Float64Array.from(values, (value) => checkedNumber(value, what));
}

/** Return a list of a header. @param {unknown} values @param {string} what @returns {any[]} */
export function checkedList(values, what) {
  return Array.isArray(values) ? values : refuse(`lacks the list of ${what}`);
}

/** A file of named numbers and arrays. Throws FbaError where it is damaged. */
export class Container {
  /** @param {Uint8Array} bytes */
  constructor(bytes) {
    const view = new DataView(bytes.buffer, bytes.byteOffset, bytes.byteLength);
    if (bytes.length < START || view.getUint32(0, true) !== MAGIC) refuse("does not begin with FBAW");
    const stop = START + view.getUint32(4, true);
    if (stop > bytes.length) refuse(`ends at byte ${bytes.length}, inside its header`);
    /** @type {Record<string, any>} */
    this.header = parse(bytes.subarray(START, stop));
    this._bytes = bytes.subarray(stop);
    this._entries = checkedList(this.header.arrays, "arrays");
  }

  /** Return an array of whole numbers, row by row, and its columns. @param {unknown} place @param {string} what @returns {{values: Integers, rows: number, columns: number}} */
  integers(place, what) {
    const { type, rows, columns, bytes, coding } = this._entry(place, what);
    const values = new TYPES[type](rows * columns);
    const width = values.BYTES_PER_ELEMENT;
    if (coding === "rise") checkRise(columns, what);
    for (let column = 0, at = 0, high = 0; column < columns; column += 1, at += width * rows) {
      for (let row = 0, value = 0; row < rows; row += 1) {
        let code = 0;
        for (let plane = width - 1; plane >= 0; plane -= 1) code = (code << 8) | bytes[at + plane * rows + row];
        code >>>= 0;
        if (coding === "rise") {
          value = high - code;
          if (code === 0) high += 1;
          if (value < 0) refuse(`has a corner before the first in ${what}`);
        } else {
          value += code % 2 ? -(code + 1) / 2 : code / 2;
        }
        values[row * columns + column] = value;
      }
    }
    return { values, rows, columns };
  }

  /** Return fractions, row by row. @param {Fractions} reference @param {string} what @param {number} [rows] @param {number} [columns] as many as there must be */
  fractions(reference, what, rows, columns) {
    const found = this.integers(reference?.array, what);
    const origin = checkedNumbers(reference.origin, what, found.columns);
    const step = checkedNumber(reference.step, what);
    checkShape(found, what, rows, columns);
    const { values, columns: width } = found;
    return new Float32Array(values.length).map((_, at) => values[at] * step + origin[at % width]);
  }

  /** Return whole numbers, of which all are below a limit. @param {unknown} place @param {string} what @param {number} limit @param {number} [rows] @param {number} [columns] */
  indices(place, what, limit, rows, columns) {
    const found = this.integers(place, what);
    checkShape(found, what, rows, columns);
    for (const value of found.values) if (value < 0 || value >= limit) refuse(`has ${value} in ${what}, expected 0 to ${limit - 1}`);
    return found.values;
  }

  /** Return the bytes of a file inside. @param {unknown} place @param {string} what */
  file(place, what) {
    const { bytes, rows } = this._entry(place, what);
    return bytes.subarray(0, rows);
  }

  /** @param {unknown} place @param {string} what */
  _entry(place, what) {
    const entry = this._entries[checkedNumber(place, `the place of ${what}`, this._entries.length)];
    if (!Array.isArray(entry) || !Object.hasOwn(TYPES, entry[0])) refuse(`has an unknown kind of array in ${what}`);
    const type = /** @type {keyof typeof TYPES} */ (entry[0]);
    const rows = checkedNumber(entry[1], `the rows of ${what}`, MOST_NUMBERS);
    const columns = checkedNumber(entry[2], `the columns of ${what}`, 65);
    const size = rows * columns * TYPES[type].BYTES_PER_ELEMENT;
    const start = checkedNumber(entry[3], `the start of ${what}`, this._bytes.length + 1);
    if (start + size > this._bytes.length) refuse(`ends inside ${what}`);
    return { type, rows, columns, bytes: this._bytes.subarray(start, start + size), coding: String(entry[4]) };
  }
}

/** The same access to arrays that are there already: whoever made the header put them in it. */
export const MEMORY = /** @type {Arrays} */ ({
  integers: (/** @type {any} */ place) => place,
  fractions: (/** @type {any} */ reference) => reference,
  indices: (/** @type {any} */ place) => place,
  file: (/** @type {any} */ place) => place,
});

/** @param {Uint8Array} bytes */
function parse(bytes) {
  try {
    const header = JSON.parse(new TextDecoder("utf-8", { fatal: true }).decode(bytes));
    if (header && typeof header === "object") return header;
  } catch {
    // as if it held nothing
  }
  return refuse("has a header that is not JSON");
}

/** @param {number} columns @param {string} what */
function checkRise(columns, what) {
  if (columns !== 1) refuse(`has ${columns} columns in ${what}, expected 1`);
}

/** @param {{rows: number, columns: number}} found @param {string} what @param {number} [rows] @param {number} [columns] */
function checkShape(found, what, rows, columns) {
  if ((rows ?? found.rows) === found.rows && (columns ?? found.columns) === found.columns) return;
  refuse(`has ${found.rows} x ${found.columns} numbers in ${what}, expected ${rows ?? "any"} x ${columns ?? "any"}`);
}
