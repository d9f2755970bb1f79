/** Times of planes from frame rate, skips and time codes, as exact fractions; behind damage the most likely ones. */
import { FbaError } from "./errors.js";
import { Fraction, greatestDivisor } from "./fraction.js";

/** @typedef {import("./planes.js").TimeCode} TimeCode */

const BELIEVED_JUMP = 60; // seconds that a time code may jump ahead without other damage
const REPEATED_RATES = 2; // I planes with the same rate behind which another rate in one of them is damage
const MOST_CYCLE = 2; // intervals that repeat: half a second at 25 frames/s is 13 and 12 frames in turn
const COMMON_RATE_MAX = 1e6; // highest rate that is chosen to make all times exact

/** A span of frames with one rate: the frame `index` is shown at anchor + (index - anchorIndex) / rate seconds. */
export class Span {
  /** @param {Fraction} rate @param {Fraction} anchor @param {number} anchorIndex */
  constructor(rate, anchor, anchorIndex) {
    this._rate = rate;
    this._anchor = anchor;
    this._anchorIndex = anchorIndex;
  }

  /** Return the seconds at which a frame is shown. @param {number} index */
  _time(index) {
    return this._anchor.plus(new Fraction(index - this._anchorIndex).over(this._rate));
  }
}

/** @param {Fraction} one @param {Fraction | null | undefined} other */
const equal = (one, other) => other != null && one.compare(other) === 0;

/**
 * Gives planes their times, and tells the log of damage how many frames were lost.
 *
 * A time code sets the clock. One that names the very frame that comes next anyway leaves it alone: codes are whole
 * seconds, and at a rate such as 30000/1001 hardly a frame lies on one.
 */
export class Clock {
  /** @param {import("./damage.js").DamageLog | null} log null where the first damage is an error */
  constructor(log) {
    this._log = log;
    /** Whether frames may have lower indices than misread ones before. */
    this._mayStepBack = false;
    this._catchingUp = false;
    this._following = 0; // index behind that of the last frame
    this._index = 0; // of the next plane
    /** @type {Span | null} */
    this._span = null;
    this._objectIndex = 0;
    this._agreements = 0; // time codes that the count of planes agreed with
    this._lastJump = 0;
    this._codedIndex = -1; // of the last plane whose time code was used
    this._offset = NaN; // frames from the count to the last time code that was refused
    this._repeatedRates = 0;
    /** @type {Fraction | null} */
    this._doubtedRate = null;
    this._restarts = new RestartPoints();
  }

  _beginObject() {
    this._objectIndex = this._index;
  }

  /**
   * Apply the frame rate and the time code of an I plane; return warnings.
   * @param {import("./planes.js").Plane} header @param {boolean} startCode whether a start code stands before it
   * @param {number} plane @param {number} bit both in the stream
   */
  _beginIntra({ rate: stated, timeCode: code }, startCode, plane, bit) {
    const log = this._log;
    const behindLoss = log?._resuming ?? false;
    const lost = log && behindLoss ? this._skipLost(log, code) : null;
    const [agreed, before] = [this._agreements, this._span?._rate];
    const now = this._span?._time(this._index) ?? new Fraction(0);
    /** @type {string[]} */
    const warnings = [];
    const refused = [];
    let rate = stated ?? before;
    if (!rate) {
      rate = new Fraction(25);
      warnings.push(`no frame rate; ${rate} frames/s assumed`);
    }
    if (log && stated && this._doubtsRate(rate, before) && before) {
      refused.push(`frame rate ${rate} in place of ${before}: not used`);
      rate = before;
    }
    const sameRate = equal(rate, before);
    if (!sameRate) {
      if (before) warnings.push(`frame rate ${rate} in place of ${before}`);
      const exact = now.times(rate);
      this._index = exact.floor() + Number(exact.denominator > 1n);
      this._span = new Span(rate, now, this._index);
    }
    /** Frames by which the time code exceeds the count of planes. @type {number | null} */
    let jump = null;
    if (code) {
      const seconds = new Fraction(code.seconds);
      const ahead = seconds.compare(now) >= 0;
      let nearest = seconds.times(rate).floor(1n);
      if (!code.marker) warnings.push(`time code ${code.text} with marker bit 0: not used`);
      else if (before && nearest === this._index) {
        jump = 0;
        this._agreements += 1;
      } else if (!ahead && !(log && this._canGoBack(nearest))) {
        warnings.push(`time code ${code.text} before the last plane: not used`);
      } else if (log && this._goesTooFar(nearest, rate)) {
        refused.push(`time code ${code.text} far ahead of the planes: not used`);
      } else {
        if (ahead) nearest = Math.max(nearest, this._index);
        jump = nearest - this._index;
        this._index = nearest;
        this._span = new Span(rate, seconds, nearest);
      }
      if (jump !== null) [this._lastJump, this._codedIndex] = [jump, this._index];
    }
    const moved = jump ?? 0;
    if (startCode) {
      if (!sameRate) this._restarts = new RestartPoints();
      this._restarts._add(this._index, behindLoss);
    }
    if (!sameRate) this._catchingUp = false; // indices of another rate
    else if (moved < 0) this._catchingUp = !this._mayStepBack;
    if (log) {
      const report = (/** @type {string} */ finding, /** @type {number | null} */ framesLost = null) => {
        const byte = Math.floor(bit / 8);
        log._add(new FbaError("damage", finding, plane, bit), byte, byte, framesLost);
      };
      if (behindLoss) log._resume(jump === null ? lost : [Math.max(jump, 0), 0]);
      else if (moved < 0 || (agreed && moved)) {
        const what = moved > 0 ? "frames missing" : "frames too many";
        report(`time code ${code?.text}: ${what} before it: ${Math.abs(moved)}`, Math.max(moved, 0));
      }
      if (refused.length) report(refused[refused.length - 1]);
    }
    return warnings;
  }

  /** Return the index and the span of the next plane. @param {number} skip frames behind it */
  _next(skip) {
    this._catchingUp &&= this._following > this._index;
    const index = this._catchingUp ? this._following : this._index;
    this._index += skip + 1;
    this._following = index + 1;
    return { index, span: /** @type {Span} */ (this._span) };
  }

  /** @param {number} index */
  _canGoBack(index) {
    const undone = this._lastJump > 0 && index === this._index - this._lastJump;
    return this._isConfirmed(index) || index > this._codedIndex || undone;
  }

  /** @param {number} index @param {Fraction} rate */
  _goesTooFar(index, rate) {
    const far = this._agreements > 0 && index - this._index > BELIEVED_JUMP * rate.valueOf();
    return !this._isConfirmed(index) && far;
  }

  /** Whether a frame is as far from the count as the last that was compared. @param {number} index */
  _isConfirmed(index) {
    const before = this._offset;
    this._offset = index - this._index;
    return this._offset === before && index >= this._objectIndex;
  }

  /** @param {Fraction} rate @param {Fraction | undefined} before */
  _doubtsRate(rate, before) {
    const [repeated, doubted] = [this._repeatedRates, this._doubtedRate];
    this._doubtedRate = rate;
    if (equal(rate, before)) this._repeatedRates += 1;
    return !equal(rate, before) && !equal(rate, doubted) && repeated >= REPEATED_RATES;
  }

  /** Leave out as many frames as seem lost; return their number and its uncertainty. @param {import("./damage.js").DamageLog} log @param {TimeCode | null} code */
  _skipLost(log, code) {
    const lost = log._estimate();
    if (!lost || code?.marker) return lost;
    const expected = this._restarts._nearest(this._index + lost[0]) - this._index;
    const regular = expected >= 0;
    if (regular) lost[0] = expected;
    // In a stream with time codes, the next one sets the clock; until then it must not be ahead.
    this._index += Math.max(lost[0] - (this._agreements && !regular ? lost[1] : 0), 0);
    return lost;
  }
}

/** Intervals between I planes behind start codes, at which decoding can go on behind damage; they predict the next. */
class RestartPoints {
  constructor() {
    this._last = NaN;
    /** @type {number[]} */
    this._intervals = [];
  }

  /** @param {number} index @param {boolean} behindLoss whether others before it may have been lost */
  _add(index, behindLoss) {
    if (!(this._last >= 0)) this._last = index;
    else if (!behindLoss) this._intervals.push(index - this._last);
    else {
      const [cycle, place] = [this._cycle(), this._upcoming(index).indexOf(index)];
      if (place < 0) this._intervals = [];
      else this._intervals.push(...cycle.slice(0, (place % cycle.length) + 1));
    }
    this._intervals = this._intervals.slice(-2 * MOST_CYCLE);
    this._last = index;
  }

  /** Return the expected restart point nearest to an index; NaN where they are irregular. @param {number} index */
  _nearest(index) {
    const distance = (/** @type {number} */ point) => Math.abs(point - index);
    return this._upcoming(index).reduce((best, point) => (distance(point) >= distance(best) ? best : point), NaN);
  }

  /** Return the intervals that repeat, beginning with the next. */
  _cycle() {
    const all = this._intervals;
    for (let count = 1; count <= MOST_CYCLE && 2 * count <= all.length; count += 1) {
      const last = all.slice(-count);
      if (last.every((interval, place) => interval === all[all.length - 2 * count + place])) return last;
    }
    return [];
  }

  /** Return restart points that are expected around an index. @param {number} index */
  _upcoming(index) {
    const cycle = this._cycle();
    const whole = cycle.reduce((sum, interval) => sum + interval, 0);
    let point = this._last + Math.max(Math.floor((index - this._last) / whole) - 1, 0) * whole;
    return [...cycle, ...cycle, ...cycle].map((interval) => (point += interval));
  }
}

/**
 * Return one rate and the indices of planes at it, for a stream that may change its rate and set its clock: the lowest
 * rate at which all planes have whole indices, or else the highest of the stream's.
 * @param {{index: number, span: Span}[]} planes
 */
export function commonTimes(planes) {
  /** @type {{first: number, index: number, start: Fraction, span: Span}[]} */
  const runs = [];
  let highest = planes[0].span._rate;
  /** @type {Fraction | null} */
  let exact = highest;
  planes.forEach(({ index, span }, first) => {
    const last = runs[runs.length - 1];
    if (last?.span === span) return;
    const start = span._time(index);
    if (last && equal(span._rate, last.span._rate) && equal(start, last.span._time(index))) return;
    runs.push({ first, index, start, span });
    if (span._rate.compare(highest) > 0) highest = span._rate;
    for (const { numerator, denominator } of start.numerator ? [span._rate, new Fraction(1).over(start)] : [span._rate]) {
      if (!exact) return;
      const multiple = (exact.numerator / greatestDivisor(exact.numerator, numerator)) * numerator;
      exact = new Fraction(multiple, greatestDivisor(exact.denominator, denominator));
      if (exact.valueOf() > COMMON_RATE_MAX) exact = null;
    }
  });
  const several = runs.some((run) => !equal(run.span._rate, highest));
  if (!several) return { rate: highest, index: Float64Array.from(planes, (plane) => plane.index) };
  const rate = exact ?? highest;
  const index = new Float64Array(planes.length);
  let following = 0;
  runs.forEach((run, number) => {
    const stop = runs[number + 1]?.first ?? planes.length;
    const factor = rate.over(run.span._rate);
    const offset = run.start.times(rate);
    const late = Math.max(following - offset.floor(1n), 0);
    for (let at = run.first; at < stop; at += 1) {
      index[at] = offset.plus(factor.times(new Fraction(planes[at].index - run.index))).floor(1n) + late;
    }
    following = index[stop - 1] + 1;
  });
  return { rate, index };
}
