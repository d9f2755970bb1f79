/** Reads a stream that arrives in pieces: outside of an object, plane by plane, and past damage. */
import { DamageLog } from "./damage.js";
import { FbaError } from "./errors.js";
import { Fault, NO_START_CODE, OutOfData, UNDECIDED, findStartCode } from "./header.js";
import { END, LAYER_CODES, OBJECT_CODES, PLANE_CODES, PeriodChecks, USER_DATA, bytesNeeded, findCode } from "./marks.js";
import { ObjectBorders } from "./objects.js";
import { PlaneReader } from "./planes.js";
import { PlaneTimes } from "./clock.js";

/** @typedef {import("./planes.js").Planes & {index: Float64Array, span: import("./clock.js").Span, number: number, startCode: boolean}} Block */

export const NO_END = "the stream ends without the end code 00 00 01 b1: it may have been cut off behind this plane";
const SMALLEST = 4096; // bytes of the buffer, and those beyond which an incomplete plane is not tried with every byte
const DAMAGE_BYTES = 1000; // memory of a damage with its error
const FRAME_BYTES = 500; // memory of a frame without its values
const GROWTH = 20; // bytes of memory that each byte of the input may take besides `mostBytes`

/**
 * Throw an FbaError where something takes more memory than allowed.
 * @param {number} bytes @param {string} what @param {number} mostBytes @param {number} source bytes of the input
 */
export function checkMemory(bytes, what, mostBytes, source) {
  if (bytes <= mostBytes + GROWTH * source) return;
  const finding = `${what} takes ${bytes} bytes of memory, more than the ${mostBytes + GROWTH * source} that mostBytes allows`;
  throw new FbaError("limit", finding, { remedy: "if the stream is to be trusted, raise mostBytes" });
}

const hex = (/** @type {number} */ code) => code.toString(16).padStart(2, "0");

export class StreamReader {
  /**
   * @param {import("./slots.js").BapSteps | null} bapSteps
   * @param {boolean} salvage whether to go on behind damage
   * @param {number} mostBytes of memory, see `Options`
   * @param {ConstructorParameters<typeof ObjectBorders>[1]} [marks] of the whole stream, where they are known
   */
  constructor(bapSteps, salvage, mostBytes, marks = []) {
    this._salvage = salvage;
    this._mostBytes = mostBytes;
    this._log = new DamageLog();
    this.damage = this._log.damage;
    /** @type {string[]} */
    this.warnings = [];
    /** The error that ended the reading. @type {FbaError | null} */
    this.error = null;
    this.planes = 0;
    this.times = new PlaneTimes(salvage ? this._log : null);
    this.objects = new ObjectBorders(bapSteps, marks);
    /** Planes of I periods that do not match their checks: first, and behind the last. @type {[number, number][]} */
    this.wrong = [];
    this._wasAtEnd = false; // whether the bytes behind an end were being read, behind damage
    this._checks = new PeriodChecks();
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
    this._reader = new PlaneReader();
    /** @type {number | null} */
    this._codeBit = null; // where the start code before the next plane begins, in the stream
  }

  /** Add bytes; return the blocks that they complete. An error is in `error` then. @param {Uint8Array} piece */
  push(piece) {
    const need = this._length + piece.length;
    if (need > this._data.length) {
      const old = this._data.subarray(0, this._length);
      this._data = new Uint8Array(Math.max(need, 2 * this._data.length));
      this._data.set(old);
    }
    this._data.set(piece, this._length);
    this._length = need;
    const blocks = this._advance(false);
    if (!this.error) this._dropBytes();
    return blocks;
  }

  /** End the stream; return the last blocks. An error is in `error` then. */
  finish() {
    return this._advance(true);
  }

  /** Drop the bytes that neither the next plane needs, nor a look for start codes behind damage. */
  _dropBytes() {
    const doubtful = this._log.firstDoubtfulBit;
    let needed = doubtful !== null ? Math.floor(doubtful / 8) - this._offset : this._bit >> 3;
    if (this._codeBit !== null) needed = Math.min(needed, Math.floor(this._codeBit / 8) - this._offset);
    needed = Math.min(needed, this._bit >> 3, this._scanned || this._bit >> 3);
    if (needed < SMALLEST || 2 * needed < this._length) return;
    this._checks.add(this._data, this._offset, this._offset + needed);
    const rest = this._data.subarray(needed, this._length);
    this._data = new Uint8Array(Math.max(2 * rest.length, SMALLEST));
    this._data.set(rest);
    this._length = rest.length;
    this._offset += needed;
    this._bit -= 8 * needed;
    this._scanned = Math.max(this._scanned - needed, 0);
    this._retryAt = Math.max(this._retryAt - needed, 0);
  }

  /** @param {boolean} final whether no more bytes come */
  _advance(final) {
    /** @type {Block[]} */
    const blocks = [];
    const source = this._length;
    let memory = 0;
    while (!this.error) {
      this._lostFrom = this._bit;
      try {
        const block = this._state(final);
        if (block === null) break;
        if (block) {
          blocks.push(block);
          memory += block.rows.byteLength + FRAME_BYTES * block.skips.length;
          checkMemory(memory, "what one call returns", this._mostBytes, source);
        }
        const damages = this.damage.length;
        checkMemory(DAMAGE_BYTES * damages, `a list of ${damages} damages`, this._mostBytes, this._offset + source);
      } catch (error) {
        if (!(error instanceof FbaError)) throw error;
        if (this._salvage && error.kind !== "limit") this._skipDamage(error);
        else this.error = error;
      }
    }
    return blocks;
  }

  // ---- states: each returns a block, undefined without one, or null where it needs more bytes

  /** Look for the object start code; headers of other layers may come before it. @param {boolean} final @returns {Block | null | undefined} */
  _findObject(final) {
    if (this.objects.count === 0 && this._offset + this._scanned === 0 && !this._startError) this._checkStart(final);
    for (;;) {
      const at = findCode(this._data, this._scanned, this._length);
      if (at < 0) {
        this._scanned = Math.max(this._scanned, this._length - 3);
        break;
      }
      const code = this._data[at + 3];
      if (PLANE_CODES.includes(code)) {
        if (this.objects.count || !this._salvage) throw this._outside(at, code);
        if (at + 4 >= this._length && !final) break; // the first bit of the plane is not here yet
        if (at + 4 < this._length && this._data[at + 4] & 0x80) return this._join(at);
        this._startError ??= this._outside(at, code);
      }
      const content = this._data.subarray(at + 4, this._length);
      const needed = code === USER_DATA ? bytesNeeded(content, this.objects.size) : 0;
      if (needed > content.length && !final) break; // a mark may not be complete
      this.warnings.push(...this.objects.readUserData(code, this._offset + at, content.subarray(0, needed)));
      this._scanned = at + 4;
      this._compareChecks();
      if (OBJECT_CODES.includes(code)) {
        if (this._startError && this.objects.count === 0) this._log.add(this._startError, 0, { stop: this._offset + at });
        this._bit = 8 * this._scanned;
        this._scanned = 0;
        this._beginObject(this._offset + at);
        this._state = this._decodePlanes;
        return undefined;
      }
    }
    if (!final) this._bit = Math.max(this._bit, 8 * this._scanned);
    else if (this.objects.count === 0) {
      throw new FbaError("damage", "no FBA object start code (00 00 01 ba) in the stream", { plane: 0, bit: 0 });
    } else {
      const rest = this.objects.unread(this._offset + this._length);
      if (rest) this.warnings.push(`${rest} bytes follow the end of the FBA object; they were not read`);
    }
    return null;
  }

  /** Say that a stream does not begin with a start code: an error, or later a damage. @param {boolean} final */
  _checkStart(final) {
    const head = this._data.subarray(0, Math.min(this._length, 4));
    const begins = [0, 0, 1].every((byte, place) => place >= head.length || head[place] === byte);
    if (begins && !(final && head.length < 4)) return;
    const found = head.length ? `it begins with ${[...head].map(hex).join(" ")}` : "it is empty";
    const finding = `no FBA stream: expected the object start code 00 00 01 ba, but ${found}`;
    this._startError = new FbaError("damage", finding, { plane: 0, bit: 0 });
    if (!this._salvage) throw this._startError;
  }

  /** Compare the I periods of an object with the checks behind it, if any. */
  _compareChecks() {
    const listed = this.objects.checks;
    this.objects.checks = null;
    if (!listed) return;
    const checks = this._checks;
    const wrong = checks.wrong(listed);
    for (const [, start, first, stop] of wrong) {
      const finding = `the I period of planes ${first}..${stop - 1} does not match its CRC-32: a part of it is wrong`;
      this._reportWrong(finding, [first, stop], start);
    }
    const missing = listed.length - checks.periods.length;
    if (missing > 0 && !(checks.full || checks.leftOut || wrong.length)) {
      const finding = `${missing} of ${listed.length} I periods of the object are missing`;
      this._reportWrong(finding, [this.planes, this.planes], this.objects.begin);
    }
    this.damage.sort((one, other) => one.start - other.start);
    this._checks = new PeriodChecks();
  }

  /** @param {string} finding @param {[number, number]} planes @param {number} byte */
  _reportWrong(finding, planes, byte) {
    const error = new FbaError("damage", finding, { plane: planes[0], bit: 8 * byte });
    if (!this._salvage) throw error;
    this._log.add(error, byte, { doubtful: planes });
    if (planes[0] < planes[1]) this.wrong.push(planes);
  }

  /** Begin at an I plane of an object whose start is missing. @param {number} at byte of its start code @returns {undefined} */
  _join(at) {
    const missing = "the object start code 00 00 01 ba is missing";
    const error = this._startError ?? new FbaError("damage", missing, { plane: 0, bit: 0 });
    this._beginObject(this._offset + at);
    this._reader.forgetValues();
    this._checks.abandon();
    this._log.add(error, 0, { stop: this._offset + at });
    this._bit = 8 * at;
    this._scanned = 0;
    this._state = this._decodePlanes;
  }

  /** Decode the next planes, or the next start code. @param {boolean} final @returns {Block | null | undefined} */
  _decodePlanes(final) {
    const end = 8 * this._length;
    if (this._length < this._retryAt && !final) return null;
    const [code, after] = findStartCode(this._data, this._bit, end, this._codeBit !== null);
    if (code === UNDECIDED) {
      if (final) {
        if (this.planes && this._salvage) this._reportMissingEnd();
        this._bit = end;
        this.objects.end = this._offset + this._length;
        this._state = this._findObject;
      }
      return null;
    }
    if (code !== NO_START_CODE) {
      const start = this._bit;
      this._bit = after;
      this._log.confirmPlanes();
      if (!PLANE_CODES.includes(code)) {
        this._codeBit = null;
        this._checks.end(this._data, this._offset, this._absolute(after) / 8 - 4, this.planes);
      } else this._codeBit ??= this._absolute(start);
      if (OBJECT_CODES.includes(code)) this._beginObject(this._absolute(after) / 8 - 4);
      else if (!PLANE_CODES.includes(code)) this._endObject(code);
      return undefined;
    }
    try {
      const planes = this._reader.read(this._data, this._bit, end, this._codeBit !== null);
      if (!planes.skips.length) return undefined;
      const block = this._block(planes);
      if (!planes.complete) this._awaitBytes();
      return block;
    } catch (error) {
      if (error instanceof Fault) {
        const kind = error.unsupported ? "unsupported" : "damage";
        throw new FbaError(kind, error.message, { plane: this.planes, bit: this._absolute(error.bit) });
      }
      if (!(error instanceof OutOfData)) throw error;
    }
    if (final) {
      this._log.confirmPlanes(); // a cut leaves the planes before it alone
      const finding = "the stream ends inside this plane: it is cut off, or its last bytes are missing";
      throw new FbaError("damage", finding, { plane: this.planes, bit: this._absolute(end) });
    }
    this._awaitBytes();
    return null;
  }

  /** Do not try the next plane again before more bytes of it come. */
  _awaitBytes() {
    const waiting = this._length - (this._bit >> 3);
    this._retryAt = this._length + (waiting > SMALLEST ? waiting >> 2 : 1);
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
      this._log.end(this._offset + at);
      this._bit = 8 * at;
      this._scanned = 0;
      this._state = this._decodePlanes;
      return undefined;
    }
    this._scanned = Math.max(this._scanned, this._length - 3);
    this._bit = 8 * this._scanned;
    if (!final) return null;
    const end = this._findEnd(Math.max(this._log.last.start - this._offset, 0));
    this._log.end(this._offset + (end ?? this._length));
    this._log.resume(end === null ? null : this._log.estimate());
    if (end === null || !this.objects.count || this._wasAtEnd) return null;
    this._wasAtEnd = true;
    this._scanned = end;
    this.warnings.push(...this.objects.endObject(END, this._offset + end));
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

  /** Return planes with their times, and move on past them. @param {import("./planes.js").Planes} planes @returns {Block} */
  _block(planes) {
    const borders = planes.borders.map((bit) => bit + 8 * this._offset);
    const startCode = this._codeBit !== null;
    if (planes.header) {
      for (const problem of this.times.beginIntra(planes.header, startCode, this.planes, borders[0])) {
        this.warnings.push(`plane ${this.planes}, bit ${borders[0]}: ${problem}`);
      }
      this._checks.beginPeriod(this._data, this._offset, borders[0] - (startCode ? 32 : 0), this.planes);
    }
    if (this._salvage) this._log.addPlanes(borders, planes.skips);
    if (this._codeBit !== null) borders[0] = this._codeBit;
    const block = { ...planes, ...this.times.advance(planes.skips), borders, number: this.planes, startCode };
    this.planes += planes.skips.length;
    this.objects.hasBody ||= planes.body !== null;
    this._bit = planes.borders[planes.skips.length];
    this._codeBit = null;
    return block;
  }

  /** @param {number} byte of the stream, at which the object begins */
  _beginObject(byte) {
    this.objects.beginObject(byte);
    this._checks = new PeriodChecks(byte);
    this._reader.beginObject(this.objects.table);
    this.times.beginObject();
    this._codeBit = null;
  }

  /** End the object at a start code that is not a plane's. @param {number} code */
  _endObject(code) {
    if (code !== END && !LAYER_CODES.includes(code)) {
      const finding = `start code 00 00 01 ${hex(code)} where a plane, the end code 00 00 01 b1 or a new object was expected`;
      const error = new FbaError("damage", finding, { plane: this.planes, bit: this._absolute(this._bit - 32) });
      if (this._salvage) throw error;
      this.warnings.push(`${error.message}; the object ends there`);
    }
    this._scanned = this._bit >> 3;
    this.warnings.push(...this.objects.endObject(code, this._offset + this._scanned));
    this._state = this._findObject;
  }

  // ---- damage

  /** Return the position in the stream of a bit in the buffer. @param {number} bit */
  _absolute(bit) {
    return bit + 8 * this._offset;
  }

  /** List damage in the plane at `_lostFrom`, and look for the next place to continue. @param {FbaError} error */
  _skipDamage(error) {
    const begun = this.objects.count > 0;
    const doubtful = this._log.firstDoubtfulBit;
    this._log.begin(error, begun ? this._offset + (this._lostFrom >> 3) : 0, this.planes);
    this._reader.forgetValues();
    this._checks.abandon();
    this._codeBit = null;
    if (doubtful !== null) this._scanned = Math.floor(doubtful / 8) - this._offset;
    else this._scanned = begun ? Math.max((this._lostFrom >> 3) + 1, 0) : this._bit >> 3;
    this._state = this._resynchronise;
  }

  /** @param {number} at byte of a plane start code outside of an object @param {number} code */
  _outside(at, code) {
    let before = "no object has begun";
    if (this.objects.count) {
      const end = this.objects.end;
      before = `the object ended with start code 00 00 01 ${hex(this.objects.endCode ?? 0)} at byte ${end - 4}`;
      this._lostFrom = 8 * (end - this._offset);
    }
    const finding = `plane start code 00 00 01 ${hex(code)} outside of an object: ${before}`;
    return new FbaError("damage", finding, { plane: this.planes, bit: this._absolute(8 * at) });
  }

  /** List as damage that the data end without an end code. */
  _reportMissingEnd() {
    const length = this._offset + this._length;
    const error = new FbaError("damage", NO_END, { plane: this.planes - 1, bit: 8 * length });
    this._log.add(error, Math.min(Math.floor((this._absolute(this._bit) + 7) / 8), length), { stop: length });
  }
}
