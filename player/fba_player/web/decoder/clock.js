/** Times of planes from frame rate, skips and time codes, as exact fractions; behind damage the most likely ones. */
import { compare, fraction, greatestDivisor, inverse, nearest, product, sum, value } from "./fraction.js";

/** @typedef {import("./fraction.js").Fraction} Fraction */

const BELIEVED_JUMP = 60; // seconds that a time code may jump ahead without other damage
const REPEATED_RATES = 2; // I planes with the same rate behind which another rate in one of them is damage
const IRREGULAR = [NaN, NaN, NaN, NaN]; // intervals that predict nothing
const COMMON_RATE_MAX = 1e6; // highest rate that is chosen to make all times exact

/**
 * A span of frames with one rate: the frame `index` is shown at anchor + (index - anchorIndex) / rate seconds.
 * @typedef {[Fraction, Fraction, number]} Span the rate, the anchor, its index
 */

/** Return the seconds at which a frame is shown. @param {Span} span @param {number} index */
export const timeIn = ([rate, anchor, anchorIndex], index) =>
  sum(anchor, product(fraction(index - anchorIndex), inverse(rate)));

/** @param {Fraction} one @param {Fraction | null | undefined} other */
const equal = (one, other) => other != null && !compare(one, other);

/**
 * Return functions that give planes their times.
 *
 * A time code sets the clock. One that names the very frame that comes next anyway leaves it alone: codes are whole
 * seconds, and at a rate such as 30000/1001 hardly a frame lies on one.
 * @param {boolean} salvage without, the first damage is an error
 * @param {boolean} mayStepBack whether frames may have lower indices than misread ones before
 * @param {(finding: string) => unknown} warn
 * @param {(finding: string, framesLost: number | null) => unknown} report takes damage
 * @param {(lost: number[] | null) => unknown} resume takes about how many frames were lost with the last damage, and the uncertainty
 */
export function makeClock(salvage, mayStepBack, warn, report, resume) {
  let catchingUp = false;
  let following = 0; // index behind that of the last frame
  let index = 0; // of the next plane
  /** @type {Span | undefined} */
  let span;
  let objectIndex = 0;
  let agreements = 0; // time codes that the count of planes agreed with
  let lastJump = 0;
  let codedIndex = -1; // of the last plane whose time code was used
  let offset = NaN; // frames from the count to the last time code that was refused
  let repeatedRates = 0;
  /** @type {Fraction | null} */
  let doubtedRate = null;
  // Of I planes behind start codes, at which decoding can go on behind damage:
  let lastRestart = NaN;
  /** Frames between the last of them, the last one first; two that repeat in turn, or one, predict the next. */
  let intervals = IRREGULAR;

  /** Return the intervals that repeat, beginning with the next. */
  const cycle = () =>
    intervals[0] === intervals[1] ? [intervals[0]]
    : intervals[0] === intervals[2] && intervals[1] === intervals[3] ? [intervals[1], intervals[0]]
    : [];

  /** Return restart points that are expected around an index. @param {number} around */
  function upcoming(around) {
    const next = cycle();
    const whole = next.reduce((total, interval) => total + interval, 0);
    let point = lastRestart + Math.max(Math.floor((around - lastRestart) / whole) - 1, 0) * whole;
    return [...next, ...next, ...next].map((interval) => (point += interval));
  }

  /** Note a restart point. @param {boolean} behindLoss whether others before it may have been lost */
  function addRestart(behindLoss) {
    if (lastRestart >= 0) {
      const [next, place] = [cycle(), upcoming(index).indexOf(index)];
      const passed = !behindLoss ? [index - lastRestart] : place < 0 ? IRREGULAR : next.slice(0, (place % next.length) + 1).reverse();
      intervals = [...passed, ...intervals].slice(0, 4);
    }
    lastRestart = index;
  }

  /** Whether a frame is as far from the count as the last that was compared. @param {number} frame */
  function isConfirmed(frame) {
    const before = offset;
    offset = frame - index;
    return offset === before && frame >= objectIndex;
  }

  /** @param {Fraction} rate @param {Fraction | undefined} before */
  function doubtsRate(rate, before) {
    const doubted = doubtedRate;
    doubtedRate = rate;
    if (!equal(rate, before)) return !equal(rate, doubted) && repeatedRates >= REPEATED_RATES;
    repeatedRates += 1;
    return false;
  }

  return {
    _beginObject() {
      objectIndex = index;
    },

    /**
     * Apply the frame rate and the time code of an I plane.
     * @param {import("./planes.js").Plane} header
     * @param {boolean} startCode whether a start code stands before it
     * @param {boolean} behindLoss whether it is the first plane behind damage
     * @param {number[] | null} lost about how many frames were lost before it, and the uncertainty, where known
     */
    _beginIntra({ _rate: stated, _timeCode: code }, startCode, behindLoss, lost) {
      if (lost && !code?._marker) {
        const distance = (/** @type {number} */ point) => Math.abs(point - index - lost[0]);
        const expected = upcoming(index + lost[0]).reduce((best, point) => (distance(point) >= distance(best) ? best : point), NaN);
        const regular = expected >= index;
        if (regular) lost[0] = expected - index;
        // In a stream with time codes, the next one sets the clock; until then it must not be ahead.
        index += Math.max(lost[0] - (agreements && !regular ? lost[1] : 0), 0);
      }
      const [agreed, before] = [agreements, span?.[0]];
      const now = span ? timeIn(span, index) : fraction(0);
      let refused = "";
      if (!stated && !before) warn("no frame rate, 25 assumed");
      let rate = stated ?? before ?? fraction(25);
      if (salvage && stated && doubtsRate(rate, before) && before) {
        refused = `frame rate ${value(rate)} not used`;
        rate = before;
      }
      const sameRate = equal(rate, before);
      if (!sameRate) {
        if (before) warn(`frame rate ${value(rate)}, before ${value(before)}`);
        const [above, below] = product(now, rate);
        index = Number((above + below - 1n) / below);
        span = [rate, now, index];
      }
      /** Frames by which the time code exceeds the count of planes. @type {number | null} */
      let jump = null;
      const named = `time code ${code?._seconds} s`;
      if (code) {
        const seconds = fraction(code._seconds);
        const ahead = compare(seconds, now) >= 0;
        let frame = nearest(product(seconds, rate));
        const notUsed = `${named} not used`;
        if (code._marker && before && frame === index) {
          jump = 0;
          agreements += 1;
        } else if (
          !code._marker ||
          (!ahead && !(salvage && (isConfirmed(frame) || frame > codedIndex || (lastJump > 0 && frame === index - lastJump))))
        ) {
          warn(notUsed);
        } else if (salvage && !isConfirmed(frame) && agreements && frame - index > BELIEVED_JUMP * value(rate)) {
          refused = notUsed;
        } else {
          if (ahead) frame = Math.max(frame, index);
          jump = frame - index;
          index = frame;
          span = [rate, seconds, frame];
        }
        if (jump !== null) [lastJump, codedIndex] = [jump, index];
      }
      const moved = jump ?? 0;
      if (startCode) {
        if (!sameRate) {
          intervals = IRREGULAR;
          lastRestart = NaN;
        }
        addRestart(behindLoss);
      }
      catchingUp = sameRate && (moved < 0 ? !mayStepBack : catchingUp); // not with indices of another rate
      const gained = Math.max(moved, 0);
      if (behindLoss) resume(jump === null ? lost : [gained, 0]);
      else if (salvage && (moved < 0 || (agreed && moved))) {
        report(`${named}: ${Math.abs(moved)} frames ${moved > 0 ? "missing" : "too many"}`, gained);
      }
      if (refused) report(refused, null);
    },

    /** Return the index and the span of the next plane. @param {number} skip frames behind it */
    _next(skip) {
      catchingUp &&= following > index;
      const now = catchingUp ? following : index;
      index += skip + 1;
      following = now + 1;
      return /** @type {[number, Span]} */ ([now, span]);
    },
  };
}

/**
 * Return one rate and the indices of planes at it, for a stream that may change its rate and set its clock: the lowest
 * rate at which all planes have whole indices, or else the highest of the stream's.
 * @param {{_span: Span, _shown: {index: number}}[]} planes
 */
export function commonTimes(planes) {
  /** @type {{_first: number, _index: number, _start: Fraction, _span: Span}[]} */
  const runs = [];
  let highest = planes[0]._span[0];
  /** @type {Fraction | null} */
  let exact = highest;
  planes.forEach(({ _span: span, _shown: { index } }, first) => {
    const last = runs[runs.length - 1]?._span;
    if (last === span) return;
    const start = timeIn(span, index);
    const rate = span[0];
    if (last && equal(rate, last[0]) && equal(start, timeIn(last, index))) return;
    runs.push({ _first: first, _index: index, _start: start, _span: span });
    if (compare(rate, highest) > 0) highest = rate;
    for (const [above, below] of start[0] ? [rate, inverse(start)] : [rate]) {
      if (!exact) return;
      const [multiple, divisor] = exact;
      exact = fraction((multiple / greatestDivisor(multiple, above)) * above, greatestDivisor(divisor, below));
      if (value(exact) > COMMON_RATE_MAX) exact = null;
    }
  });
  const same = runs.every(({ _span: span }) => equal(span[0], highest));
  const rate = (!same && exact) || highest;
  let run = runs[0];
  let offset = fraction(0);
  let late = 0;
  let following = 0;
  const indices = Float64Array.from(planes, ({ _shown: { index } }, at) => {
    if (same) return index;
    if (at === runs[0]?._first) {
      run = runs[0];
      runs.shift();
      offset = product(run._start, rate);
      late = Math.max(following - nearest(offset), 0);
    }
    const count = product(product(rate, inverse(run._span[0])), fraction(index - run._index));
    following = nearest(sum(offset, count)) + late + 1;
    return following - 1;
  });
  return /** @type {const} */ ([rate, indices]);
}
