/**
 * Marks: user data behind the end code, or before the object, that name the table of BAP steps and list the CRC-32 of
 * each I period: 00 00 01 b2 "fba bap_steps=visage;crc32=2;" and the checks, four bytes each.
 */
import { END, USER_DATA, codeAt, findCode, isObject } from "./bits.js";
import { STEP_PLACES } from "./tables.js";

/** @typedef {import("./parameters.js").BapSteps} BapSteps */

const WORDS = /^fba (bap_steps=([^;=\0]{1,24});(bap_steps=[^;=\0]{1,24};)*)?(crc32=((\d{1,9})|[^;=\0]{1,24});)?/;
const MOST_MARK_BYTES = 64; // within which the words of a mark are complete

/** Whether a table of BAP steps has this name. @param {string} name @returns {name is BapSteps} */
export const isTable = (name) => Object.hasOwn(STEP_PLACES, name);

/**
 * Read the words of a mark: the table, null where they name none that exists; the byte behind them; the number of checks,
 * NaN without them; the name of the table; all text.
 * @param {Uint8Array} content behind the start code
 * @returns {[BapSteps | null, number, number, string, string]}
 */
function readWords(content) {
  const text = String.fromCharCode(...content.subarray(0, MOST_MARK_BYTES));
  const [words, steps, named = "", , checks, , count = NaN] = WORDS.exec(text) ?? [""];
  const end = steps || checks ? words.length : 0;
  return [isTable(named) ? named : null, end, +count, named, text];
}

/** Return how many bytes behind its start code a mark needs. @param {Uint8Array} content its beginning @param {number} most I periods */
export function bytesNeeded(content, most) {
  const [, end, count] = readWords(content);
  return count <= most ? end + 4 * count + 4 : count > most ? end : MOST_MARK_BYTES;
}

/** Say that a mark names a table of BAP steps in place of another. @param {string} named @param {string} other */
export const otherSteps = (named, other) => `mark: BAP steps ${named}, not ${other}`;

/**
 * Return the mark in user data; null where they are none: the table, and the checks, null without any that can be relied on.
 * @param {Uint8Array} content behind the start code
 * @param {string[]} warnings
 * @returns {[BapSteps | null, string[] | null] | null}
 */
export function readMark(content, warnings) {
  const [table, end, count, named, text] = readWords(content);
  const head = text.split("\0\0\x01")[0];
  if (!"fba ".startsWith(head.slice(0, 4)) && !/fba |bap_steps=|crc32=/.test(head)) return null;
  let checks = null;
  if (named && !table) warnings.push(otherSteps(named, "iso or visage"));
  const check = (/** @type {number} */ place) => content.subarray(end + 4 * place, end + 4 * place + 4).join();
  if (count >= 0 && check(count) === writtenCheck(crc32(content.subarray(0, end + 4 * count)))) {
    checks = Array.from({ length: count }, (_, place) => check(place));
  } else if (count >= 0 || !end || end < head.length) warnings.push("mark: damaged");
  return [table, checks];
}

/**
 * Return the marks behind the objects of a complete stream: table, first byte of its object, byte behind the words.
 * @param {Uint8Array} data
 */
export function findMarks(data) {
  /** @type {[BapSteps, number, number][]} */
  const marks = [];
  let begin = 0;
  for (let at = -1; (at = findCode(data, at + 1)) < data.length; ) {
    const code = data[at + 3];
    if (isObject(code)) begin = at;
    if (code === END && codeAt(data, at + 4) === USER_DATA) {
      const [table, end] = readWords(data.subarray(at + 8));
      if (table) marks.push([table, begin, (begin = at + 8 + end)]);
    }
  }
  return marks;
}

/** @param {Uint8Array} bytes @param {number} [before] CRC-32 of what stands before them */
export function crc32(bytes, before = 0) {
  let crc = ~before;
  for (const byte of bytes) {
    crc ^= byte;
    for (let bit = 8; bit; bit -= 1) crc = (crc >>> 1) ^ (-(crc & 1) & 0xedb88320);
  }
  return ~crc;
}

/** Return the bytes of a CRC-32 as it is written: with ff for 00, so that no start code appears. @param {number} crc */
export const writtenCheck = (crc) => [24, 16, 8, 0].map((shift) => (crc >>> shift) & 255 || 255).join();
