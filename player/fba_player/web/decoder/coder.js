/**
 * The adaptive arithmetic coder of the FBA object plane (ISO/IEC 14496-2, FBA object), and its models.
 *
 * A 16-bit integer coder in the style of H.263 Annex E. All counts of a model begin at 1 with each I plane, grow with
 * each symbol of a P plane, and are halved when their total reaches 16383. Stored is what was added to the counts,
 * together with a Fenwick tree over it; the symbol of no change, which is the most frequent, stays outside the tree.
 */

export const SLOTS = 372;
const ALPHABET_MAX = 3721; // -1860..1860
const STRIDE = ALPHABET_MAX + 1;
const TREE_TOP = 2048; // largest power of two within the alphabet
const QUARTER = 16384;
const HALF = 32768;
const THREE_QUARTERS = 49152;
const TOTAL_MAX = 16383;
const GUARD = 22; // zero bits in a row after which a 1 is inserted

export const OK = 0;
export const OUT_OF_DATA = 1;
export const BAD_GUARD = 2;
export const BAD_FLUSH = 3;

/** @param {Uint8Array} data @param {number} bit */
export function readBit(data, bit) {
  return (data[bit >> 3] >> (7 - (bit & 7))) & 1;
}

/** @param {Uint8Array} data @param {number} bit @param {number} count up to 31 */
export function readBits(data, bit, count) {
  let value = 0;
  for (let at = bit; at < bit + count; at += 1) value = 2 * value + readBit(data, at);
  return value;
}

/** Models of the symbols of all slots: alphabets, and counts for P planes. */
export class Models {
  constructor() {
    /** Sizes of the alphabets in I planes. */
    this.intraSize = new Int32Array(SLOTS).fill(1);
    /** Sizes of the alphabets in P planes. */
    this.size = new Int32Array(SLOTS).fill(1);
    this._usual = new Int32Array(SLOTS);
    this._total = new Int32Array(SLOTS).fill(1);
    this._belowUsual = new Int32Array(SLOTS);
    this._added = new Uint16Array(0);
    this._tree = new Uint16Array(0);
    /** Behind `decodeSegment`: the bit after the segment, or that of the damage. */
    this.place = 0;
  }

  /** Make room for the models of the first slots. @param {number} slots */
  makeRoom(slots) {
    if (this._added.length >= slots * STRIDE) return;
    const [added, tree] = [this._added, this._tree];
    this._added = new Uint16Array(slots * STRIDE);
    this._tree = new Uint16Array(slots * STRIDE);
    this._added.set(added);
    this._tree.set(tree);
  }

  /**
   * Set the alphabets of a slot, and all counts to 1.
   * @param {number} slot @param {number} intraSize @param {number} size
   * @param {number} usual the symbol of no change
   */
  begin(slot, intraSize, size, usual) {
    if (this._total[slot] !== this.size[slot]) {
      const first = slot * STRIDE;
      this._added.fill(0, first, first + this.size[slot] + 1);
      this._tree.fill(0, first, first + this.size[slot] + 1);
    }
    this.intraSize[slot] = intraSize;
    this.size[slot] = this._total[slot] = size;
    this._usual[slot] = this._belowUsual[slot] = usual;
  }

  /**
   * Decode the segment at a bit; return the status. Models do not change.
   * @param {Uint8Array} data valid up to the bit `end`
   * @param {number} bit
   * @param {number} end
   * @param {Int32Array} slots
   * @param {number} first position of the segment's first slot
   * @param {number} stop
   * @param {boolean} adaptive whether it is of a P plane
   * @param {Int32Array} symbols filled from `first` to `stop`
   */
  decodeSegment(data, bit, end, slots, first, stop, adaptive, symbols) {
    const totals = adaptive ? this._total : this.intraSize;
    const [added, tree] = [this._added, this._tree];
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
          if (low >= HALF) {
            low -= HALF;
            high -= HALF;
            code -= HALF;
          } else if (low >= QUARTER && high < THREE_QUARTERS) {
            low -= QUARTER;
            high -= QUARTER;
            code -= QUARTER;
          } else break;
        }
        low = 2 * low;
        high = 2 * high + 1;
        if (zeros === GUARD) {
          if (bit < end && badGuard < 0 && !readBit(data, bit)) {
            badGuard = bit;
            badGuardAt = taken;
          }
          guardAt = taken;
          bit += 1;
          zeros = 0;
        }
        const value = bit < end ? readBit(data, bit) : 0;
        bit += 1;
        zeros = value ? 0 : zeros + 1;
        code = 2 * code + value;
        taken += 1;
      }
      if (position === stop) break;
      const slot = slots[position];
      const span = high - low + 1;
      const total = totals[slot];
      const target = total - 1 - ((((code - low + 1) * total - 1) / span) | 0); // counted from symbol 0 upwards
      let symbol = target;
      let below = target;
      let share = 1;
      if (adaptive) {
        const row = slot * STRIDE;
        symbol = this._usual[slot];
        below = this._belowUsual[slot];
        share = 1 + added[row + symbol];
        if (target < below || target >= below + share) {
          const behind = target < below ? 0 : share - 1;
          let remaining = target - behind;
          symbol = 0;
          const size = this.size[slot];
          for (let step = TREE_TOP; step > 0; step >>= 1) {
            const node = symbol + step;
            if (node > size) continue;
            const weight = step + tree[row + node];
            if (weight <= remaining) {
              symbol = node;
              remaining -= weight;
            }
          }
          below = target - remaining;
          share = 1 + added[row + symbol];
        }
      }
      symbols[position] = symbol;
      const above = total - below;
      high = low - 1 + (((span * above) / total) | 0);
      low = low + (((span * (above - share)) / total) | 0);
    }
    // Of the 16 bits in the register, the first two close the segment; the other 14 follow it, and so does a 1 among
    // them that was counted as inserted.
    const used = taken - 14;
    if (badGuard >= 0 && badGuardAt < used) {
      this.place = badGuard;
      return BAD_GUARD;
    }
    const after = bit - 14 - (guardAt >= used ? 1 : 0);
    this.place = after;
    if (after > end) return OUT_OF_DATA;
    if (code >> 14 !== (low < QUARTER ? 1 : 2)) {
      this.place = after - 2;
      return bit > end ? OUT_OF_DATA : BAD_FLUSH; // with bits missing, this need not be damage
    }
    return OK;
  }

  /** Raise the counts of the symbols of a P plane. @param {Int32Array} slots @param {number} first @param {number} stop @param {Int32Array} symbols */
  learn(slots, first, stop, symbols) {
    for (let position = first; position < stop; position += 1) {
      const slot = slots[position];
      const symbol = symbols[position];
      if (this._total[slot] === TOTAL_MAX) this._halve(slot);
      this._added[slot * STRIDE + symbol] += 1;
      this._total[slot] += 1;
      if (symbol !== this._usual[slot]) {
        if (symbol < this._usual[slot]) this._belowUsual[slot] += 1;
        this._raise(slot, symbol, 1);
      }
    }
  }

  /** @param {number} slot @param {number} symbol @param {number} amount */
  _raise(slot, symbol, amount) {
    const row = slot * STRIDE;
    for (let node = symbol + 1; node <= this.size[slot]; node += node & -node) this._tree[row + node] += amount;
  }

  /** Halve every count of a slot, rounding up. @param {number} slot */
  _halve(slot) {
    const row = slot * STRIDE;
    const [size, usual] = [this.size[slot], this._usual[slot]];
    this._tree.fill(0, row, row + size + 1);
    this._total[slot] = size;
    this._belowUsual[slot] = usual;
    for (let symbol = 0; symbol < size; symbol += 1) {
      const half = this._added[row + symbol] >> 1;
      this._added[row + symbol] = half;
      this._total[slot] += half;
      if (half && symbol !== usual) {
        if (symbol < usual) this._belowUsual[slot] += half;
        this._raise(slot, symbol, half);
      }
    }
  }
}
