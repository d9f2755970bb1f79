/** FAPs and BAPs of a performance at any time, each held until it is sent again. */
/**
 * Frames, rising by their index, which counts at framesPerSecond; more may come.
 * @typedef {import("../decoder/frames.js").Frame} Frame
 * @typedef {{
 *   length: number, indexOf(at: number): number, frame(at: number): Frame, hasFace: boolean, hasBody: boolean,
 *   framesPerSecond: number,
 * }} Frames
 *
 * What visemes, expressions and unsent FAPs come to: see `figure/resolve.js`.
 * @typedef {{copy(): Resolver, push(frame: import("../decoder/frames.js").FaceFrame | null, out: Float32Array): void}} Resolver
 */

const [FAPS, BAPS] = [68, 296];
const BLOCK = 256; // frames that are resolved at once
const CACHED = 8;
const TURN = (2 * Math.PI) / 1e-5; // in units of a BAP
const [FIRST_SHIFT, LAST_SHIFT] = [180, 182]; // columns of BAPs that are millimetres
const KEPT = 5; // seconds of a live stream
const ROUNDING = 1e-6; // of frames: a time this close to a frame's is that frame's

/** The state of a performance before a block of frames. @typedef {{face: Resolver, body: Int32Array}} State */

export class Timeline {
  /** @param {Frames} frames @param {Resolver} resolver in its first state */
  constructor(frames, resolver) {
    this.frames = frames;
    this.interpolate = true;
    /** @type {State[]} */
    this._states = [{ face: resolver, body: new Int32Array(BAPS) }];
    /** @type {Map<number, {faps: Float32Array, baps: Int32Array | null, count: number}>} */
    this._blocks = new Map();
  }

  /** Seconds at which the first frame is shown. */
  get start() {
    return this.frames.length ? this.timeOf(0) : 0;
  }

  /** Seconds one frame period after the last frame. */
  get end() {
    const { length, framesPerSecond } = this.frames;
    return length ? this.timeOf(length - 1) + 1 / framesPerSecond : 0;
  }

  /** Return the seconds at which a frame is shown. @param {number} frame */
  timeOf(frame) {
    return this.frames.indexOf(frame) / this.frames.framesPerSecond;
  }

  /** Return the number of the last frame at or before a time, and how far it is to the next, 0..1. @param {number} time */
  position(time) {
    const { frames } = this;
    const sought = time * frames.framesPerSecond + ROUNDING;
    let [low, high] = [0, frames.length - 1];
    while (low < high) {
      const middle = (low + high + 1) >> 1;
      if (frames.indexOf(middle) <= sought) low = middle;
      else high = middle - 1;
    }
    if (low === frames.length - 1) return { frame: low, share: 0 };
    const [from, to] = [frames.indexOf(low), frames.indexOf(low + 1)];
    const share = (sought - ROUNDING - from) / (to - from);
    return { frame: low, share: share < ROUNDING ? 0 : Math.min(share, 1) };
  }

  /** Write the FAPs (68) and BAPs (296) shown at a time. @param {number} time @param {Float32Array} faps @param {Float64Array} baps */
  at(time, faps, baps) {
    const { frame, share } = this.position(time);
    const before = this._row(frame);
    faps.set(before.faps);
    if (before.baps) baps.set(before.baps);
    if (!share || !this.interpolate) return;
    blend(faps, baps, this._row(frame + 1), share);
  }

  /** Return the values of a frame. @param {number} at */
  _row(at) {
    const number = Math.floor(at / BLOCK);
    let block = this._blocks.get(number);
    if (!block || at - number * BLOCK >= block.count) {
      for (let earlier = this._states.length - 1; earlier < number; earlier += 1) this._resolve(earlier);
      block = this._resolve(number);
    }
    const row = at - number * BLOCK;
    return {
      faps: block.faps.subarray(row * FAPS, (row + 1) * FAPS),
      baps: block.baps && block.baps.subarray(row * BAPS, (row + 1) * BAPS),
    };
  }

  /** Resolve a block of frames from the state before it. @param {number} number */
  _resolve(number) {
    const { frames } = this;
    const face = this._states[number].face.copy();
    const body = this._states[number].body.slice();
    const first = number * BLOCK;
    const count = Math.min(BLOCK, frames.length - first);
    const block = {
      faps: new Float32Array(count * FAPS),
      baps: frames.hasBody ? new Int32Array(count * BAPS) : null,
      count,
    };
    for (let row = 0; row < count; row += 1) {
      const frame = frames.frame(first + row);
      if (frames.hasFace) face.push(frame.face, block.faps.subarray(row * FAPS, (row + 1) * FAPS));
      if (!block.baps) continue;
      if (frame.body) for (let bap = 0; bap < BAPS; bap += 1) if (frame.body.mask[bap]) body[bap] = frame.body.values[bap];
      block.baps.set(body, row * BAPS);
    }
    if (count === BLOCK) this._states[number + 1] = { face, body };
    this._blocks.delete(number);
    this._blocks.set(number, block);
    for (const old of this._blocks.keys()) if (this._blocks.size > CACHED) this._blocks.delete(old);
    return block;
  }
}

/** Return the frames of a decoded stream. @param {import("../decoder/animation.js").Animation} animation @returns {Frames} */
export function framesOf(animation) {
  return {
    length: animation.length,
    indexOf: (at) => animation.index[at],
    frame: (at) => animation.frame(at),
    hasFace: animation.hasFace,
    hasBody: animation.hasBody,
    framesPerSecond: Number(animation.rate.numerator) / Number(animation.rate.denominator),
  };
}

/** What is shown of a stream that arrives: the last seconds of it, resolved. */
export class LiveTimeline {
  /** @param {Resolver} resolver in its first state @param {number} kept seconds */
  constructor(resolver, kept = KEPT) {
    this._resolver = resolver;
    this._kept = kept;
    this._body = new Int32Array(BAPS);
    /** @type {{time: number, faps: Float32Array, baps: Int32Array}[]} */
    this._shown = [];
    this.interpolate = true;
  }

  /** Seconds of the last frame; -Infinity before the first. */
  get newest() {
    return this._shown.at(-1)?.time ?? -Infinity;
  }

  /** @param {import("../decoder/frames.js").StreamFrame[]} frames */
  push(frames) {
    for (const { time, face, body } of frames) {
      if (time <= this.newest) this._shown.length = 0; // the stream has begun again
      const faps = new Float32Array(FAPS);
      this._resolver.push(face, faps);
      if (body) for (let bap = 0; bap < BAPS; bap += 1) if (body.mask[bap]) this._body[bap] = body.values[bap];
      this._shown.push({ time, faps, baps: this._body.slice() });
    }
    while (this._shown.length > 2 && this._shown[1].time < this.newest - this._kept) this._shown.shift();
  }

  /** Write the FAPs (68) and BAPs (296) shown at a time. @param {number} time @param {Float32Array} faps @param {Float64Array} baps */
  at(time, faps, baps) {
    let place = this._shown.length - 1;
    while (place > 0 && this._shown[place].time > time) place -= 1;
    const [before, after] = [this._shown[place], this._shown[place + 1]];
    if (!before) return;
    faps.set(before.faps);
    baps.set(before.baps);
    if (after && this.interpolate) blend(faps, baps, after, Math.min(Math.max((time - before.time) / (after.time - before.time), 0), 1));
  }
}

/** Take FAPs and BAPs a share of the way to others. @param {Float32Array} faps @param {Float64Array} baps @param {{faps: Float32Array, baps: Int32Array | null}} after @param {number} share */
function blend(faps, baps, after, share) {
  for (let k = 0; k < FAPS; k += 1) faps[k] += (after.faps[k] - faps[k]) * share;
  if (!after.baps) return;
  for (let k = 0; k < BAPS; k += 1) {
    let change = after.baps[k] - baps[k];
    if (k < FIRST_SHIFT || k > LAST_SHIFT) change -= TURN * Math.round(change / TURN); // the shorter way round
    baps[k] += change * share;
  }
}
