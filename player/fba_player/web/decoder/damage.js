/** The damage that was skipped, how many frames went with it, and which planes are in doubt. */
const DOUBTFUL = 8; // planes before damage that may have been misread

/**
 * Damage that was skipped. start, stop: lost bytes of the stream. framesLost: frame periods that no plane fills, and
 * by how many that may be wrong; null if nothing says so. doubtful: planes that were returned and may be wrong, as the
 * number of the first and of that behind the last; null without any.
 * @typedef {{error: import("./errors.js").FbaError, start: number, stop: number, framesLost: number | null,
 *   uncertainty: number | null, doubtful: [number, number] | null}} Damage
 */

export class DamageLog {
  constructor() {
    /** @type {Damage[]} */
    this.damage = [];
    /** Whether the last damage is over, but no plane behind it was decoded yet. */
    this._resuming = false;
    /** First bits of the last planes: damage here would make them doubtful. @type {number[]} */
    this._recent = [];
    /** @type {number[]} */
    this._recentSkips = [];
    this._bits = 0;
    this._frames = 0;
    this._lostFrom = 0; // first byte of all damage since the last plane
  }

  get _last() {
    return this.damage[this.damage.length - 1];
  }

  /** @param {number} bit @param {number} stop bit behind the plane @param {number} skip */
  _addPlane(bit, stop, skip) {
    if (this._recent.push(bit) > DOUBTFUL) this._recent.shift();
    if (this._recentSkips.push(skip) > DOUBTFUL) this._recentSkips.shift();
    this._bits += stop - bit;
    this._frames += skip + 1;
  }

  /** Count no plane so far as doubtful: it ended where a start code begins. */
  _confirmPlanes() {
    this._recent = [];
    this._recentSkips = [];
  }

  /**
   * Add damage that planes before and behind it are not lost with.
   * @param {Damage["error"]} error @param {number} start @param {number} [stop] @param {number | null} [framesLost]
   * @param {number} [first] doubtful plane @param {number} [behind] the last
   */
  _add(error, start, stop = start, framesLost = null, first = 0, behind = 0) {
    const uncertainty = framesLost === null ? null : 0;
    this.damage.push({ error, start, stop, framesLost, uncertainty, doubtful: first < behind ? [first, behind] : null });
  }

  /** Add damage in the plane at a byte. @param {Damage["error"]} error @param {number} byte @param {number} planes before it */
  _begin(error, byte, planes) {
    if (this._resuming) this._last.framesLost = this._last.uncertainty = 0;
    else this._lostFrom = byte;
    this._add(error, byte, byte, null, planes - this._recent.length, planes);
    this._resuming = true;
    this._recent = [];
  }

  /** Set the end of the last damage. @param {number} byte */
  _end(byte) {
    this._last.start = Math.min(this._last.start, byte);
    this._last.stop = byte;
  }

  /** A plane was decoded behind the damage, or nothing follows. @param {[number, number] | null} lost frames, uncertainty */
  _resume(lost) {
    [this._last.framesLost, this._last.uncertainty] = lost ?? [null, null];
    this._resuming = false;
    this._recentSkips = [];
  }

  /** Return about how many frames were lost since the last plane, and the uncertainty. @returns {[number, number] | null} */
  _estimate() {
    if (!this._frames) return null;
    const share = (8 * Math.max(this._last.stop - this._lostFrom, 0) * this._frames) / this._bits;
    const frames = share % 2 === 0.5 ? share - 0.5 : Math.round(share); // halves go to the even number
    return [frames, 1 + Math.ceil(frames / 2) + this._recentSkips.reduce((sum, skip) => sum + skip, 0)];
  }
}
