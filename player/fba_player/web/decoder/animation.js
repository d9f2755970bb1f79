/** Decodes streams: whole ones with `decode`, those that arrive in pieces with `Decoder`. */
import { SLOTS } from "./coder.js";
import { FbaError } from "./errors.js";
import { findMarks } from "./marks.js";
import { BAPS, BODY, FACE, FAPS, FIRST_BAP, FIRST_FAP, FLAGS, GROUPS } from "./slots.js";
import { NO_END, StreamReader, checkMemory } from "./stream.js";
import { BAP_STEPS } from "./tables.js";
import { TimeBase } from "./timebase.js";

/** @typedef {import("./stream.js").Block} Block */

/**
 * bapSteps: the stream's table of BAP steps; by default that which its mark names, "iso" without a mark. salvage: go on
 * behind damage, which `damage` lists. mostFrames, mostBytes: limits of what a stream may become, the latter besides 20
 * bytes for each byte of the stream.
 * @typedef {{bapSteps?: import("./slots.js").BapSteps, salvage?: boolean, mostFrames?: number, mostBytes?: number}} Options
 *
 * The FAPs of a frame. values: FAPs 3 to 68 at 2 to 67, in the standard's units. mask: which of the 68 are sent.
 * interpolated: which unsent ones a face is to interpolate (mask type 2). viseme: select1, select2, blend, viseme_def.
 * expression: select1, intensity1, select2, intensity2, init_face, expression_def.
 * @typedef {{values: Int32Array, mask: Uint8Array, interpolated: Uint8Array, viseme: number[], expression: number[]}} FaceFrame
 *
 * The BAPs of a frame: values and mask of BAPs 1 to 296.
 * @typedef {{values: Int32Array, mask: Uint8Array}} BodyFrame
 *
 * A frame, shown at `time` seconds, which is index / rate. face, body: null where the plane carries none.
 * @typedef {{index: number, time: number, face: FaceFrame | null, body: BodyFrame | null}} Frame
 *
 * plane: number of the frame's plane in the stream. bit, bits: its place and length. intra: whether it is an I plane.
 * doubtful: its values may be wrong, as ranges may have been replaced in a lost plane. rate: frames per second here.
 * @typedef {Frame & {plane: number, bit: number, bits: number, intra: boolean, doubtful: boolean, rate: number}} StreamFrame
 */

const MOST_FRAMES = 6_000_000;
const MOST_BYTES = 100_000_000;
const PIECE = 1 << 16; // bytes that are read at once, so that few blocks are in memory
const FRAME_BYTES = 16;
const MASKS_BYTES = 1000;

/** @param {Options} options */
function checked({ bapSteps, salvage = false, mostFrames = MOST_FRAMES, mostBytes = MOST_BYTES }) {
  if (bapSteps !== undefined && !Object.hasOwn(BAP_STEPS, bapSteps)) {
    throw new FbaError("option", `bapSteps is ${JSON.stringify(bapSteps)}, expected "iso" or "visage"`);
  }
  return { bapSteps: bapSteps ?? null, salvage, mostFrames, mostBytes };
}

/** @param {Uint8Array | ArrayBuffer} data */
function bytesOf(data) {
  if (data instanceof Uint8Array) return data;
  if (data instanceof ArrayBuffer) return new Uint8Array(data);
  throw new FbaError("option", "expected the bytes of a stream, as a Uint8Array or an ArrayBuffer");
}

/**
 * Return the animation of a complete stream. Throws FbaError for damage (unless salvaging), for streams without a plane,
 * for DCT segments, whose tables are in no public source, and beyond the limits.
 * @param {Uint8Array | ArrayBuffer} data
 * @param {Options} [options]
 */
export function decode(data, options = {}) {
  const bytes = bytesOf(data);
  const { bapSteps, salvage, mostFrames, mostBytes } = checked(options);
  const reader = new StreamReader(bapSteps, salvage, mostBytes, bapSteps ? [] : findMarks(bytes));
  reader.times.mayStepBack = true;
  const buffer = new CompactBuffer(mostFrames, mostBytes, bytes.length);
  for (let start = 0; start <= bytes.length; start += PIECE) {
    const piece = bytes.subarray(start, start + PIECE);
    for (const block of piece.length ? reader.push(piece) : []) buffer.add(block);
    if (reader.error) throw reader.error;
  }
  for (const block of reader.finish()) buffer.add(block);
  if (reader.error) throw reader.error;
  if (!buffer.count) {
    const cause = reader.damage[0]?.error;
    throw new FbaError("damage", "the stream holds no plane that can be decoded", { plane: 0, remedy: cause?.message });
  }
  const unended = !salvage && reader.objects.endCode === null;
  const warnings = unended ? [...reader.warnings, `plane ${reader.planes - 1}: ${NO_END}`] : reader.warnings;
  return new Animation(buffer, reader, warnings);
}

/** Decodes a stream that arrives in pieces of any size, down to a byte. */
export class Decoder {
  /** @param {Options} [options] without bapSteps, a mark before the object names the table, "iso" without one */
  constructor(options = {}) {
    const { bapSteps, salvage, mostBytes } = checked(options);
    this._reader = new StreamReader(bapSteps, salvage, mostBytes);
    this._finished = false;
  }

  /** Damage so far, when salvaging. */
  get damage() {
    return this._reader.damage;
  }

  /** What is odd in the stream so far. */
  get warnings() {
    return this._reader.warnings;
  }

  /** The table of BAP steps that a mark names, or null. */
  get mark() {
    return this._reader.objects.mark;
  }

  /** Whether an end code closed the last object. */
  get ended() {
    return this._reader.objects.ended;
  }

  /**
   * Add bytes; return the frames that they complete. At damage, the frames before it are returned, and the next call
   * throws the error.
   * @param {Uint8Array | ArrayBuffer} data
   * @returns {StreamFrame[]}
   */
  push(data) {
    const bytes = bytesOf(data);
    if (this._finished) throw new FbaError("option", "this decoder is finished; make a new one for another stream");
    if (this._reader.error) throw this._reader.error;
    const frames = this._reader.push(bytes).flatMap(framesOf);
    if (!frames.length && this._reader.error) throw /** @type {FbaError} */ (this._reader.error);
    return frames;
  }

  /** End the stream; return the last frames. Throws where the stream ends inside a plane. @returns {StreamFrame[]} */
  finish() {
    if (this._reader.error) throw this._reader.error;
    if (this._finished) return [];
    this._finished = true;
    const frames = this._reader.finish().flatMap(framesOf);
    if (this._reader.error) throw /** @type {FbaError} */ (this._reader.error);
    return frames;
  }
}

/** @param {Block} block @returns {StreamFrame[]} */
function framesOf(block) {
  const masks = masksOf(block, FACE | BODY);
  const places = new Int16Array(SLOTS).fill(-1);
  block.columns.forEach((slot, place) => (places[slot] = place));
  const rate = block.span.rate.valueOf();
  return Array.from(block.index, (index, at) => {
    const row = block.rows.subarray(at * block.columns.length, (at + 1) * block.columns.length);
    return {
      index,
      time: block.span.time(index).valueOf(),
      ...expand(row, places, block.parts[at], masks),
      plane: block.number + at,
      bit: block.borders[at],
      bits: block.borders[at + 1] - block.borders[at],
      intra: block.intra,
      doubtful: block.doubtful,
      rate,
    };
  });
}

/**
 * Masks of planes that carry these parts.
 * @typedef {{face: Uint8Array | null, interpolated: Uint8Array | null, body: Uint8Array | null}} Masks
 * @param {Block} block @param {number} parts @returns {Masks}
 */
function masksOf(block, parts) {
  const face = parts & FACE ? block.face : null;
  const interpolated = face && new Uint8Array(FAPS);
  face?.types.forEach((type, group) => {
    const { members, stops } = GROUPS[FACE];
    if (type !== 2 || !interpolated) return;
    for (const column of members.subarray(group ? stops[group - 1] : 0, stops[group])) interpolated[column] = 1 - face.mask[column];
  });
  return { face: face?.mask ?? null, interpolated, body: parts & BODY ? (block.body?.mask ?? null) : null };
}

/**
 * Return the face and the body of a frame.
 * @param {Int32Array} row @param {Int16Array} places column of each slot, -1 where it is not sent
 * @param {number} parts @param {Masks} masks
 */
function expand(row, places, parts, masks) {
  const value = (/** @type {number} */ slot) => (places[slot] < 0 ? 0 : row[places[slot]]);
  let [face, body] = [/** @type {FaceFrame | null} */ (null), /** @type {BodyFrame | null} */ (null)];
  if (parts & FACE && masks.face && masks.interpolated) {
    const values = new Int32Array(FAPS);
    for (let fap = 2; fap < FAPS; fap += 1) values[fap] = value(FIRST_FAP - 2 + fap);
    const viseme = [0, 1, 2, FLAGS].map(value);
    const expression = [3, 4, 5, 6, FLAGS + 1, FLAGS + 2].map(value);
    face = { values, mask: masks.face, interpolated: masks.interpolated, viseme, expression };
  }
  if (parts & BODY && masks.body) {
    body = { values: Int32Array.from({ length: BAPS }, (_, bap) => value(FIRST_BAP + bap)), mask: masks.body };
  }
  return { face, body };
}

/** The frames of a whole stream, with columns for the slots that it sends. */
class CompactBuffer {
  /** @param {number} mostFrames @param {number} mostBytes @param {number} source bytes of the stream */
  constructor(mostFrames, mostBytes, source) {
    this._limits = { mostFrames, mostBytes, source };
    this.count = 0;
    this.times = new TimeBase();
    this.places = new Int16Array(SLOTS).fill(-1);
    this.width = 0;
    this.rows = new Int32Array(0);
    /** Masks of the frames, each once. @type {(Masks & {parts: number})[]} */
    this.masks = [];
    /** Which of them a frame has. */
    this.kinds = new Uint32Array(1024);
    /** @type {Map<string, number>} */
    this._numbers = new Map();
  }

  /** @param {Block} block */
  add(block) {
    const count = block.skips.length;
    const total = this.count + count;
    this._makeColumns(block.columns);
    const { mostFrames, mostBytes, source } = this._limits;
    if (total > mostFrames) {
      const finding = `the stream has ${total} frames, more than the ${mostFrames} that mostFrames allows`;
      throw new FbaError("limit", finding, { remedy: "if the stream is to be trusted, raise mostFrames" });
    }
    const memory = total * (4 * this.width + FRAME_BYTES) + this.masks.length * MASKS_BYTES;
    checkMemory(memory, "the decoded stream", mostBytes, source);
    this.times.add(block.index, block.span);
    if (total * this.width > this.rows.length) this.rows = grown(this.rows, total * this.width);
    if (total > this.kinds.length) this.kinds = grown(this.kinds, total);
    const width = block.columns.length;
    const columns = Array.from(block.columns, (slot) => this.places[slot]);
    for (let at = 0; at < count; at += 1) {
      const to = (this.count + at) * this.width;
      for (let column = 0; column < width; column += 1) this.rows[to + columns[column]] = block.rows[at * width + column];
      this.kinds[this.count + at] = at && block.parts[at] === block.parts[at - 1] ? this.kinds[this.count + at - 1] : this._kind(block, block.parts[at]);
    }
    this.count = total;
  }

  /** Make columns for slots that have none yet. @param {Int32Array} slots */
  _makeColumns(slots) {
    const before = this.width;
    for (const slot of slots) if (this.places[slot] < 0) this.places[slot] = this.width++;
    if (this.width === before || !this.count) return;
    const rows = new Int32Array((this.count + 1024) * this.width);
    for (let at = 0; at < this.count; at += 1) {
      rows.set(this.rows.subarray(at * before, (at + 1) * before), at * this.width);
    }
    this.rows = rows;
  }

  /** Return the number of the masks of a plane with these parts. @param {Block} block @param {number} parts */
  _kind(block, parts) {
    const masks = masksOf(block, parts);
    const key = [parts, masks.face, masks.interpolated, masks.body].join(";");
    let kind = this._numbers.get(key);
    if (kind === undefined) {
      kind = this.masks.length;
      this._numbers.set(key, kind);
      this.masks.push({ ...masks, parts });
    }
    return kind;
  }
}

/** @template {Int32Array | Uint32Array} T @param {T} array @param {number} size @returns {T} */
function grown(array, size) {
  const larger = /** @type {T} */ (new /** @type {any} */ (array.constructor)(Math.max(size, 2 * array.length)));
  larger.set(array);
  return larger;
}

/** The decoded frames of a stream. */
export class Animation {
  /** @param {CompactBuffer} buffer @param {StreamReader} reader @param {string[]} warnings */
  constructor(buffer, reader, warnings) {
    this._buffer = buffer;
    /** Frames per second, an exact fraction. */
    this.rate = buffer.times.rate;
    /** What was lost, when salvaging. */
    this.damage = reader.damage;
    this.warnings = warnings;
    /** The table of BAP steps that the stream's mark names, or null. */
    this.mark = reader.objects.mark;
    const index = buffer.times.index();
    this._rows = keptRows(index, reader.wrong);
    /** Number of each frame at `rate`, rising: frames that are skipped have none. */
    this.index = Float64Array.from(this._rows, (row) => index[row]);
    this.hasFace = buffer.masks.some((masks) => masks.face);
    this.hasBody = buffer.masks.some((masks) => masks.body);
  }

  /** Number of frames. */
  get length() {
    return this.index.length;
  }

  /** Return the seconds at which a frame is shown. @param {number} at */
  time(at) {
    return (this.index[at] * Number(this.rate.denominator)) / Number(this.rate.numerator);
  }

  /** Return a frame. @param {number} at from 0 @returns {Frame} */
  frame(at) {
    if (!(at >= 0 && at < this.length)) throw new RangeError(`frame ${at} of ${this.length}`);
    const { rows, width, places, kinds, masks } = this._buffer;
    const row = this._rows[at];
    const kind = masks[kinds[row]];
    const values = rows.subarray(row * width, (row + 1) * width);
    return { index: this.index[at], time: this.time(at), ...expand(values, places, kind.parts, kind) };
  }
}

/**
 * Return the frames that are kept: frames before damage whose index those behind it repeat were misread, and those of I
 * periods that do not match their checks are left out unless they are all.
 * @param {Float64Array} index @param {[number, number][]} wrong
 */
function keptRows(index, wrong) {
  const kept = new Uint8Array(index.length);
  for (let at = index.length - 1, later = Infinity; at >= 0; at -= 1) {
    kept[at] = Number(index[at] < later);
    later = Math.min(later, index[at]);
  }
  const right = kept.slice();
  for (const [first, stop] of wrong) right.fill(0, first, stop);
  const chosen = right.some((one) => one) ? right : kept;
  return Uint32Array.from({ length: index.length }, (_, at) => at).filter((at) => chosen[at]);
}
