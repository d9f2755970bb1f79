/** One frame rate, and its indices of frames, for a stream that may change its rate and set its clock. */
import { Fraction, greatestDivisor } from "./fraction.js";

/** @typedef {import("./clock.js").Span} Span */

const COMMON_RATE_MAX = Fraction.of(1_000_000); // highest rate that is chosen to make all times exact
const HALF = Fraction.of(1, 2);

/** Collects the times of blocks in the order of the stream. */
export class TimeBase {
  constructor() {
    /** @type {{first: number, firstIndex: number, start: Fraction, span: Span}[]} */
    this._runs = [];
    /** @type {Fraction[]} */
    this._rates = [];
    /** Lowest rate at which all times are exact; null beyond a limit. @type {Fraction | null} */
    this._exact = null;
    this._index = new Float64Array(1024);
    this._count = 0;
  }

  /** @param {Float64Array} index @param {Span} span */
  add(index, span) {
    const last = this._runs[this._runs.length - 1];
    if (!last || (last.span !== span && !(span.rate.equals(last.span.rate) && span.time(index[0]).equals(last.span.time(index[0]))))) {
      const start = span.time(index[0]);
      this._runs.push({ first: this._count, firstIndex: index[0], start, span });
      if (!this._rates.some((rate) => rate.equals(span.rate))) this._rates.push(span.rate);
      if (!this._count) this._exact = span.rate;
      for (const rate of start.numerator ? [span.rate, Fraction.of(1).over(start)] : [span.rate]) this._makeExact(rate);
    }
    if (this._count + index.length > this._index.length) {
      const old = this._index;
      this._index = new Float64Array(Math.max(2 * old.length, this._count + index.length));
      this._index.set(old);
    }
    this._index.set(index, this._count);
    this._count += index.length;
  }

  /** Frames per second: the lowest rate at which all frames have whole indices, or else the highest of the stream's. */
  get rate() {
    const highest = this._rates.reduce((best, rate) => (rate.compare(best) > 0 ? rate : best));
    return this._rates.length > 1 ? (this._exact ?? highest) : highest;
  }

  /** Return the index of each frame. */
  index() {
    const index = this._index.slice(0, this._count);
    if (this._rates.length < 2) return index;
    const { rate } = this;
    let following = 0;
    this._runs.forEach((run, number) => {
      const stop = this._runs[number + 1]?.first ?? this._count;
      const offset = run.start.times(rate).plus(HALF);
      const factor = rate.over(run.span.rate);
      const place = (/** @type {number} */ at) =>
        offset.plus(factor.times(Fraction.of(this._index[at] - run.firstIndex))).floor();
      const late = Math.max(following - place(run.first), 0);
      for (let at = run.first; at < stop; at += 1) index[at] = place(at) + late;
      following = index[stop - 1] + 1;
    });
    return index;
  }

  /** Make `_exact` a multiple of a rate. @param {Fraction} rate */
  _makeExact(rate) {
    if (!this._exact) return;
    const [a, b] = [this._exact.numerator, rate.numerator];
    const common = new Fraction(
      (a / greatestDivisor(a, b)) * b,
      greatestDivisor(this._exact.denominator, rate.denominator),
    );
    this._exact = common.compare(COMMON_RATE_MAX) <= 0 ? common : null;
  }
}
