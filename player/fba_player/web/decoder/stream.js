/** Reads a stream that arrives in pieces: outside of an object, plane by plane, and past damage. */
import { Bits, END, Fault, LAYER_CODES, OBJECT_CODES, OUT_OF_DATA, PLANE_CODES, USER_DATA, findCode, hex } from "./bits.js";
import { Clock } from "./clock.js";
import { DamageLog } from "./damage.js";
import { FbaError } from "./errors.js";
import { streamFrame } from "./frames.js";
import { PeriodChecks, bytesNeeded } from "./marks.js";
import { ObjectBorders } from "./objects.js";
import { PlaneReader } from "./planes.js";
import { BAP_STEPS } from "./tables.js";

/**
 * A plane in the stream, where it has a number. bit: of the start code before it, if there is one.
 * @typedef {import("./planes.js").Plane & {number: number, index: number, span: import("./clock.js").Span}} StreamPlane
 */

export const NO_END = "no end code 00 00 01 b1: the stream may be cut off behind this plane";
const NO_START = "no object start code 00 00 01 ba";
const SMALLEST = 4096; // bytes of the buffer, and those beyond which an incomplete plane is not tried with every byte
const DAMAGE_BYTES = 1000; // memory of a damage with its error
const PLANE_BYTES = 500; // memory of a plane without its values
const GROWTH = 20; // bytes of memory that each byte of the input may take besides `mostBytes`

/**
 * bapSteps: the stream's table of BAP steps; by default that which its mark names, "iso" without a mark. salvage: go on
 * behind damage, which `damage` lists. mostFrames, mostBytes: limits of what a stream, or a piece pushed, may become, the
 * latter besides 20 bytes for each byte of it.
 * @typedef {{bapSteps?: import("./parameters.js").BapSteps, salvage?: boolean, mostFrames?: number, mostBytes?: number}} Options
 */

/** @param {Uint8Array | ArrayBuffer} data */
export function bytesOf(data) {
  if (data instanceof Uint8Array) return data;
  if (data instanceof ArrayBuffer) return new Uint8Array(data);
  throw new FbaError("option", "expected a Uint8Array or an ArrayBuffer");
}

/** Decodes a stream that arrives in pieces of any size, down to a byte. */
export class Decoder {
  /** @param {Options} [options] without bapSteps, a mark before the object names the table, "iso" without one */
  constructor(options = {}) {
    const { bapSteps, salvage = false, mostFrames = 6e6, mostBytes = 1e8 } = options;
    if (bapSteps !== undefined && !Object.hasOwn(BAP_STEPS, bapSteps)) {
      throw new FbaError("option", `bapSteps is ${JSON.stringify(bapSteps)}, expected "iso" or "visage"`);
    }
    this._salvage = salvage;
    this._limits = { mostFrames, mostBytes };
    this._log = new DamageLog();
    /** Damage so far, when salvaging. */
    this.damage = this._log.damage;
    /** What is odd in the stream so far. @type {string[]} */
    this.warnings = [];
    /** The error that ended the reading. @type {FbaError | null} */
    this._error = null;
    this._finished = false;
    this._planes = 0;
    this._clock = new Clock(salvage ? this._log : null);
    this._objects = new ObjectBorders(bapSteps);
    /** Planes of I periods that do not match their checks: first, and behind the last. @type {[number, number][]} */
    this._wrong = [];
    this._wasAtEnd = false; // whether the bytes behind an end were being read, behind damage
    this._checks = new PeriodChecks();
    this._reader = new PlaneReader();
    this._data = new Uint8Array(SMALLEST);
    this._length = 0; // bytes in the buffer
    this._offset = 0; // bytes that were dropped before them
    this._bit = 0; // next bit to decode, in the buffer
    this._scanned = 0; // byte up to which no start code was found, while looking for one
    this._retryAt = 0; // length of the buffer at which an incomplete plane is tried again
    this._state = this._findObject;
    /** @type {FbaError | null} */
    this._startError = null;
    this._lostFrom = 0;
    /** @type {number | null} */
    this._codeBit = null; // where the start code before the next plane begins, in the stream
  }

  /** The table of BAP steps that a mark names, or null. */
  get mark() {
    return this._objects._mark;
  }

  /** Whether an end code closed the last object. */
  get ended() {
    return this._objects._endCode === END;
  }

  /**
   * Add bytes; return the frames that they complete. At damage, the frames before it are returned, and the next call
   * throws the error.
   * @param {Uint8Array | ArrayBuffer} data
   */
  push(data) {
    const bytes = bytesOf(data);
    if (this._finished) throw new FbaError("option", "this decoder is finished; make a new one");
    this._append(bytes);
    return this._frames(false);
  }

  /** Return the planes of a complete stream. @param {Uint8Array} bytes */
  _readAll(bytes) {
    this._append(bytes);
    const planes = this._advance(false).concat(this._advance(true));
    if (this._error) throw /** @type {FbaError} */ (this._error);
    return planes;
  }

  /** @param {Uint8Array} piece */
  _append(piece) {
    const need = this._length + piece.length;
    if (need > this._data.length) {
      const old = this._data.subarray(0, this._length);
      this._data = new Uint8Array(Math.max(need, 2 * this._data.length));
      this._data.set(old);
    }
    this._data.set(piece, this._length);
    this._length = need;
  }

  /** End the stream; return the last frames. Throws where the stream ends inside a plane. */
  finish() {
    return this._finished && !this._error ? [] : this._frames(true);
  }

  /** Return the frames of the bytes so far. @param {boolean} final @returns {import("./frames.js").StreamFrame[]} */
  _frames(final) {
    if (this._error) throw this._error;
    this._finished = final;
    const frames = this._advance(final).map(streamFrame);
    if (this._error && (final || !frames.length)) throw /** @type {FbaError} */ (this._error);
    return frames;
  }

  /** Return the planes of the bytes so far; an error is in `_error` then. @param {boolean} final whether no more bytes come */
  _advance(final) {
    /** @type {StreamPlane[]} */
    const planes = [];
    const { mostFrames, mostBytes } = this._limits;
    const most = mostBytes + GROWTH * this._length;
    let memory = 0;
    while (!this._error) {
      this._lostFrom = this._bit;
      try {
        const plane = this._state(final);
        if (plane === null) break;
        if (plane) {
          planes.push(plane);
          memory += PLANE_BYTES + plane.row.byteLength;
        }
        const [limit, name] =
          planes.length > mostFrames ? [mostFrames, "mostFrames"]
          : memory + DAMAGE_BYTES * this.damage.length > most + GROWTH * this._offset ? [most, "mostBytes"]
          : [0, ""];
        if (name) {
          const remedy = "raise it if the stream is to be trusted";
          throw new FbaError("limit", `the stream exceeds ${name}, ${limit}`, undefined, undefined, remedy);
        }
      } catch (error) {
        if (!(error instanceof FbaError)) throw error;
        if (this._salvage && error.kind !== "limit") this._skipDamage(error);
        else this._error = error;
      }
    }
    if (!this._error && !final) this._dropBytes();
    return planes;
  }

  /** Drop the bytes that neither the next plane needs, nor a look for start codes behind damage. */
  _dropBytes() {
    const bits = [this._bit, 8 * (this._scanned || Infinity)];
    for (const bit of [this._codeBit, this._log._recent[0]]) bits.push((bit ?? Infinity) - 8 * this._offset);
    const needed = Math.floor(Math.min(...bits) / 8);
    if (needed < SMALLEST || 2 * needed < this._length) return;
    this._checks._add(this._data, this._offset, this._offset + needed);
    const rest = this._data.subarray(needed, this._length);
    this._data = new Uint8Array(Math.max(2 * rest.length, SMALLEST));
    this._data.set(rest);
    this._length = rest.length;
    this._offset += needed;
    this._bit -= 8 * needed;
    this._scanned = Math.max(this._scanned - needed, 0);
    this._retryAt = Math.max(this._retryAt - needed, 0);
  }

  // ---- states: each returns a plane, undefined without one, or null where it needs more bytes

  /** Look for the object start code; headers of other layers may come before it. @param {boolean} final @returns {StreamPlane | null | undefined} */
  _findObject(final) {
    if (this._objects._count === 0 && this._offset + this._scanned === 0 && !this._startError) this._checkStart(final);
    for (;;) {
      const at = findCode(this._data, this._scanned, this._length);
      if (at < 0) {
        this._scanned = Math.max(this._scanned, this._length - 3);
        break;
      }
      const code = this._data[at + 3];
      if (PLANE_CODES.includes(code)) {
        if (this._objects._count || !this._salvage) throw this._outside(at);
        if (at + 4 >= this._length && !final) break; // the first bit of the plane is not here yet
        if (at + 4 < this._length && this._data[at + 4] & 0x80) return this._join(at);
        this._startError ??= this._outside(at);
      }
      const content = this._data.subarray(at + 4, this._length);
      const needed = code === USER_DATA ? bytesNeeded(content, Math.max(this._objects._end - this._objects._begin, 0)) : 0;
      if (needed > content.length && !final) break; // a mark may not be complete
      this.warnings.push(...this._objects._takeCode(code, this._offset + at, content.subarray(0, needed)));
      this._scanned = at + 4;
      this._compareChecks();
      if (OBJECT_CODES.includes(code)) {
        if (this._startError && this._objects._count === 0) this._log._add(this._startError, 0, this._offset + at);
        this._beginObject(this._offset + at);
        return this._goOn(at + 4);
      }
    }
    if (!final) this._bit = Math.max(this._bit, 8 * this._scanned);
    else if (this._objects._count === 0) {
      throw new FbaError("damage", NO_START, 0, 0);
    } else {
      const rest = this._objects._inUserData ? 0 : this._offset + this._length - this._objects._end;
      if (rest > 0) this.warnings.push(`${rest} bytes behind the end: not read`);
    }
    return null;
  }

  /** Say that a stream does not begin with a start code: an error, or later a damage. @param {boolean} final */
  _checkStart(final) {
    const head = this._data.subarray(0, Math.min(this._length, 4));
    const begins = [0, 0, 1].every((byte, place) => place >= head.length || head[place] === byte);
    if (begins && !(final && head.length < 4)) return;
    const found = [...head].map(hex).join(" ") || "nothing";
    this._startError = new FbaError("damage", `${NO_START}: the stream begins with ${found}`, 0, 0);
    if (!this._salvage) throw this._startError;
  }

  /** Compare the I periods of an object with the checks behind it, if any. */
  _compareChecks() {
    const listed = this._objects._checks;
    this._objects._checks = null;
    if (!listed) return;
    const checks = this._checks;
    const wrong = checks._wrong(listed);
    for (const [, start, first, stop] of wrong) {
      const finding = `planes ${first} to ${stop - 1} do not match their CRC-32`;
      this._reportWrong(finding, [first, stop], start);
    }
    const missing = listed.length - checks._periods.length;
    if (missing > 0 && !(checks._full || checks._leftOut || wrong.length)) {
      const finding = `${missing} of ${listed.length} I periods are missing`;
      this._reportWrong(finding, [this._planes, this._planes], this._objects._begin);
    }
    this.damage.sort((one, other) => one.start - other.start);
    this._checks = new PeriodChecks();
  }

  /** @param {string} finding @param {[number, number]} planes @param {number} byte */
  _reportWrong(finding, planes, byte) {
    const error = new FbaError("damage", finding, planes[0], 8 * byte);
    if (!this._salvage) throw error;
    this._log._add(error, byte, byte, null, ...planes);
    if (planes[0] < planes[1]) this._wrong.push(planes);
  }

  /** Begin at an I plane of an object whose start is missing. @param {number} at byte of its start code @returns {undefined} */
  _join(at) {
    this._startError ??= new FbaError("damage", NO_START, 0, 0);
    this._beginObject(this._offset + at);
    this._reader._forgetValues();
    this._checks._abandon();
    this._log._add(this._startError, 0, this._offset + at);
    this._goOn(at);
  }

  /** Decode planes from a byte in the buffer on. @param {number} byte @returns {undefined} */
  _goOn(byte) {
    this._bit = 8 * byte;
    this._scanned = 0;
    this._state = this._decodePlanes;
  }

  /** Decode the next planes, or the next start code. @param {boolean} final @returns {StreamPlane | null | undefined} */
  _decodePlanes(final) {
    if (this._length < this._retryAt && !final) return null;
    const bits = new Bits(this._data, this._bit, 8 * this._length);
    const position = (/** @type {number} */ bit) => bit + 8 * this._offset; // in the stream
    let inPlane = false;
    try {
      const code = bits._takeStartCode(this._codeBit !== null);
      if (code !== undefined) {
        this._takeCode(code, bits._bit);
        return undefined;
      }
      inPlane = true;
      return this._place(this._reader._read(bits));
    } catch (error) {
      if (error instanceof Fault) throw new FbaError(error._kind, error._finding, this._planes, position(error._bit));
      if (error !== OUT_OF_DATA) throw error;
    }
    if (inPlane && final) {
      this._log._confirmPlanes(); // a cut leaves the planes before it alone
      throw new FbaError("damage", "the stream ends inside this plane", this._planes, position(bits._end));
    }
    if (final) {
      if (this._planes && this._salvage) this._reportMissingEnd();
      this._bit = bits._end;
      this._objects._end = this._offset + this._length;
      this._state = this._findObject;
    } else if (inPlane) { // with a long one, do not try again with every byte
      const waiting = this._length - (this._bit >> 3);
      this._retryAt = this._length + (waiting > SMALLEST ? waiting >> 2 : 1);
    }
    return null;
  }

  /** Take a start code in an object. @param {number} code @param {number} bit behind it */
  _takeCode(code, bit) {
    const byte = this._offset + bit / 8 - 4;
    this._log._confirmPlanes();
    if (PLANE_CODES.includes(code)) this._codeBit ??= this._bit + 8 * this._offset;
    else {
      this._codeBit = null;
      this._checks._end(this._data, this._offset, byte, this._planes);
    }
    this._bit = bit;
    if (OBJECT_CODES.includes(code)) this._beginObject(byte);
    else if (!PLANE_CODES.includes(code)) this._endObject(code, byte);
  }

  /** Give a plane its number and its time, and move on past it. @param {import("./planes.js").Plane} plane @returns {StreamPlane} */
  _place(plane) {
    const number = this._planes++;
    const bit = plane.bit + 8 * this._offset;
    const startCode = this._codeBit !== null;
    this._bit = plane.stop;
    plane.stop += 8 * this._offset;
    if (plane.intra) {
      for (const problem of this._clock._beginIntra(plane, startCode, number, bit)) {
        this.warnings.push(`plane ${number}, bit ${bit}: ${problem}`);
      }
      this._checks._begin(this._data, this._offset, bit - (startCode ? 32 : 0), number);
    }
    if (this._salvage) this._log._addPlane(bit, plane.stop, plane.skip);
    plane.bit = this._codeBit ?? bit;
    this._codeBit = null;
    this._objects._hasBody ||= plane.body !== null;
    return Object.assign(plane, this._clock._next(plane.skip), { number });
  }

  /** Look, behind damage, for the next start code of an object, or of a plane that is an I plane. @param {boolean} final @returns {undefined | null} */
  _resynchronise(final) {
    let at;
    while ((at = findCode(this._data, this._scanned, this._length)) >= 0) {
      const code = this._data[at + 3];
      const wanted = PLANE_CODES.includes(code) || OBJECT_CODES.includes(code);
      if (wanted && at + 4 >= this._length && !final) return null; // the first bit of the plane is not here yet
      this._scanned = at + 4;
      if (!wanted || at + 4 >= this._length) continue;
      if (PLANE_CODES.includes(code) && !(this._data[at + 4] & 0x80)) continue; // the planes that it depends on are lost
      this._log._end(this._offset + at);
      return this._goOn(at);
    }
    this._scanned = Math.max(this._scanned, this._length - 3);
    this._bit = 8 * this._scanned;
    if (!final) return null;
    const end = this._findEnd(Math.max(this._log._last.start - this._offset, 0));
    this._log._end(this._offset + (end ?? this._length));
    this._log._resume(end === null ? null : this._log._estimate());
    if (end === null || !this._objects._count || this._wasAtEnd) return null;
    this._wasAtEnd = true;
    this._scanned = end;
    this.warnings.push(...this._objects._endObject(END, this._offset + end));
    this._state = this._findObject;
    return undefined;
  }

  /** Return the byte behind the last end code, if nothing but user data follows it. @param {number} begin */
  _findEnd(begin) {
    for (let at = this._length - 4; at >= begin; at -= 1) {
      if (findCode(this._data, at, at + 4) !== at || this._data[at + 3] !== END) continue;
      const end = at + 4;
      const followed = findCode(this._data, end, end + 4) === end && this._data[end + 3] === USER_DATA;
      return end === this._length || (end + 4 <= this._length && followed) ? end : null;
    }
    return null;
  }

  /** @param {number} byte of the stream, at which the object begins */
  _beginObject(byte) {
    this._objects._beginObject(byte);
    this._checks = new PeriodChecks(byte);
    this._reader._beginObject(this._objects._table);
    this._clock._beginObject();
    this._codeBit = null;
  }

  /** End the object at a start code that is not a plane's. @param {number} code @param {number} byte at which it begins */
  _endObject(code, byte) {
    if (code !== END && !LAYER_CODES.includes(code)) {
      const finding = `start code 00 00 01 ${hex(code)}, expected that of a plane, an object or the end`;
      const error = new FbaError("damage", finding, this._planes, 8 * byte);
      if (this._salvage) throw error;
      this.warnings.push(error.message);
    }
    this._scanned = this._bit >> 3;
    this.warnings.push(...this._objects._endObject(code, this._offset + this._scanned));
    this._state = this._findObject;
  }

  /** List damage in the plane at `_lostFrom`, and look for the next place to continue. @param {FbaError} error */
  _skipDamage(error) {
    const begun = this._objects._count > 0;
    const doubtful = this._log._recent[0];
    this._log._begin(error, begun ? this._offset + (this._lostFrom >> 3) : 0, this._planes);
    this._reader._forgetValues();
    this._checks._abandon();
    this._codeBit = null;
    if (doubtful !== undefined) this._scanned = Math.floor(doubtful / 8) - this._offset;
    else this._scanned = begun ? Math.max((this._lostFrom >> 3) + 1, 0) : this._bit >> 3;
    this._state = this._resynchronise;
  }

  /** @param {number} at byte of a plane start code outside of an object */
  _outside(at) {
    if (this._objects._count) this._lostFrom = 8 * (this._objects._end - this._offset);
    return new FbaError("damage", "a plane outside of an object", this._planes, 8 * (this._offset + at));
  }

  /** List as damage that the data end without an end code. */
  _reportMissingEnd() {
    const length = this._offset + this._length;
    const error = new FbaError("damage", NO_END, this._planes - 1, 8 * length);
    this._log._add(error, Math.min(this._offset + Math.ceil(this._bit / 8), length), length);
  }
}
