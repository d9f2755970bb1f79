/** Bits of a stream: fields, start codes. Places in it are bits and bytes from its start. */

export const OUT_OF_DATA = 0; // thrown where the data end inside an element; never reaches a caller of the decoder

export const SEQUENCE = 0xb0; // start of a visual object sequence
export const END = 0xb1;
export const USER_DATA = 0xb2;
export const OBJECT_ENDS = [END, SEQUENCE, 0xb5]; // headers of other layers, too, end an object

// The start codes of an object and of a plane: the standard's, and those of old tools.
/** @param {number} code */
export const isObject = (code) => code === 0xba || code === 1;
/** @param {number} code */
export const isPlane = (code) => code === 0xbb || code === 3;

/**
 * data: from the byte `first` of a stream up to the last that came. bit: the next one to read, in the stream.
 * @typedef {{_data: Uint8Array, _first: number, _bit: number}} Input
 */

/** Return a bit; 0 behind the end. @param {Uint8Array} data @param {number} bit */
export const bitAt = (data, bit) => (bit < 8 * data.length ? (data[bit >> 3] >> (7 - (bit & 7))) & 1 : 0);

/** @param {Input} input @param {number} count up to 31 */
export function read(input, count) {
  const data = input._data;
  let bit = input._bit - 8 * input._first;
  let value = 0;
  input._bit += count;
  for (; count; count -= 1) value = 2 * value + bitAt(data, bit++);
  if (bit > 8 * data.length) throw OUT_OF_DATA;
  return value;
}

/**
 * Take alignment and a start code, and return its last byte; undefined where a plane begins instead. Throws OUT_OF_DATA
 * where the data may end inside a code.
 *
 * The alignment is a 0 and then 1s up to the byte boundary (a whole byte where already aligned), or zeros; behind a
 * start code there is none.
 * @param {Input} input @param {boolean} afterCode
 */
export function takeStartCode(input, afterCode) {
  const start = input._bit;
  const within = start & 7;
  const rest = read(input, 8 - within);
  if (afterCode || rest !== 127 >> within) {
    if (!within) input._bit = start;
    else if (rest) return undefined;
  }
  for (const expected of [0, 0, 1]) if (read(input, 8) !== expected) return undefined;
  return read(input, 8);
}

/** Return the last byte of a start code 00 00 01 xx; undefined where none stands. @param {Uint8Array} data @param {number} at */
export const codeAt = (data, at) => (data[at] !== 0 || data[at + 1] || data[at + 2] !== 1 ? undefined : data[at + 3]);

/** Return where the next start code begins, or may begin when more data come. @param {Uint8Array} data @param {number} at */
export function findCode(data, at) {
  while (at + 3 < data.length && codeAt(data, at) === undefined) at += 1;
  return at;
}
