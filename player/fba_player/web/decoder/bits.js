/** Bits of a stream: fields, start codes. */

/** Thrown where the data end inside an element; never reaches a caller of the decoder. */
export const OUT_OF_DATA = Symbol();

/** Thrown for damage at a bit of the data; an FbaError at a plane is made of it. */
export class Fault {
  /** @param {string} finding @param {number} bit @param {"damage" | "unsupported"} [kind] */
  constructor(finding, bit, kind = "damage") {
    this._finding = finding;
    this._bit = bit;
    this._kind = kind;
  }
}

export const OBJECT_CODES = [0xba, 0x01]; // the standard's, and that of old tools
export const PLANE_CODES = [0xbb, 0x03];
export const SEQUENCE = 0xb0;
export const END = 0xb1;
export const USER_DATA = 0xb2;
export const LAYER_CODES = [SEQUENCE, 0xb5]; // of a visual object sequence and a visual object: they, too, end an object

/** @param {number} code */
export const hex = (code) => code.toString(16).padStart(2, "0");

/** Data up to an end, and the next bit. */
export class Bits {
  /** @param {Uint8Array} data @param {number} bit @param {number} end */
  constructor(data, bit, end) {
    this._data = data;
    this._bit = bit;
    this._end = end;
  }

  /** @param {number} count up to 31 */
  _read(count) {
    const stop = this._bit + count;
    if (stop > this._end) throw OUT_OF_DATA;
    let value = 0;
    for (; this._bit < stop; this._bit += 1) {
      value = 2 * value + ((this._data[this._bit >> 3] >> (7 - (this._bit & 7))) & 1);
    }
    return value;
  }

  /**
   * Take alignment and a start code, and return its last byte; undefined where a plane begins instead. Throws
   * OUT_OF_DATA where the data may end inside a code.
   *
   * The alignment is a 0 and then 1s up to the byte boundary (a whole byte where already aligned), or zeros; behind a
   * start code there is none.
   * @param {boolean} afterCode
   */
  _takeStartCode(afterCode) {
    const here = this._bit & 7;
    let byte = Math.ceil(this._bit / 8);
    const size = this._end >> 3;
    if (byte + Number(!here) > size) throw OUT_OF_DATA;
    const rest = this._data[this._bit >> 3] & (255 >> here);
    if (!here) byte += Number(rest === 0x7f && !afterCode);
    else if (rest !== 0 && rest !== (255 >> here) >> 1) return undefined;
    for (const expected of [0, 0, 1]) {
      if (byte >= size) throw OUT_OF_DATA;
      if (this._data[byte++] !== expected) return undefined;
    }
    if (byte >= size) throw OUT_OF_DATA;
    this._bit = 8 * byte + 8;
    return this._data[byte];
  }
}

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
