/** Reads a stream that arrives in pieces: outside of an object, plane by plane, and past damage. */
import { END, OBJECT_ENDS, OUT_OF_DATA, SEQUENCE, USER_DATA, codeAt, findCode, isObject, isPlane, takeStartCode } from "./bits.js";
import { makeClock } from "./clock.js";
import { FbaError } from "./errors.js";
import { streamFrame } from "./frames.js";
import { bytesNeeded, crc32, findMarks, isTable, otherSteps, readMark, writtenCheck } from "./marks.js";
import { planeReader } from "./planes.js";

/**
 * A plane in the stream, where it has a number. bit: of the start code before it, if there is one.
 * @typedef {import("./planes.js").Plane & {_span: import("./clock.js").Span,
 *   _shown: {plane: number, bits: number, index: number}}} StreamPlane
 */

export const NO_END = "no end code 00 00 01 b1";
const NO_START = "no start code 00 00 01 ba";
const LONG = 4096; // bytes that are kept anyway, and those beyond which an incomplete plane is not tried with every byte
const DAMAGE_BYTES = 1000; // memory of a damage with its error
const PLANE_BYTES = 500; // memory of a plane without its values
const GROWTH = 20; // bytes of memory that each byte of the input may take besides `mostBytes`
const DOUBTFUL = 8; // planes before damage that may have been misread
const MOST_PERIODS = 1 << 18; // that are checked: three days with an I plane every second

/**
 * bapSteps: the stream's table of BAP steps; by default that which its mark names, "iso" without a mark. salvage: go on
 * behind damage, which `damage` lists. mostFrames, mostBytes: limits of what a stream, or a piece pushed, may become, the
 * latter besides 20 bytes for each byte of it.
 * @typedef {{bapSteps?: import("./parameters.js").BapSteps, salvage?: boolean, mostFrames?: number, mostBytes?: number}} Options
 *
 * Damage that was skipped. start, stop: lost bytes of the stream. framesLost: frame periods that no plane fills, and
 * by how many that may be wrong; null if nothing says so. doubtful: planes that were returned and may be wrong, as the
 * number of the first and of that behind the last; null without any.
 * @typedef {{error: FbaError, start: number, stop: number, framesLost: number | null,
 *   uncertainty: number | null, doubtful: [number, number] | null}} Damage
 *
 * What a complete stream holds: planes; those of I periods that do not match their checks, as the number of the first and
 * of that behind the last; whether nothing ended the last object.
 * @typedef {[StreamPlane[], [number, number][], boolean]} Whole
 */

/** @param {Uint8Array | ArrayBuffer} data */
export function bytesOf(data) {
  if (data instanceof Uint8Array) return data;
  if (data instanceof ArrayBuffer) return new Uint8Array(data);
  throw new FbaError("option", "expected a Uint8Array or an ArrayBuffer");
}

/** Decodes a stream that arrives in pieces of any size, down to a byte. */
export class Decoder {
  /**
   * @param {Options} [options] without bapSteps, a mark before the object names the table, "iso" without one
   * @param {Uint8Array} [whole] the complete stream, where `decode` calls it
   */
  constructor({ bapSteps, salvage = false, mostFrames = 6e6, mostBytes = 1e8 } = {}, whole) {
    if (bapSteps !== undefined && !isTable(bapSteps)) throw new FbaError("option", "bapSteps: expected iso or visage");
    /** What is odd in the stream so far. @type {string[]} */
    const warnings = (this.warnings = []);
    /** Damage so far, when salvaging. @type {Damage[]} */
    const damage = (this.damage = []);
    /** The table of BAP steps that a mark names, or null. @type {import("./parameters.js").BapSteps | null} */
    this.mark = null;
    /** Whether an end code closed the last object. */
    this.ended = false;

    // ---- the bytes that came and are still needed; all places are bytes or bits from the start of the stream
    const input = { _data: whole ?? new Uint8Array(0), _first: 0, _bit: 0 };
    let end = input._data.length;
    const byteAt = (/** @type {number} */ byte) => input._data[byte - input._first];
    const startCodeAt = (/** @type {number} */ byte) => codeAt(input._data, byte - input._first);
    const bytes = (/** @type {number} */ from, /** @type {number} */ to) => input._data.subarray(from - input._first, to - input._first);

    /** @param {Uint8Array} piece */
    function append(piece) {
      const { buffer, byteOffset, length } = input._data;
      const size = length + piece.length;
      if (byteOffset + size <= buffer.byteLength) input._data = new Uint8Array(buffer, byteOffset, size);
      else {
        const larger = new Uint8Array(2 * size);
        larger.set(input._data);
        input._data = larger.subarray(0, size);
      }
      input._data.set(piece, length);
      end += piece.length;
    }

    /** Drop the bytes that neither the next plane needs, nor a look for start codes behind damage. */
    function dropBytes() {
      const needed = Math.floor(Math.min(8 * scanned || bit, codeBit ?? bit, recent[0] ?? bit) / 8);
      const dropped = needed - input._first;
      if (dropped >= LONG && 2 * dropped >= input._data.length) {
        sumUp(needed);
        input._data = bytes(needed, end);
        input._first = needed;
      }
    }

    // ---- where reading stands
    /** The error that ended it. @type {FbaError | undefined} */
    let failure;
    let finished = false;
    let planes = 0;
    let bit = 0; // next one to decode
    let scanned = 0; // byte up to which no start code was found, while looking for one; 0 in an object
    let retryAt = 0; // end of the bytes with which an incomplete plane is tried again
    let planeBit = 0;
    /** @type {number | null} */
    let codeBit = null; // where the start code before the next plane begins
    /** @type {FbaError | undefined} */
    let startError;
    let wasAtEnd = false; // whether the bytes behind an end were being read, behind damage
    /** Returns a plane, undefined without one, or null where it needs more bytes. @type {(final: boolean) => StreamPlane | null | undefined} */
    let state = findObject;

    /** @param {string} finding @param {number} at bit */
    const fault = (finding, at, plane = planes, /** @type {import("./errors.js").Kind} */ kind = "damage") =>
      new FbaError(kind, finding, plane, at);
    const reader = planeReader(input, (finding, at, kind) => {
      throw fault(finding, at, planes, kind);
    });
    const clock = makeClock(
      salvage,
      whole !== undefined,
      (finding) => warnings.push(`plane ${planes}: ${finding}`),
      (finding, framesLost) => addDamage(fault(finding, planeBit), planeBit >> 3, undefined, framesLost),
      resume,
    );

    /** Return the planes of the bytes so far; an error is in `failure` then. @param {boolean} final whether no more bytes come */
    function advance(final) {
      /** @type {StreamPlane[]} */
      const found = [];
      let memory = 0;
      while (!failure) {
        try {
          const plane = state(final);
          if (plane === null) break;
          if (plane) {
            found.push(plane);
            memory += PLANE_BYTES + plane._row.byteLength;
          }
          const exceeded =
            found.length > mostFrames ? "mostFrames"
            : memory + DAMAGE_BYTES * damage.length > mostBytes + GROWTH * end ? "mostBytes"
            : "";
          if (exceeded) throw new FbaError("limit", `more than ${exceeded}`);
        } catch (error) {
          if (!(error instanceof FbaError)) throw error;
          if (salvage && error.kind !== "limit") skipDamage(error);
          else failure = error;
        }
      }
      if (!failure && !final) dropBytes();
      return found;
    }

    /** Return the frames of the bytes so far. @param {boolean} final */
    function frames(final) {
      if (failure) throw failure;
      finished = final;
      const found = advance(final).map(streamFrame);
      if (failure && (final || !found.length)) throw /** @type {FbaError} */ (failure);
      return found;
    }

    /**
     * Add bytes; return the frames that they complete. At damage, the frames before it are returned, and the next call
     * throws the error.
     * @param {Uint8Array | ArrayBuffer} data
     */
    this.push = (data) => {
      const piece = bytesOf(data);
      if (finished) throw new FbaError("option", "this decoder is finished");
      append(piece);
      return frames(false);
    };

    /** End the stream; return the last frames. Throws where the stream ends inside a plane. */
    this.finish = () => (finished && !failure ? [] : frames(true));

    // ---- states

    /** Move on to the next start code; return its last byte, if there is one. */
    function nextCode() {
      scanned = input._first + findCode(input._data, Math.max(scanned - input._first, 0));
      return byteAt(scanned + 3);
    }

    /** Whether an I plane begins at a byte. @param {number} byte */
    const beginsIntra = (byte) => byteAt(byte) > 127;

    /** Look for the object start code; headers of other layers may come before it. @param {boolean} final */
    function findObject(final) {
      if (!count && !scanned && !startError) {
        if ([0, 0, 1].some((byte, place) => (input._data[place] ?? byte) !== byte) || (final && end < 4)) {
          startError = fault(NO_START, 0);
          if (!salvage) throw startError;
        }
      }
      for (let code; (code = nextCode()) !== undefined; ) {
        const at = scanned;
        const joins = isPlane(code) && beginsIntra(at + 4); // an object whose start is missing
        if (isPlane(code)) {
          if (count) bit = 8 * objectEnd;
          const outside = fault("plane outside an object", 8 * at);
          if (count || !salvage) throw outside;
          if (at + 4 === end && !final) break; // the first bit of the plane is not here yet
          startError ??= joins ? fault(NO_START, 0) : outside;
        }
        const content = bytes(at + 4, end);
        const needed = code === USER_DATA ? bytesNeeded(content, objectEnd - objectBegin) : 0;
        if (needed > content.length && !final) break; // a mark may not be complete
        takeOutside(code, at, content.subarray(0, needed));
        scanned = at + 4;
        compareChecks();
        if (isObject(code) || joins) {
          if (startError && !count) addDamage(startError, 0, at);
          beginObject(at);
          if (joins) forget();
          return goOn(joins ? at : at + 4);
        }
      }
      if (!final) bit = Math.max(bit, 8 * scanned);
      else if (!count) throw fault(NO_START, 0);
      else if (!inUserData && end > objectEnd) warnings.push(`${end - objectEnd} bytes behind the end`);
      return null;
    }

    /** Decode planes from a byte on. @param {number} byte @returns {undefined} */
    function goOn(byte) {
      bit = 8 * byte;
      scanned = 0;
      state = decodePlanes;
    }

    /** Decode the next plane, or take the next start code. @param {boolean} final */
    function decodePlanes(final) {
      if (end < retryAt && !final) return null;
      let inPlane = false;
      input._bit = bit;
      try {
        const code = takeStartCode(input, codeBit !== null);
        if (code !== undefined) return takeCode(code);
        inPlane = true;
        input._bit = bit;
        return place(reader._read());
      } catch (error) {
        if (error !== OUT_OF_DATA) throw error;
      }
      if (final && inPlane) {
        recent = recentSkips = []; // a cut leaves the planes before it alone
        throw fault("the stream ends in this plane", 8 * end);
      }
      if (final) {
        if (planes && salvage) addDamage(fault(NO_END, 8 * end, planes - 1), Math.min(Math.ceil(bit / 8), end), end);
        bit = 8 * end;
        objectEnd = end;
        state = findObject;
      } else if (inPlane) {
        const waiting = end - bit / 8;
        retryAt = end + (waiting > LONG ? waiting / 4 : 0);
      }
      return null;
    }

    /** Take a start code in an object. @param {number} code @returns {undefined} */
    function takeCode(code) {
      const byte = input._bit / 8 - 4;
      recent = recentSkips = []; // no plane so far is doubtful: the last ended where a start code begins
      if (isPlane(code)) codeBit ??= bit;
      else {
        codeBit = null;
        endPeriod(byte);
      }
      if (!isPlane(code) && !isObject(code) && !OBJECT_ENDS.includes(code)) {
        const error = fault(`unknown start code 00 00 01 ${code.toString(16)}`, 8 * byte);
        if (salvage) throw error;
        warnings.push(error.message);
      }
      bit = input._bit;
      if (isObject(code)) beginObject(byte);
      else if (!isPlane(code)) endObject(code, byte + 4);
    }

    /** Give a plane its number and its time, and move on past it. @param {import("./planes.js").Plane} plane @returns {StreamPlane} */
    function place(plane) {
      const { _shown: shown, _skip: skip } = plane;
      const startCode = codeBit !== null;
      planeBit = shown.bit;
      bit = plane._stop;
      if (shown.intra) {
        clock._beginIntra(plane, startCode, resuming, resuming ? estimate() : null);
        beginPeriod(planeBit - (startCode ? 32 : 0));
      }
      if (salvage) {
        recent = [...recent, planeBit].slice(-DOUBTFUL);
        recentSkips = [...recentSkips, skip].slice(-DOUBTFUL);
        bitsRead += bit - planeBit;
        framesRead += skip + 1;
      }
      shown.bit = codeBit ?? planeBit;
      codeBit = null;
      hasBody ||= !!plane._body;
      const [index, span] = clock._next(skip);
      Object.assign(shown, { index, plane: planes++, bits: bit - shown.bit });
      return Object.assign(/** @type {StreamPlane} */ (plane), { _span: span });
    }

    /** Look, behind damage, for the next start code of an object, or of a plane that is an I plane. @param {boolean} final @returns {undefined | null} */
    function resynchronise(final) {
      for (let code; (code = nextCode()) !== undefined; ) {
        const at = scanned;
        const last = at + 4 === end;
        if ((isPlane(code) || isObject(code)) && last && !final) return null; // the first bit of the plane is not here yet
        if (isObject(code) ? !last : isPlane(code) && beginsIntra(at + 4)) {
          endDamage(at);
          return goOn(at);
        }
        scanned = at + 4;
      }
      bit = 8 * scanned;
      if (!final) return null;
      // Only user data may follow the end code.
      let stop = end;
      while (stop > lastDamage().start && startCodeAt(stop - 4) !== END) stop -= 1;
      const isEnd = stop >= lastDamage().start + 4 && (stop === end || startCodeAt(stop) === USER_DATA);
      endDamage(isEnd ? stop : end);
      resume(isEnd ? estimate() : null);
      if (!isEnd || !count || wasAtEnd) return null;
      wasAtEnd = true;
      endObject(END, stop);
      return undefined;
    }

    /** List damage in the plane that begins at `bit`, and look for the next place to continue. @param {FbaError} error */
    function skipDamage(error) {
      const byte = count ? Math.floor(bit / 8) : 0;
      scanned = recent.length ? Math.floor(recent[0] / 8) : count ? byte + 1 : Math.floor(bit / 8);
      if (resuming) lastDamage().framesLost = lastDamage().uncertainty = 0;
      else lossBegin = byte;
      addDamage(error, byte, byte, null, planes - recent.length, planes);
      resuming = true;
      recent = [];
      forget();
      codeBit = null;
      state = resynchronise;
    }

    /** Forget, behind what is lost, what P planes and checks would need of it. */
    function forget() {
      reader._forgetValues();
      periodBegun = periodFirst = false;
      periodLeftOut = true;
    }

    // ---- damage
    let resuming = false; // whether the last damage is over, but no plane behind it was decoded yet
    /** First bits of the last planes: damage here would make them doubtful. @type {number[]} */
    let recent = [];
    /** @type {number[]} */
    let recentSkips = [];
    let bitsRead = 0;
    let framesRead = 0;
    let lossBegin = 0; // first byte of all damage since the last plane
    const lastDamage = () => damage[damage.length - 1];

    /**
     * Add damage that planes before and behind it are not lost with.
     * @param {FbaError} error @param {number} start @param {number} [stop] @param {number | null} [framesLost]
     * @param {number} [first] doubtful plane @param {number} [behind] the last
     */
    function addDamage(error, start, stop = start, framesLost = null, first = 0, behind = 0) {
      damage.push({ error, start, stop, framesLost, uncertainty: framesLost && 0, doubtful: first < behind ? [first, behind] : null });
    }

    /** Set the end of the last damage. @param {number} byte */
    function endDamage(byte) {
      lastDamage().start = Math.min(lastDamage().start, byte);
      lastDamage().stop = byte;
    }

    /** A plane was decoded behind the damage, or nothing follows. @param {number[] | null} lost frames, uncertainty */
    function resume(lost) {
      [lastDamage().framesLost, lastDamage().uncertainty] = lost ?? [null, null];
      resuming = false;
      recentSkips = [];
    }

    /** Return about how many frames were lost since the last plane, and the uncertainty. */
    function estimate() {
      if (!framesRead) return null;
      const share = (8 * Math.max(lastDamage().stop - lossBegin, 0) * framesRead) / bitsRead;
      const lost = share % 2 === 0.5 ? share - 0.5 : Math.round(share); // halves go to the even number
      return [lost, 1 + Math.ceil(lost / 2) + recentSkips.reduce((all, skip) => all + skip, 0)];
    }

    // ---- objects, the bytes around them, and their marks
    const marks = whole && !bapSteps ? findMarks(whole) : [];
    let inUserData = false; // whether user data stand at `objectEnd`
    let inHeaders = false; // whether headers of a sequence have begun, and no object in it
    /** @type {import("./parameters.js").BapSteps | null} */
    let before = null; // the table that user data in those headers name
    let count = 0;
    // Of the last object:
    /** @type {import("./parameters.js").BapSteps} */
    let table = "iso";
    let hasBody = false;
    /** Last byte of the start code that ended it. @type {number | null} */
    let endCode = null;
    let objectBegin = 0;
    let objectEnd = 0; // byte behind that code, or behind user data that follow it
    /** What the mark behind it lists. @type {string[] | null} */
    let checks = null;

    /** @param {number} byte at which the object begins */
    const beginObject = (byte) => {
      table = bapSteps ?? before ?? marks.find(([, begin, stop]) => begin <= byte && byte < stop)?.[0] ?? "iso";
      count += 1;
      hasBody = inHeaders = this.ended = false;
      objectBegin = byte;
      this.mark = before;
      endCode = before = checks = codeBit = null;
      beginChecks(byte);
      reader._beginObject(table);
      clock._beginObject();
    };

    /** End the object at a start code. @param {number} code @param {number} byte behind it */
    const endObject = (code, byte) => {
      endCode = code;
      this.ended = code === END;
      objectEnd = scanned = byte;
      inUserData = false;
      inHeaders = code === SEQUENCE;
      state = findObject;
      compareTables();
    };

    /**
     * Take a start code outside of an object, and read the mark if it begins one.
     * @param {number} code @param {number} byte at which the start code stands @param {Uint8Array} content behind it
     */
    const takeOutside = (code, byte, content) => {
      const directly = byte === objectEnd && count > 0;
      if (inUserData) objectEnd = byte;
      inUserData = code === USER_DATA && count > 0 && byte === objectEnd;
      if (code === SEQUENCE) {
        inHeaders = true;
        before = null;
      }
      if (code !== USER_DATA || !(directly || inHeaders)) return;
      const useless = directly && endCode !== END;
      const found = readMark(content, useless ? [] : warnings);
      if (!found) return;
      const named = found[0];
      if (useless) warnings.push("mark: no end code before it");
      else if (!directly) {
        if (before && named && named !== before) warnings.push(otherSteps(named, before));
        before ??= named;
      } else {
        checks = found[1];
        if (named && named !== this.mark) {
          this.mark = named;
          compareTables();
        }
      }
    };

    /** Warn where the object was decoded with another table than that of its mark. */
    const compareTables = () => {
      if (this.mark && this.mark !== table && hasBody) warnings.push(otherSteps(this.mark, table));
    };

    // ---- checks of I periods: an I plane with the planes up to the next one, from its start code, or the byte in which
    // it begins, to the byte before the next period; the first begins with the object's start code
    /** Of the periods that have ended: check, first byte, first plane and plane behind the last. @type {[string, number, number, number][]} */
    let periods = [];
    let periodLeftOut = false; // whether a period was abandoned
    let periodBegun = false;
    let periodFirst = true; // whether the first period begins where the object does
    let crc = 0;
    let periodBegin = 0;
    let summedUp = 0; // first byte that is not in the CRC
    let periodPlane = 0;
    /** Planes of periods that do not match their checks. @type {[number, number][]} */
    const wrong = [];

    /** @param {number} byte at which the object begins */
    function beginChecks(byte) {
      periods = [];
      periodLeftOut = periodBegun = false;
      periodFirst = true;
      crc = 0;
      periodBegin = summedUp = byte;
    }

    /** Take the bytes up to `stop`. @param {number} stop */
    function sumUp(stop) {
      if (stop <= summedUp || !(periodBegun || periodFirst)) return;
      crc = crc32(bytes(summedUp, stop), crc);
      summedUp = stop;
    }

    /** Begin the next period with the next plane. @param {number} at bit */
    function beginPeriod(at) {
      endPeriod(Math.ceil(at / 8));
      if (!periodFirst) {
        crc = 0;
        periodBegin = summedUp = Math.floor(at / 8);
      }
      periodPlane = planes;
      periodBegun = true;
      periodFirst = false;
    }

    /** End the last period before a byte. @param {number} stop */
    function endPeriod(stop) {
      if (periodBegun && periods.length < MOST_PERIODS) {
        sumUp(stop);
        periods.push([writtenCheck(crc), periodBegin, periodPlane, planes]);
      }
      periodBegun = false;
    }

    /** Compare the I periods of an object with the checks behind it, if any. */
    function compareChecks() {
      const listed = checks;
      checks = null;
      if (!listed) return;
      const report = (/** @type {string} */ finding, /** @type {number} */ byte, /** @type {number} */ first, /** @type {number} */ stop) => {
        const error = fault(finding, 8 * byte, first);
        if (!salvage) throw error;
        addDamage(error, byte, byte, null, first, stop);
        if (first < stop) wrong.push([first, stop]);
      };
      /** @type {Map<string, any>} */
      const last = new Map(listed.map((check, at) => [check, at]));
      let following = 0;
      let bad = 0;
      for (const [check, begin, first, stop] of periods) {
        if (last.get(check) >= following) following = listed.indexOf(check, following) + 1;
        else {
          report(`planes to ${stop - 1}: wrong check`, begin, first, stop);
          bad += 1;
        }
      }
      const missing = listed.length - periods.length;
      if (missing > 0 && !periodLeftOut && !bad && periods.length < MOST_PERIODS) {
        report(`${missing} I periods missing`, objectBegin, planes, planes);
      }
      damage.sort((one, other) => one.start - other.start);
      beginChecks(0);
    }

    if (whole) {
      /** @type {Whole | undefined} */
      this._whole = [advance(false).concat(advance(true)), wrong, endCode === null];
      if (failure) throw failure;
    }
  }
}
