/** Times of planes from frame rate, skips and time codes, as exact fractions; behind damage the most likely ones. */
import { FbaError } from "./errors.js";
import { Fraction } from "./fraction.js";

/** @typedef {import("./header.js").TimeCode} TimeCode */

const BELIEVED_JUMP = Fraction.of(60); // seconds that a time code may jump ahead without other damage
const REPEATED_RATES = 2; // I planes with the same rate behind which another rate in one of them is damage
const DEFAULT_RATE = Fraction.of(25);
const HALF = Fraction.of(1, 2);
const MOST_CYCLE = 2; // intervals that repeat: half a second at 25 frames/s is 13 and 12 frames in turn

/** A span of frames with one rate: the frame `index` is shown at anchor + (index - anchorIndex) / rate seconds. */
export class Span {
  /** @param {Fraction} rate @param {Fraction} anchor @param {number} anchorIndex */
  constructor(rate, anchor, anchorIndex) {
    this.rate = rate;
    this.anchor = anchor;
    this.anchorIndex = anchorIndex;
  }

  /** Return the seconds at which a frame is shown. @param {number} index */
  time(index) {
    return this.anchor.plus(Fraction.of(index - this.anchorIndex).over(this.rate));
  }
}

/** @param {TimeCode} code */
const secondsOf = (code) => (code.hours * 60 + code.minutes) * 60 + code.seconds;
/** @param {TimeCode} code */
const textOf = (code) =>
  `${code.hours}:${String(code.minutes).padStart(2, "0")}:${String(code.seconds).padStart(2, "0")}`;

/**
 * The times of planes: `index` and `span` of the next one.
 *
 * A time code sets the clock. One that names the very frame that comes next anyway leaves it alone: codes are whole
 * seconds, and at a rate such as 30000/1001 hardly a frame lies on one.
 */
class StreamClock {
  constructor() {
    this.index = 0;
    /** @type {Span | null} */
    this.span = null;
    /** Frames by which the last time code exceeds the count of planes. @type {number | null} */
    this.jump = null;
    this.refused = "";
    this.agreements = 0;
    /** @type {number | null} */
    this._offset = null; // frames from the count to the last time code that was refused
    this._objectIndex = 0;
    this._lastJump = 0;
    this._repeatedRates = 0;
    /** @type {Fraction | null} */
    this._doubtedRate = null;
    this._codedIndex = -1; // of the last plane whose time code was used
    this._started = false;
  }

  get rate() {
    return this.span?.rate ?? null;
  }

  /**
   * Apply the frame rate and the time code of an I plane; return warnings.
   * @param {Fraction | null} stated @param {TimeCode | null} code
   * @param {boolean} repair whether to believe codes more than the count of planes, which damage may have falsified
   */
  beginIntra(stated, code, repair) {
    const problems = [];
    this.refused = "";
    let rate = stated ?? this.rate;
    if (!rate) {
      rate = DEFAULT_RATE;
      problems.push(`the first I plane says no frame rate; ${rate} frames/s assumed`);
    }
    if (repair && stated && this._doubtsRate(rate)) {
      this.refused = `the frame rate ${rate} in place of ${this.rate} was not used`;
      rate = this.rate ?? rate;
    }
    const now = this.span ? this.span.time(this.index) : Fraction.of(0);
    if (!this.span || !rate.equals(this.span.rate)) {
      if (this.span) problems.push(`the frame rate changes from ${this.rate} to ${rate}`);
      this.index = now.times(rate).ceil();
      this.span = new Span(rate, now, this.index);
    }
    this.jump = null;
    if (code) problems.push(...this._takeCode(code, now, rate, repair));
    this._started = true;
    return problems;
  }

  /** @param {TimeCode} code @param {Fraction} now @param {Fraction} rate @param {boolean} repair */
  _takeCode(code, now, rate, repair) {
    const seconds = Fraction.of(secondsOf(code));
    let nearest = seconds.times(rate).plus(HALF).floor();
    if (!code.marker) return [`the marker bit of time code ${textOf(code)} is 0; that time code was not used`];
    if (this._started && nearest === this.index) {
      this.jump = this._lastJump = 0;
      this.agreements += 1;
      this._codedIndex = this.index;
    } else if (seconds.compare(now) < 0 && !(repair && this._canGoBack(nearest))) {
      return [`time code ${textOf(code)} lies before the previous plane; it was not used`];
    } else if (repair && this._goesTooFar(nearest, rate)) {
      this.refused = `time code ${textOf(code)} is far ahead of the count of planes; it was not used`;
    } else {
      if (seconds.compare(now) >= 0) nearest = Math.max(nearest, this.index);
      this.jump = this._lastJump = nearest - this.index;
      this.index = this._codedIndex = nearest;
      this.span = new Span(rate, seconds, nearest);
    }
    return [];
  }

  beginObject() {
    this._objectIndex = this.index;
  }

  /** @param {number} index */
  _canGoBack(index) {
    const undone = this._lastJump > 0 && index === this.index - this._lastJump;
    return this._isConfirmed(index) || index > this._codedIndex || undone;
  }

  /** @param {number} index @param {Fraction} rate */
  _goesTooFar(index, rate) {
    const far = this.agreements > 0 && Fraction.of(index - this.index).compare(BELIEVED_JUMP.times(rate)) > 0;
    return !this._isConfirmed(index) && far;
  }

  /** Whether a frame is as far from the count as the last that was compared. @param {number} index */
  _isConfirmed(index) {
    const before = this._offset;
    this._offset = index - this.index;
    return this._offset === before && index >= this._objectIndex;
  }

  /** @param {Fraction} rate */
  _doubtsRate(rate) {
    const [repeated, before] = [this._repeatedRates, this._doubtedRate];
    this._doubtedRate = rate;
    if (rate.equals(this.rate)) this._repeatedRates += 1;
    return !rate.equals(this.rate) && !rate.equals(before) && repeated >= REPEATED_RATES;
  }
}

/** Gives planes their times, and tells the log of damage how many frames were lost. */
export class PlaneTimes {
  /** @param {import("./damage.js").DamageLog | null} log null where the first damage is an error */
  constructor(log) {
    /** Whether frames may have lower indices than misread ones before. */
    this.mayStepBack = false;
    this._log = log;
    this._clock = new StreamClock();
    this._restarts = new RestartPoints();
    this._following = 0; // index behind that of the last frame
    this._catchingUp = false;
  }

  beginObject() {
    this._clock.beginObject();
  }

  /**
   * Apply the header of an I plane; return warnings.
   * @param {import("./header.js").Header} header @param {boolean} startCode whether a start code stands before it
   * @param {number} plane @param {number} bit both in the stream
   */
  beginIntra(header, startCode, plane, bit) {
    const [clock, log] = [this._clock, this._log];
    const behindLoss = log?.resuming ?? false;
    const lost = log && behindLoss ? this._skipLost(log, header.timeCode) : null;
    const [agreed, rate] = [clock.agreements, clock.rate];
    const problems = clock.beginIntra(header.rate, header.timeCode, log !== null);
    const jump = clock.jump ?? 0;
    const sameRate = rate !== null && rate.equals(clock.rate);
    if (startCode) {
      if (!sameRate) this._restarts.forget();
      this._restarts.add(clock.index, behindLoss);
    }
    if (!sameRate) this._catchingUp = false; // indices of another rate
    else if (jump < 0) this._catchingUp = !this.mayStepBack;
    if (log) {
      if (behindLoss) log.resume(clock.jump !== null ? [Math.max(jump, 0), 0] : lost);
      else if (jump < 0 || (agreed && jump)) {
        const error = new FbaError("damage", describeJump(header.timeCode, jump), { plane, bit });
        log.add(error, Math.floor(bit / 8), { framesLost: Math.max(jump, 0) });
      }
      if (clock.refused) log.add(new FbaError("damage", clock.refused, { plane, bit }), Math.floor(bit / 8));
    }
    return problems;
  }

  /** Return the span, and the indices, of the next planes. @param {Float64Array} skips */
  advance(skips) {
    const clock = this._clock;
    const index = new Float64Array(skips.length);
    skips.forEach((skip, position) => {
      index[position] = clock.index;
      clock.index += skip + 1;
    });
    if (this._catchingUp) {
      this._catchingUp = this._following > index[0];
      for (let at = 0; at < index.length; at += 1) index[at] = Math.max(index[at], this._following + at);
    }
    this._following = index[index.length - 1] + 1;
    return { span: /** @type {Span} */ (clock.span), index };
  }

  /** Leave out as many frames as seem lost; return their number and its uncertainty. @param {import("./damage.js").DamageLog} log @param {TimeCode | null} code */
  _skipLost(log, code) {
    const lost = log.estimate();
    if (!lost || code?.marker) return lost;
    const clock = this._clock;
    const expected = this._restarts.nearest(clock.index + lost[0]);
    if (expected !== null && expected >= clock.index) {
      lost[0] = expected - clock.index;
      clock.index += lost[0];
    } else {
      // in a stream with time codes, the next one sets the clock; until then it must not be ahead
      clock.index += clock.agreements ? Math.max(lost[0] - lost[1], 0) : lost[0];
    }
    return lost;
  }
}

/** @param {TimeCode | null} code @param {number} jump */
function describeJump(code, jump) {
  const frames = `${Math.abs(jump)} frame${Math.abs(jump) === 1 ? "" : "s"}`;
  const finding = jump > 0 ? `${frames} are missing before this plane` : `the planes before it are ${frames} late`;
  return `the time code ${code ? textOf(code) : ""} says that ${finding}`;
}

/** Intervals between I planes behind start codes, at which decoding can go on behind damage; they predict the next. */
class RestartPoints {
  constructor() {
    this.forget();
  }

  /** Forget all: indices count otherwise from now on. */
  forget() {
    /** @type {number | null} */
    this._last = null;
    /** @type {number[]} */
    this._intervals = [];
  }

  /** @param {number} index @param {boolean} behindLoss whether others before it may have been lost */
  add(index, behindLoss) {
    if (this._last !== null) {
      if (!behindLoss) this._intervals.push(index - this._last);
      else {
        const [cycle, place] = [this._cycle(), this._upcoming(index).indexOf(index)];
        if (place < 0) this._intervals = [];
        else this._intervals.push(...cycle.slice(0, (place % cycle.length) + 1));
      }
      this._intervals = this._intervals.slice(-2 * MOST_CYCLE);
    }
    this._last = index;
  }

  /** Return the expected restart point nearest to an index; null where they are irregular. @param {number} index */
  nearest(index) {
    const upcoming = this._upcoming(index);
    if (!upcoming.length) return null;
    return upcoming.reduce((best, point) => (Math.abs(point - index) < Math.abs(best - index) ? point : best));
  }

  /** Return the intervals that repeat, beginning with the next. */
  _cycle() {
    const known = this._intervals;
    for (let count = 1; count <= MOST_CYCLE && 2 * count <= known.length; count += 1) {
      const last = known.slice(-count);
      if (last.every((interval, place) => interval === known[known.length - 2 * count + place])) return last;
    }
    return [];
  }

  /** Return restart points that are expected around an index. @param {number} index */
  _upcoming(index) {
    const cycle = this._cycle();
    if (!cycle.length || this._last === null) return [];
    const whole = cycle.reduce((sum, interval) => sum + interval);
    let point = this._last + Math.max(Math.floor((index - this._last) / whole) - 1, 0) * whole;
    return [...cycle, ...cycle, ...cycle].map((interval) => (point += interval));
  }
}
