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
    this.resuming = false;
    /** @type {number[]} */
    this._recent = []; // first bits of the last planes
    /** @type {number[]} */
    this._recentSkips = [];
    this._bits = 0;
    this._frames = 0;
    this._lostFrom = 0; // first byte of all damage since the last plane
  }

  /** Start of the first plane that would be doubtful if there were damage here. */
  get firstDoubtfulBit() {
    return this._recent.length ? this._recent[0] : null;
  }

  /** Count planes. @param {Float64Array} borders bits of the stream @param {Float64Array} skips */
  addPlanes(borders, skips) {
    const count = skips.length;
    const keep = Math.max(count - DOUBTFUL, 0);
    this._recent = [...this._recent, ...borders.subarray(keep, count)].slice(-DOUBTFUL);
    this._recentSkips = [...this._recentSkips, ...skips.subarray(keep)].slice(-DOUBTFUL);
    this._bits += borders[count] - borders[0];
    this._frames += skips.reduce((sum, skip) => sum + skip + 1, 0);
  }

  /** Count no plane so far as doubtful: it ended where a start code begins. */
  confirmPlanes() {
    this._recent = [];
    this._recentSkips = [];
  }

  /**
   * Add damage that planes before and behind it are not lost with.
   * @param {Damage["error"]} error @param {number} start
   * @param {{stop?: number, framesLost?: number, doubtful?: [number, number]}} [details]
   */
  add(error, start, { stop = start, framesLost, doubtful } = {}) {
    const uncertainty = framesLost === undefined ? null : 0;
    this.damage.push({ error, start, stop, framesLost: framesLost ?? null, uncertainty, doubtful: range(doubtful) });
  }

  /** Add damage in the plane at a byte. @param {Damage["error"]} error @param {number} byte @param {number} planes before it */
  begin(error, byte, planes) {
    if (this.resuming) Object.assign(this.last, { framesLost: 0, uncertainty: 0 });
    else this._lostFrom = byte;
    this.add(error, byte, { doubtful: [planes - this._recent.length, planes] });
    this.resuming = true;
    this._recent = [];
  }

  get last() {
    return this.damage[this.damage.length - 1];
  }

  /** Set the end of the last damage. @param {number} byte */
  end(byte) {
    Object.assign(this.last, { start: Math.min(this.last.start, byte), stop: byte });
  }

  /** A plane was decoded behind the damage, or nothing follows. @param {[number, number] | null} lost frames, uncertainty */
  resume(lost) {
    Object.assign(this.last, { framesLost: lost?.[0] ?? null, uncertainty: lost?.[1] ?? null });
    this.resuming = false;
    this._recentSkips = [];
  }

  /** Return about how many frames were lost since the last plane, and the uncertainty. @returns {[number, number] | null} */
  estimate() {
    if (!this._frames) return null;
    const bytes = Math.max(this.last.stop - this._lostFrom, 0);
    const frames = roundToEven((8 * bytes * this._frames) / this._bits);
    return [frames, 1 + Math.ceil(frames / 2) + this._recentSkips.reduce((sum, skip) => sum + skip, 0)];
  }
}

/** @param {[number, number] | undefined} planes */
const range = (planes) => (planes && planes[0] < planes[1] ? planes : null);

/** @param {number} number */
function roundToEven(number) {
  const below = Math.floor(number);
  const rest = number - below;
  return rest > 0.5 || (rest === 0.5 && below % 2) ? below + 1 : below;
}
