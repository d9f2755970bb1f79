/**
 * The adaptive arithmetic coder of the FBA object plane (ISO/IEC 14496-2, FBA object), and its models.
 *
 * A 16-bit integer coder in the style of H.263 Annex E. All counts of a model begin at 1 with each I plane, grow with
 * each symbol of a P plane, and are halved when their total reaches 16383. Stored is what was added to the counts,
 * together with a Fenwick tree over it; the symbol of no change, which is the most frequent, stays outside the tree.
 */
import { Fault, OUT_OF_DATA } from "./bits.js";

const QUARTER = 16384;
const HALF = 32768;
const THREE_QUARTERS = 49152;
const TOTAL_MAX = 16383;
const GUARD = 22; // zero bits in a row after which a 1 is inserted
export const DAMAGED = "; the stream is damaged here or before";

/** Model of the symbols of a slot: alphabets, and counts for P planes. */
export class Model {
  constructor() {
    /** Size of the alphabet in I planes. */
    this._intraSize = 1;
    this._size = this._total = 1;
    this._usual = this._belowUsual = 0;
    this._added = this._tree = new Uint16Array(0);
  }

  /** Set the alphabets, and all counts to 1. @param {number} intraSize @param {number} size @param {number} usual the symbol of no change */
  _begin(intraSize, size, usual) {
    if (this._added.length < size) {
      this._added = new Uint16Array(size);
      this._tree = new Uint16Array(size + 1);
    } else if (this._total !== this._size) {
      this._added.fill(0);
      this._tree.fill(0);
    }
    this._intraSize = intraSize;
    this._size = this._total = size;
    this._usual = this._belowUsual = usual;
  }

  /** Raise the count of a symbol. @param {number} symbol */
  _learn(symbol) {
    if (this._total === TOTAL_MAX) this._halve();
    this._added[symbol] += 1;
    this._total += 1;
    if (symbol !== this._usual) this._raise(symbol, 1);
  }

  /** @param {number} symbol @param {number} amount */
  _raise(symbol, amount) {
    if (symbol < this._usual) this._belowUsual += amount;
    for (let node = symbol + 1; node <= this._size; node += node & -node) this._tree[node] += amount;
  }

  /** Halve every count, rounding up. */
  _halve() {
    this._tree.fill(0);
    this._total = this._size;
    this._belowUsual = this._usual;
    for (let symbol = 0; symbol < this._size; symbol += 1) {
      const half = this._added[symbol] >> 1;
      this._added[symbol] = half;
      this._total += half;
      if (half && symbol !== this._usual) this._raise(symbol, half);
    }
  }
}

/**
 * Decode a segment. Models do not change.
 * @param {import("./bits.js").Bits} bits
 * @param {Model[]} models of all slots
 * @param {Int32Array} slots those of the segment are from `first` to `stop`
 * @param {number} first
 * @param {number} stop
 * @param {boolean} adaptive whether it is of a P plane
 * @param {Int32Array} symbols of all slots, filled for those of the segment
 */
export function decodeSegment(bits, models, slots, first, stop, adaptive, symbols) {
  const { _data: data, _end: end } = bits;
  let bit = bits._bit;
  let low = 0;
  let high = 0;
  let code = 0; // so that renormalising reads the first 16 bits
  let zeros = 0;
  let taken = 0; // bits without the inserted ones
  let guardAt = -1; // `taken` at the last inserted bit
  let badGuard = -1;
  let badGuardAt = 0;
  for (let position = first; ; position += 1) {
    for (;;) {
      if (high >= HALF) {
        const less = low >= HALF ? HALF : low >= QUARTER && high < THREE_QUARTERS ? QUARTER : 0;
        if (!less) break;
        low -= less;
        high -= less;
        code -= less;
      }
      low *= 2;
      high = 2 * high + 1;
      if (zeros === GUARD) {
        if (bit < end && badGuard < 0 && !((data[bit >> 3] >> (7 - (bit & 7))) & 1)) {
          badGuard = bit;
          badGuardAt = taken;
        }
        guardAt = taken;
        bit += 1;
        zeros = 0;
      }
      const value = bit < end ? (data[bit >> 3] >> (7 - (bit & 7))) & 1 : 0;
      bit += 1;
      zeros = value ? 0 : zeros + 1;
      code = 2 * code + value;
      taken += 1;
    }
    if (position === stop) break;
    const model = models[slots[position]];
    const span = high - low + 1;
    const total = adaptive ? model._total : model._intraSize;
    const target = total - 1 - ((((code - low + 1) * total - 1) / span) | 0); // counted from symbol 0 upwards
    let symbol = target;
    let below = target;
    let share = 1;
    if (adaptive) {
      symbol = model._usual;
      below = model._belowUsual;
      share = 1 + model._added[symbol];
      if (target < below || target >= below + share) {
        let remaining = target < below ? target : target - share + 1;
        symbol = 0;
        for (let step = 1 << (31 - Math.clz32(model._size)); step > 0; step >>= 1) {
          if (symbol + step > model._size) continue;
          const weight = step + model._tree[symbol + step];
          if (weight > remaining) continue;
          symbol += step;
          remaining -= weight;
        }
        below = target - remaining;
        share = 1 + model._added[symbol];
      }
    }
    symbols[slots[position]] = symbol;
    high = low - 1 + (((span * (total - below)) / total) | 0);
    low += ((span * (total - below - share)) / total) | 0;
  }
  // Of the 16 bits in the register, the first two close the segment; the other 14 follow it, and so does a 1 among
  // them that was counted as inserted.
  const used = taken - 14;
  if (badGuard >= 0 && badGuardAt < used) {
    throw new Fault(`22 zero bits are followed by another 0, expected 1${DAMAGED}`, badGuard);
  }
  const after = bit - 14 - Number(guardAt >= used);
  const closed = code >> 14 === (low < QUARTER ? 1 : 2);
  if (after > end || (!closed && bit > end)) throw OUT_OF_DATA; // with bits missing, it need not be damage
  if (!closed) {
    throw new Fault(`no bits that close the arithmetic segment stand at its end${DAMAGED}`, after - 2);
  }
  bits._bit = after;
}
