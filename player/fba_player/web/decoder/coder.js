/**
 * The adaptive arithmetic coder of the FBA object plane (ISO/IEC 14496-2, FBA object), and its models.
 *
 * A 16-bit integer coder in the style of H.263 Annex E. All counts of a model begin at 1 with each I plane, grow with
 * each symbol of a P plane, and are halved when their total reaches 16383.
 */
import { OUT_OF_DATA, bitAt } from "./bits.js";

const QUARTER = 16384;
const HALF = 32768;
const THREE_QUARTERS = 49152;
const TOTAL_MAX = 16383;
const GUARD = 22; // zero bits in a row after which a 1 is inserted

export const UNUSED = new Uint16Array(4096); // counts before the first symbol, more than any alphabet has

/**
 * What is known of a slot since the last I plane: sizes of the alphabets in I planes and in P planes, the smallest levels,
 * the quantiser step. Of the coder in P planes: total: sum of all counts; belowUsual: of those below the symbol `_min`, which
 * is that of no change, the most frequent; added: what was added to each; tree: a Fenwick tree over that. symbol, value: of the plane that is being read. last: value of the plane before it.
 * @typedef {{_intraSize: number, _size: number, _intraMin: number, _min: number, _step: number, _total: number,
 *   _belowUsual: number, _added: Uint16Array, _tree: Uint16Array, _symbol: number, _value: number, _last: number}} Model
 */

/** Raise the count of a symbol. @param {Model} model @param {number} symbol */
export function learn(model, symbol, amount = 1) {
  const { _size: size, _added: old } = model;
  if (old === UNUSED || model._total === TOTAL_MAX) {
    model._added = new Uint16Array(size);
    model._tree = new Uint16Array(size + 1);
    model._total = size;
    model._belowUsual = model._min;
    if (old !== UNUSED) old.forEach((added, at) => learn(model, at, added >> 1)); // halve every count, rounding up
  }
  model._added[symbol] += amount;
  model._total += amount;
  if (symbol < model._min) model._belowUsual += amount;
  for (let node = symbol + 1; node <= size; node += node & -node) model._tree[node] += amount;
}

/**
 * Decode a segment. Counts do not change.
 * @param {import("./bits.js").Input} input
 * @param {(finding: string, bit: number) => never} fail
 * @param {Model[]} models of all slots: the symbols are left in them
 * @param {number[]} slots
 * @param {boolean} intra whether it is of an I plane
 */
export function decodeSegment(input, fail, models, slots, intra) {
  const data = input._data;
  const origin = 8 * input._first;
  const end = 8 * data.length;
  let bit = input._bit - origin;
  let low = 0;
  let high = 0;
  let code = 0; // so that renormalising reads the first 16 bits
  let zeros = 0;
  let taken = 0; // bits without the inserted ones
  let guardAt = -1; // `taken` at the last inserted bit
  let badGuard = 0;
  let badGuardAt = 1e9; // `taken` at the first 0 in its place
  for (let place = 0; ; place += 1) {
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
        guardAt = taken;
        if (badGuardAt > taken && bit < end && !bitAt(data, bit)) {
          badGuard = bit;
          badGuardAt = taken;
        }
        bit += 1;
        zeros = 0;
      }
      const value = bitAt(data, bit);
      bit += 1;
      zeros = value ? 0 : zeros + 1;
      code = (code << 1) | value;
      taken += 1;
    }
    if (place === slots.length) break;
    const model = models[slots[place]];
    const span = high - low + 1;
    const total = intra ? model._intraSize : model._total;
    const target = total - 1 - ((((code - low + 1) * total - 1) / span) | 0); // counted from symbol 0 upwards
    const { _added: added, _tree: tree, _size: size } = model;
    let symbol = intra ? target : model._min;
    let below = intra ? target : model._belowUsual;
    let share = 1 + (intra ? 0 : added[symbol]);
    if (target < below || target >= below + share) {
      symbol = 0;
      below = target;
      for (let step = 1 << (31 - Math.clz32(size)); step; step >>= 1) {
        const weight = step + tree[symbol + step];
        if (symbol + step <= size && weight <= below) {
          symbol += step;
          below -= weight;
        }
      }
      below = target - below;
      share = 1 + added[symbol];
    }
    model._symbol = symbol;
    high = low - 1 + (((span * (total - below)) / total) | 0);
    low += ((span * (total - below - share)) / total) | 0;
  }
  // Of the 16 bits in the register, the first two close the segment; the other 14 follow it, and so does a 1 among
  // them that was counted as inserted.
  taken -= 14;
  if (badGuardAt < taken) fail("22 zero bits without a 1", badGuard + origin);
  const after = bit - 14 - Number(guardAt >= taken);
  const closed = code >> 14 === (low < QUARTER ? 1 : 2);
  if (after > end || (!closed && bit > end)) throw OUT_OF_DATA; // with bits missing, it need not be damage
  if (!closed) fail("segment without an end", after - 2 + origin);
  input._bit = after + origin;
}
