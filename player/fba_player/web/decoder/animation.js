/** Whole streams. */
import { commonTimes } from "./clock.js";
import { FbaError } from "./errors.js";
import { partsOf } from "./frames.js";
import { findMarks } from "./marks.js";
import { Decoder, NO_END, bytesOf } from "./stream.js";

/**
 * Return the animation of a complete stream. Throws FbaError for damage (unless salvaging), for streams without a plane,
 * for DCT segments, whose tables are in no public source, and beyond the limits.
 * @param {Uint8Array | ArrayBuffer} data
 * @param {import("./stream.js").Options} [options]
 */
export function decode(data, options = {}) {
  return new Animation(bytesOf(data), options);
}

/** The decoded frames of a stream. */
export class Animation {
  /** @param {Uint8Array} bytes @param {import("./stream.js").Options} options */
  constructor(bytes, options) {
    const decoder = new Decoder(options);
    if (!options.bapSteps) decoder._objects._marks = findMarks(bytes);
    decoder._clock._mayStepBack = true;
    const planes = decoder._readAll(bytes);
    /** What was lost, when salvaging. */
    this.damage = decoder.damage;
    if (!planes.length) {
      const cause = this.damage[0]?.error.message ?? "";
      throw new FbaError("damage", "the stream holds no plane that can be decoded", 0, undefined, cause);
    }
    /** What is odd in the stream. */
    this.warnings = decoder.warnings;
    if (!options.salvage && decoder._objects._endCode === null) this.warnings.push(`plane ${planes.length - 1}: ${NO_END}`);
    /** The table of BAP steps that the stream's mark names, or null. */
    this.mark = decoder.mark;
    const { rate, index } = commonTimes(planes);
    /** Frames per second, an exact fraction. */
    this.rate = rate;
    const kept = keptPlanes(index, decoder._wrong);
    this._planes = kept.map((at) => planes[at]);
    /** Number of each frame at `rate`, rising: frames that are skipped have none. */
    this.index = Float64Array.from(kept, (at) => index[at]);
    this.hasFace = planes.some((plane) => plane.face);
    this.hasBody = planes.some((plane) => plane.body);
  }

  /** Number of frames. */
  get length() {
    return this.index.length;
  }

  /** Return the seconds at which a frame is shown. @param {number} at */
  time(at) {
    return (this.index[at] * Number(this.rate.denominator)) / Number(this.rate.numerator);
  }

  /** Return a frame. @param {number} at from 0 @returns {import("./frames.js").Frame} */
  frame(at) {
    if (!(at in this._planes)) throw new RangeError(`frame ${at} of ${this.length}`);
    return { index: this.index[at], time: this.time(at), ...partsOf(this._planes[at]) };
  }
}

/**
 * Return the planes that are kept: those before damage whose index later ones repeat were misread, and those of I periods
 * that do not match their checks are left out unless they are all.
 * @param {Float64Array} index @param {[number, number][]} wrong
 */
function keptPlanes(index, wrong) {
  /** @type {number[]} */
  const kept = [];
  for (let at = index.length - 1, later = Infinity; at >= 0; at -= 1) {
    if (index[at] < later) kept.push(at);
    later = Math.min(later, index[at]);
  }
  kept.reverse();
  const isWrong = new Uint8Array(index.length);
  for (const [first, stop] of wrong) isWrong.fill(1, first, stop);
  const right = kept.filter((at) => !isWrong[at]);
  return right.length ? right : kept;
}
