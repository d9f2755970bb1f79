/** Whole streams. */
import { partsOf } from "./frames.js";
import { commonTimes } from "./clock.js";
import { FbaError } from "./errors.js";
import { text, value } from "./fraction.js";
import { Decoder, NO_END, bytesOf } from "./stream.js";

/** The decoded frames of a stream. @typedef {ReturnType<typeof decode>} Animation */

/**
 * Return the animation of a complete stream. Throws FbaError for damage (unless salvaging), for streams without a plane,
 * for DCT segments, whose tables are in no public source, and beyond the limits.
 * @param {Uint8Array | ArrayBuffer} data
 * @param {import("./stream.js").Options} [options]
 */
export function decode(data, options = {}) {
  const decoder = new Decoder(options, bytesOf(data));
  const { damage, warnings, mark } = decoder;
  const [planes, wrong, open] = /** @type {import("./stream.js").Whole} */ (decoder._whole);
  if (!planes.length) throw new FbaError("damage", "no plane can be decoded", 0, undefined, damage[0]?.error.message);
  if (!options.salvage && open) warnings.push(`plane ${planes.length - 1}: ${NO_END}`);
  const [rate, index] = commonTimes(planes);
  const [numerator, denominator] = rate;
  const kept = keptPlanes(index, wrong);
  const indices = Float64Array.from(kept, (at) => index[at]);
  const time = (/** @type {number} */ at) => (indices[at] * Number(denominator)) / Number(numerator);
  return {
    /** What was lost, when salvaging. */
    damage,
    /** What is odd in the stream. */
    warnings,
    /** The table of BAP steps that the stream's mark names, or null. */
    mark,
    /** Frames per second, an exact fraction. */
    rate: { numerator, denominator, valueOf: () => value(rate), toString: () => text(rate) },
    /** Number of each frame at `rate`, rising: frames that are skipped have none. */
    index: indices,
    hasFace: planes.some((plane) => plane._face),
    hasBody: planes.some((plane) => plane._body),
    /** Number of frames. */
    length: kept.length,
    /** Return the seconds at which a frame is shown. */
    time,
    /** Return a frame. @param {number} at from 0 @returns {import("./frames.js").Frame} */
    frame(at) {
      if (!(at in kept)) throw new RangeError(`frame ${at} of ${kept.length}`);
      return { index: indices[at], time: time(at), ...partsOf(planes[kept[at]]) };
    },
  };
}

/**
 * Return the planes that are kept: those before damage whose index later ones repeat were misread, and those of I periods
 * that do not match their checks are left out unless they are all.
 * @param {Float64Array} index @param {[number, number][]} wrong
 */
function keptPlanes(index, wrong) {
  /** @type {number[]} */
  const kept = [];
  for (let at = index.length, later = Infinity; at--; ) {
    if (index[at] < later) kept.push(at);
    later = Math.min(later, index[at]);
  }
  kept.reverse();
  const marked = index.slice();
  for (const [first, stop] of wrong) marked.fill(NaN, first, stop);
  const right = kept.filter((at) => marked[at] >= 0);
  return right.length ? right : kept;
}
