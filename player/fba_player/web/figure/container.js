/** Reads the files of `fba_player.web`: named numbers and arrays. `_container.py` describes them. */
import { FbaError } from "../decoder/errors.js";

/**
 * [type, rows, columns, first byte, coding] of an array.
 * @typedef {[string, number, number, number, string]} Entry
 * @typedef {{array: number, step: number, origin: number[]}} Fractions
 * What gives arrays. @typedef {Pick<Container, "integers" | "fractions" | "indices" | "file">} Arrays
 */

const TYPES = ["u1", "i1", "u2", "i2", "i4"]; // unsigned and signed integers of so many bytes
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
  if (values instanceof Float64Array) return values;
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

  /** Return an array of whole numbers, row by row, and its columns. @param {unknown} place @param {string} what */
  integers(place, what) {
    const { width, signed, rows, columns, bytes, coding } = this._entry(place, what);
    const values = new Int32Array(rows * columns); // one type for all: code that gets several is slow
    const spare = 32 - 8 * width;
    const rises = coding === "rise";
    if (rises && columns !== 1) refuse(`has ${columns} columns in ${what}, expected 1`);
    for (let column = 0, at = 0, high = 0; column < columns; column += 1, at += width * rows) {
      for (let row = 0, to = column, value = 0; row < rows; row += 1, to += columns) {
        let code = bytes[at + row];
        if (width > 1) code |= bytes[at + rows + row] << 8;
        if (width > 2) code |= (bytes[at + 2 * rows + row] << 16) | (bytes[at + 3 * rows + row] << 24);
        if (rises) {
          value = high - code;
          if (code === 0) high += 1;
          if (value < 0 || value > high) refuse(`has a corner before the first in ${what}`);
        } else {
          value = (value + ((code >>> 1) ^ -(code & 1))) << spare;
          value = signed ? value >> spare : value >>> spare;
        }
        values[to] = value;
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
    const result = new Float32Array(values.length);
    for (let column = 0; column < width; column += 1) {
      for (let at = column; at < values.length; at += width) result[at] = values[at] * step + origin[column];
    }
    return result;
  }

  /** Return whole numbers, of which all are below a limit. @param {unknown} place @param {string} what @param {number} limit @param {number} [rows] @param {number} [columns] */
  indices(place, what, limit, rows, columns) {
    const found = this.integers(place, what);
    checkShape(found, what, rows, columns);
    const { values } = found;
    for (let at = 0; at < values.length; at += 1) if (values[at] < 0 || values[at] >= limit) refuse(`has ${values[at]} in ${what}, expected 0 to ${limit - 1}`);
    return values;
  }

  /** Return the bytes of a file inside. @param {unknown} place @param {string} what */
  file(place, what) {
    const { bytes, rows } = this._entry(place, what);
    return bytes.subarray(0, rows);
  }

  /** @param {unknown} place @param {string} what */
  _entry(place, what) {
    const entry = this._entries[checkedNumber(place, `the place of ${what}`, this._entries.length)];
    if (!Array.isArray(entry) || !TYPES.includes(entry[0])) refuse(`has an unknown kind of array in ${what}`);
    const [signed, width] = [entry[0][0] === "i", Number(entry[0][1])];
    const rows = checkedNumber(entry[1], `the rows of ${what}`, MOST_NUMBERS);
    const columns = checkedNumber(entry[2], `the columns of ${what}`, 65);
    const size = rows * columns * width;
    const start = checkedNumber(entry[3], `the start of ${what}`, this._bytes.length + 1);
    if (start + size > this._bytes.length) refuse(`ends inside ${what}`);
    return { width, signed, rows, columns, bytes: this._bytes.subarray(start, start + size), coding: String(entry[4]) };
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

/** @param {{rows: number, columns: number}} found @param {string} what @param {number} [rows] @param {number} [columns] */
function checkShape(found, what, rows, columns) {
  if ((rows ?? found.rows) === found.rows && (columns ?? found.columns) === found.columns) return;
  refuse(`has ${found.rows} x ${found.columns} numbers in ${what}, expected ${rows ?? "any"} x ${columns ?? "any"}`);
}
