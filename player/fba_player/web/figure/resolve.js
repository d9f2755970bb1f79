/** What a face shows: unsent FAPs filled in, visemes and expressions turned into low-level FAPs; as `fba.face.resolve`. */
import { FAP_GROUPS } from "../decoder/tables.js";
import { checkedFap, checkedList, checkedNumber, refuse } from "./container.js";
import { DONORS } from "./tables.js";

/**
 * A term of a function: its factor, [number, exponent] of what it multiplies, and [number, value] of a condition. Numbers:
 * 0 to 67 for the FAPs, 68 to 70 select1, select2, blend, 71 to 74 select1, intensity1, select2, intensity2.
 * @typedef {[number, [number, number][], [number, number] | null]} Term
 * @typedef {{column: number, source: number[], numerator: Term[], denominator: Term[]}} Link
 * @typedef {import("../decoder/frames.js").FaceFrame} FaceFrame
 */

const FAPS = 68;
const MOST = 63;
const FIELDS = [0, 1, 2];
const EXPRESSION_FIELDS = [0, 1, 2, 3];
const LARGEST = 2 ** 31 - 1;
const GROUP_OF = Uint8Array.from(FAP_GROUPS, (digit) => parseInt(digit, 36) + 1);
/** Groups of the mouth, which the definition of a viseme holds: jaw and inner lip, tongue, outer lip. */
const MOUTH = [2, 6, 8];

/** How a face fills in what is not sent: definitions of visemes and expressions, and its interpolation table. */
export class Rules {
  /** @param {Record<string, any>} header the face of a model */
  constructor(header) {
    const [visemes, expressions] = checkedList(header.definitions, "definitions");
    this.visemes = definitions(visemes, 15);
    this.expressions = definitions(expressions, 7);
    /** @type {Link[]} */
    this.links = checkedList(header.fit, "links of the interpolation table").map(checkedLink);
  }
}

/** @param {unknown} listed @param {number} count @returns {Float32Array[]} */
function definitions(listed, count) {
  const rows = Array.from({ length: count }, () => new Float32Array(FAPS));
  checkedList(listed, "definitions").forEach((entry, at) => {
    if (at + 1 >= count) refuse(`defines more than ${count - 1} visemes or expressions`);
    for (const [fap, value] of Object.entries(entry)) {
      const column = checkedFap(fap);
      if (column > 1) rows[at + 1][column] = checkedNumber(value, "a definition");
    }
  });
  return rows;
}

/** @param {any} link @returns {Link} */
function checkedLink(link) {
  const terms = (/** @type {unknown} */ listed) =>
    checkedList(listed, "terms").map(([factor, powers, when]) => {
      checkedNumber(factor, "a factor of the interpolation table");
      for (const [number, exponent] of powers) checkedNumber(number, "a number of the interpolation table", 75) + checkedNumber(exponent, "an exponent", 16);
      if (when) checkedNumber(when[0], "a condition of the interpolation table", 75);
      return /** @type {Term} */ ([factor, powers, when]);
    });
  for (const column of checkedList(link.source, "sources")) checkedNumber(column, "a source of the interpolation table", FAPS);
  return { column: checkedFap(link.fap), source: link.source, numerator: terms(link.numerator), denominator: terms(link.denominator) };
}

/** Turns what is sent, frame by frame, into the FAPs that a face shows. */
export class Resolver {
  /** @param {Rules} rules */
  constructor(rules) {
    this._rules = rules;
    this._visemes = rules.visemes;
    this._expressions = rules.expressions;
    this._last = new Int32Array(FAPS);
    this._sent = new Uint8Array(FAPS);
    this._interpolated = new Uint8Array(FAPS);
    this._viseme = [0, 0, 0, 0];
    this._expression = [0, 0, 0, 0, 0, 0];
    this._values = new Float64Array(FAPS);
    this._known = new Uint8Array(FAPS);
    this._filled = { values: new Float64Array(FAPS), known: new Uint8Array(FAPS) };
    this._high = new Float64Array(FAPS);
    this._derived = new Uint8Array(FAPS);
  }

  /** Return an independent resolver in the same state. */
  copy() {
    const other = new Resolver(this._rules);
    other._visemes = this._visemes;
    other._expressions = this._expressions;
    other._last.set(this._last);
    other._sent.set(this._sent);
    other._interpolated.set(this._interpolated);
    other._viseme = this._viseme;
    other._expression = this._expression;
    return other;
  }

  /**
   * Take the next frame; write the FAPs that are shown to 68 numbers, the first two 0.
   * @param {FaceFrame | null} face @param {Float32Array | Float64Array} out
   */
  push(face, out) {
    if (face) this._hold(face);
    const { _sent: ever, _interpolated: asked, _last: last, _values: values, _known: known, _filled: filled, _high: high } = this;
    for (let fap = 0; fap < FAPS; fap += 1) {
      known[fap] = ever[fap] & (1 - asked[fap]);
      values[fap] = known[fap] ? last[fap] : 0;
    }
    this._derived.fill(0);
    this._interpolate();
    fill(values, known, filled.values, filled.known);
    this._mix();
    const always = this._expression[4] === 0;
    for (let fap = 2; fap < FAPS; fap += 1) {
      let value = filled.values[fap];
      let determined = filled.known[fap];
      if (asked[fap] && ever[fap] && !determined && high[fap] === 0 && !this._defines(fap)) {
        value = last[fap];
        determined = 1;
      }
      const replaces = always || this._derived[donorOf(fap, known)];
      out[fap] = value + (determined && replaces ? 0 : high[fap]);
    }
    out[0] = out[1] = 0;
  }

  /** @param {FaceFrame} face */
  _hold({ values, mask, interpolated, viseme, expression }) {
    let empty = true;
    for (let fap = 0; fap < FAPS; fap += 1) {
      if (mask[fap]) {
        this._last[fap] = values[fap];
        this._sent[fap] = 1;
      }
      if (mask[fap] || interpolated[fap]) empty = false;
    }
    if (!empty) this._interpolated.set(interpolated);
    if (mask[0]) this._viseme = viseme;
    if (mask[1]) this._expression = expression;
    if (mask[0] && viseme[3] === 1) this._visemes = redefined(this._visemes, viseme[0], values, mask, true);
    if (mask[1] && expression[5] === 1) this._expressions = redefined(this._expressions, expression[0], values, mask, false);
  }

  /** Whether a viseme or expression that was ever sent has a definition with a FAP. @param {number} fap */
  _defines(fap) {
    const { visemes, expressions } = this._rules;
    const any = (/** @type {Float32Array[]} */ rows) => rows.some((row) => row[fap] !== 0);
    return (this._sent[0] === 1 && any(visemes)) || (this._sent[1] === 1 && any(expressions));
  }

  /** Add up the FAPs of the viseme and the expression in force. */
  _mix() {
    const [select1, select2, blend] = this._viseme;
    const [first, intensity1, second, intensity2] = this._expression;
    const share = clipped(blend) / MOST;
    const one = clipped(intensity1) / MOST;
    const two = clipped(intensity2) / MOST;
    const rest = first === second ? Math.min(two, 1 - one) : two; // one expression twice: never above its full intensity
    const [a, b] = [this._visemes[select1], this._visemes[select2]];
    const [c, d] = [this._expressions[first], this._expressions[second]];
    for (let fap = 0; fap < FAPS; fap += 1) {
      this._high[fap] = at(a, fap) * share + at(b, fap) * (1 - share) + at(c, fap) * one + at(d, fap) * rest;
    }
  }

  /** Compute unknown FAPs by the interpolation table. */
  _interpolate() {
    const { _values: values, _known: known, _derived: derived } = this;
    for (const { column, source, numerator, denominator } of this._rules.links) {
      if (known[column] || !source.every((one) => known[one])) continue;
      const divisor = denominator.length ? this._sum(denominator) : 1;
      const dividend = this._sum(numerator);
      const result = dividend / divisor;
      if (!Number.isFinite(dividend) || !Number.isFinite(divisor) || divisor === 0 || !(Math.abs(result) <= LARGEST)) continue;
      values[column] = result;
      known[column] = 1;
      derived[column] = Number(source.some((one) => one < 2 || derived[one]));
    }
  }

  /** @param {Term[]} terms */
  _sum(terms) {
    let total = 0;
    for (const [factor, powers, when] of terms) {
      if (when && this._number(when[0]) !== when[1]) continue;
      total += powers.reduce((product, [number, exponent]) => product * this._number(number) ** exponent, factor);
    }
    return total;
  }

  /** @param {number} number */
  _number(number) {
    if (number < FAPS) return this._values[number];
    const field = number - FAPS;
    return clipped(field < FIELDS.length ? this._viseme[field] : this._expression[field - FIELDS.length]);
  }
}

/** @param {Float32Array | undefined} row @param {number} fap */
function at(row, fap) {
  return row ? row[fap] : 0;
}

/** @param {number} amount */
function clipped(amount) {
  return Math.min(Math.max(amount, 0), MOST);
}

/** Return the column that a FAP takes its value from: itself, or the first known of those that it copies. @param {number} fap @param {Uint8Array} known */
function donorOf(fap, known) {
  if (known[fap]) return fap;
  for (const donors of DONORS) if (known[donors[fap]]) return donors[fap];
  return fap;
}

/** Copy unsent FAPs from their mates. @param {ArrayLike<number>} values @param {Uint8Array} sent @param {Float32Array | Float64Array} filled @param {Uint8Array} known */
function fill(values, sent, filled, known) {
  for (let fap = 0; fap < FAPS; fap += 1) {
    const donor = donorOf(fap, sent);
    filled[fap] = values[donor];
    known[fap] = sent[donor];
  }
}

/**
 * Return definitions, that of one select replaced by the FAPs of a frame.
 * @param {Float32Array[]} rows @param {number} select @param {Int32Array} values @param {Uint8Array} mask @param {boolean} mouth whether only the mouth's FAPs count
 */
function redefined(rows, select, values, mask, mouth) {
  const stored = mask.map((sent, fap) => Number(sent && (mouth ? MOUTH.includes(GROUP_OF[fap]) : GROUP_OF[fap] > 1)));
  if (!(select > 0 && select < rows.length) || !stored.some((one) => one)) return rows;
  const row = new Float32Array(FAPS);
  fill(values.map((value, fap) => (stored[fap] ? value : 0)), stored, row, new Uint8Array(FAPS));
  return rows.map((old, at) => (at === select ? row : old));
}
