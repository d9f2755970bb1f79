/** FAPs and BAPs of an animation at any time, as `fba_player.playback.Timeline` gives them. */
import { Resolver } from "./resolve.js";

/** @typedef {import("../decoder/animation.js").Animation} Animation */
/** @typedef {{faps: Float32Array, baps: Int32Array}} Block values of some frames, one after the other */

const FAPS = 68;
const BAPS = 296;
const BLOCK = 2048; // frames resolved at once
const CACHED = 4;
const ROUNDING = 1e-6; // a time this close to that of a frame, in frames, is the frame's
const TURN = (2 * Math.PI) / 1e-5; // a full turn in units of a BAP
const SHIFTS = [180, 183]; // columns of the BAPs that are millimetres, from and to

/**
 * Values of an animation at any time: those of a frame before the first and after the last, and in between interpolated
 * ones, each angle the shorter way round.
 */
export class Timeline {
  /** @param {Animation} animation with at least one frame @param {import("./resolve.js").Rules} rules of the face that shows it */
  constructor(animation, rules) {
    this.animation = animation;
    this._rate = Number(animation.rate.numerator) / Number(animation.rate.denominator);
    /** State before each block that was resolved, and before the next. */
    this._states = [{ resolver: new Resolver(rules), baps: new Int32Array(BAPS) }];
    /** @type {Map<number, Block>} */
    this._blocks = new Map();
  }

  /** Seconds of the first frame. */
  get start() {
    return this.animation.time(0);
  }

  /** Seconds one frame period after the last frame. */
  get end() {
    return this.animation.time(this.animation.length - 1) + 1 / this._rate;
  }

  /** Return the frames before and after a time in seconds, and the share of the latter. @param {number} time @returns {[number, number, number]} */
  position(time) {
    const { index, length } = this.animation;
    const exact = time * this._rate;
    const at = Math.abs(exact - Math.round(exact)) < ROUNDING ? Math.round(exact) : exact;
    let [low, high] = [0, length];
    while (high - low > 1) {
      const middle = (low + high) >> 1;
      if (index[middle] <= at) low = middle;
      else high = middle;
    }
    const after = Math.min(low + 1, length - 1);
    return [low, after, Math.min(Math.max((at - index[low]) / Math.max(index[after] - index[low], 1), 0), 1)];
  }

  /** Write the FAPs that are shown at a time in seconds to 68 numbers. @param {number} time @param {Float32Array | Float64Array} out */
  faps(time, out) {
    const [before, after, share] = this.position(time);
    const { faps: from } = this._block(before);
    const first = FAPS * (before % BLOCK);
    for (let fap = 0; fap < FAPS; fap += 1) out[fap] = from[first + fap];
    if (share === 0) return out;
    const { faps: to } = this._block(after);
    const second = FAPS * (after % BLOCK);
    for (let fap = 0; fap < FAPS; fap += 1) out[fap] += (to[second + fap] - out[fap]) * share;
    return out;
  }

  /** Write the BAPs that are shown at a time in seconds to 296 numbers. @param {number} time @param {Float64Array} out */
  baps(time, out) {
    const [before, after, share] = this.position(time);
    const { baps: from } = this._block(before);
    const first = BAPS * (before % BLOCK);
    for (let bap = 0; bap < BAPS; bap += 1) out[bap] = from[first + bap];
    if (share === 0) return out;
    const { baps: to } = this._block(after);
    const second = BAPS * (after % BLOCK);
    for (let bap = 0; bap < BAPS; bap += 1) {
      let change = to[second + bap] - out[bap];
      if (bap < SHIFTS[0] || bap >= SHIFTS[1]) change -= TURN * Math.round(change / TURN);
      out[bap] += change * share;
    }
    return out;
  }

  /** Return the block of a frame. @param {number} frame @returns {Block} */
  _block(frame) {
    const number = Math.floor(frame / BLOCK);
    const cached = this._blocks.get(number);
    if (cached) return cached;
    for (let earlier = this._states.length - 1; earlier < number; earlier += 1) this._resolve(earlier);
    const block = this._resolve(number);
    this._blocks.set(number, block);
    for (const oldest of this._blocks.keys()) {
      if (this._blocks.size <= CACHED) break;
      this._blocks.delete(oldest);
    }
    return block;
  }

  /** Resolve a block whose state before is known. @param {number} number @returns {Block} */
  _resolve(number) {
    const start = number * BLOCK;
    const count = Math.min(this.animation.length - start, BLOCK);
    const { hasFace } = this.animation;
    const before = this._states[number];
    const resolver = before.resolver.copy();
    const held = before.baps.slice();
    const block = { faps: new Float32Array(FAPS * count), baps: new Int32Array(BAPS * count) };
    for (let at = 0; at < count; at += 1) {
      const { face, body } = this.animation.frame(start + at);
      if (hasFace) resolver.push(face, block.faps.subarray(FAPS * at, FAPS * (at + 1)));
      if (body) for (let bap = 0; bap < BAPS; bap += 1) if (body.mask[bap]) held[bap] = body.values[bap];
      block.baps.set(held, BAPS * at);
    }
    this._states[number + 1] = { resolver, baps: held };
    return block;
  }
}
