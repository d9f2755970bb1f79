/** Drawings over time: the timeline with the bits of each plane, lanes of visemes and expressions, curves of parameters. */
import { BAP_NAMES, EXPRESSIONS, FAP_NAMES, FAP_UNITS, VISEMES } from "./names.js";

/**
 * The planes of a stream: seconds, bits and whether each is an I plane.
 * @typedef {{times: Float64Array, bits: Float64Array, intra: Uint8Array}} Planes
 * @typedef {import("./timeline.js").Frames} Frames
 *
 * A parameter that can be drawn. number: of the FAP or BAP.
 * @typedef {{kind: "FAP" | "BAP", number: number, name: string, unit: string}} Parameter
 *
 * Samples of a parameter: its values at frames, NaN where none is sent.
 * @typedef {{parameter: Parameter, times: Float64Array, values: Float64Array, low: number, high: number}} Curve
 *
 * Something that is sent from one time to another.
 * @typedef {{from: number, to: number, name: string, share: number}} Stretch
 *
 * Which seconds are drawn, and colours.
 * @typedef {{from: number, to: number}} Span
 */

const LANE = 22; // pixels
const CURVE = 46;
const SHIFTS = [181, 182, 183]; // BAPs that are millimetres
const DEGREES = (1e-5 * 180) / Math.PI; // in a unit of an angle
const MOST_CURVES = 6;
const HUES = [205, 35, 135, 330, 265, 85];
const FACE_HUES = { joy: 45, sadness: 220, anger: 4, fear: 268, disgust: 110, surprise: 26 };

/** All parameters, as a reader may choose them. @returns {Parameter[]} */
export function parameters() {
  return [
    ...FAP_NAMES.slice(2).map((name, at) => ({ kind: /** @type {const} */ ("FAP"), number: at + 3, name, unit: FAP_UNITS[at + 2] === "AU" ? "degrees" : FAP_UNITS[at + 2] })),
    ...BAP_NAMES.map((name, at) => ({ kind: /** @type {const} */ ("BAP"), number: at + 1, name, unit: SHIFTS.includes(at + 1) ? "mm" : "degrees" })),
  ];
}

/** Return the values of a parameter. @param {Frames} frames @param {Parameter} parameter @returns {Curve} */
export function curveOf(frames, parameter) {
  const [times, values] = [new Float64Array(frames.length), new Float64Array(frames.length)];
  const column = parameter.number - 1;
  const scale = parameter.unit === "degrees" ? DEGREES : 1;
  let [low, high] = [Infinity, -Infinity];
  for (let at = 0; at < frames.length; at += 1) {
    const track = frames.frame(at)[parameter.kind === "FAP" ? "face" : "body"];
    times[at] = frames.indexOf(at) / frames.framesPerSecond;
    values[at] = track?.mask[column] ? track.values[column] * scale : NaN;
    if (values[at] < low) low = values[at];
    if (values[at] > high) high = values[at];
  }
  return { parameter, times, values, low, high };
}

/** Return the parameters that move most, relative to what they usually do. @param {Frames} frames @param {number} count */
export function liveliest(frames, count) {
  const step = Math.max(1, Math.floor(frames.length / 500));
  const all = parameters();
  const low = new Float64Array(all.length).fill(Infinity);
  const high = new Float64Array(all.length).fill(-Infinity);
  for (let at = 0; at < frames.length; at += step) {
    const { face, body } = frames.frame(at);
    all.forEach(({ kind, number }, k) => {
      const track = kind === "FAP" ? face : body;
      if (!track?.mask[number - 1]) return;
      low[k] = Math.min(low[k], track.values[number - 1]);
      high[k] = Math.max(high[k], track.values[number - 1]);
    });
  }
  const usual = (/** @type {Parameter} */ { kind, unit }) => (unit === "degrees" ? (kind === "FAP" ? 60000 : 100000) : kind === "FAP" ? 400 : 500);
  const moved = all.map((parameter, k) => ({ parameter, share: (high[k] - low[k]) / usual(parameter) }));
  return moved.filter(({ share }) => share > 0).sort((a, b) => b.share - a.share).slice(0, count).map(({ parameter }) => parameter);
}

/** Return the visemes in force: each until the next is sent. @param {Frames} frames @returns {Stretch[]} */
export function visemesOf(frames) {
  return stretches(frames, ({ face }) => {
    if (!face?.mask[0]) return undefined;
    const [first, second, blend] = face.viseme;
    const strongest = blend >= 32 || !second ? first : second;
    return strongest ? { name: VISEMES[strongest] ?? String(strongest), share: 1 } : null;
  });
}

/** Return the expressions in force. @param {Frames} frames @returns {Stretch[]} */
export function expressionsOf(frames) {
  return stretches(frames, ({ face }) => {
    if (!face?.mask[1]) return undefined;
    const [first, one, second, two] = face.expression;
    const [name, share] = one >= two ? [first, one] : [second, two];
    return name && share ? { name: EXPRESSIONS[name] ?? String(name), share: share / 63 } : null;
  });
}

/**
 * @param {Frames} frames @param {(frame: import("./timeline.js").Frame) => {name: string, share: number} | null | undefined} read undefined: nothing is sent
 * @returns {Stretch[]}
 */
function stretches(frames, read) {
  /** @type {Stretch[]} */
  const found = [];
  /** @type {{name: string, share: number} | null} */
  let shown = null;
  for (let at = 0; at < frames.length; at += 1) {
    const sent = read(frames.frame(at));
    if (sent !== undefined) shown = sent;
    if (!shown) continue;
    const from = frames.indexOf(at) / frames.framesPerSecond;
    const to = at + 1 < frames.length ? frames.indexOf(at + 1) / frames.framesPerSecond : from + 1 / frames.framesPerSecond;
    const last = found[found.length - 1];
    if (last && last.name === shown.name && last.to >= from - 1e-9) {
      last.to = to;
      last.share = Math.max(last.share, shown.share);
    } else found.push({ from, to, ...shown });
  }
  return found;
}

/** A canvas for drawings over time, sharp on any screen. */
class Drawing {
  /** @param {HTMLCanvasElement} canvas @param {HTMLElement} host whose colours it takes */
  constructor(canvas, host) {
    this.canvas = canvas;
    this._host = host;
    this.context = /** @type {CanvasRenderingContext2D} */ (canvas.getContext("2d"));
    this.width = 0;
    this.height = 0;
  }

  /** Clear it at its present size; return the colours of the theme. @param {number} [height] of the canvas from now on */
  begin(height) {
    if (height !== undefined) this.canvas.style.height = `${height}px`;
    const scale = devicePixelRatio || 1;
    this.width = this.canvas.clientWidth;
    this.height = height ?? this.canvas.clientHeight;
    const [width, tall] = [Math.round(this.width * scale), Math.round(this.height * scale)];
    if (this.canvas.width !== width || this.canvas.height !== tall) Object.assign(this.canvas, { width, height: tall });
    this.context.setTransform(scale, 0, 0, scale, 0, 0);
    this.context.clearRect(0, 0, this.width, this.height);
    this.context.font = "12px system-ui, sans-serif";
    const style = getComputedStyle(this._host);
    const colour = (/** @type {string} */ name) => style.getPropertyValue(name).trim();
    return { text: colour("--text"), faint: colour("--faint"), accent: colour("--accent"), warm: colour("--warm"), raised: colour("--raised") };
  }
}

/** The timeline: bits of planes, the part that loops, the time. */
export class Track extends Drawing {
  /** @param {Planes | null} planes @param {Span} span @param {[number, number] | null} part @param {number} time */
  draw(planes, { from, to }, part, time) {
    const colours = this.begin();
    const { context, width, height } = this;
    const x = (/** @type {number} */ at) => ((at - from) / Math.max(to - from, 1e-9)) * width;
    context.fillStyle = colours.raised;
    context.fillRect(0, height - 4, width, 4);
    if (planes) this._drawPlanes(planes, x, colours);
    if (part) {
      context.fillStyle = colours.accent;
      context.globalAlpha = 0.18;
      context.fillRect(x(part[0]), 0, x(part[1]) - x(part[0]), height);
      context.globalAlpha = 1;
      for (const edge of part) context.fillRect(x(edge) - 1, 0, 2, height);
    }
    context.fillStyle = colours.accent;
    context.fillRect(0, height - 4, x(time), 4);
    context.fillRect(Math.min(x(time), width - 2) - 1, 0, 3, height);
  }

  /** Draw a bar for each pixel: the largest plane there, its height the square root of its bits. */
  _drawPlanes(/** @type {Planes} */ planes, /** @type {(at: number) => number} */ x, /** @type {Record<string, string>} */ colours) {
    const { context, width, height } = this;
    const count = Math.max(1, Math.floor(width));
    const [most, intra] = [new Float64Array(count), new Uint8Array(count)];
    let peak = 1;
    planes.bits.forEach((bits, k) => {
      const pixel = Math.min(count - 1, Math.max(0, Math.floor(x(planes.times[k]))));
      most[pixel] = Math.max(most[pixel], bits);
      intra[pixel] |= planes.intra[k];
      peak = Math.max(peak, bits);
    });
    const wide = Math.max(1, Math.min(6, width / Math.max(planes.bits.length, 1) - 1));
    for (let pixel = 0; pixel < count; pixel += 1) {
      if (!most[pixel]) continue;
      const tall = Math.max(1, Math.sqrt(most[pixel] / peak) * (height - 7));
      context.fillStyle = intra[pixel] ? colours.warm : colours.faint;
      context.globalAlpha = intra[pixel] ? 1 : 0.55;
      context.fillRect(pixel, height - 4 - tall, wide, tall);
    }
    context.globalAlpha = 1;
  }
}

/** Lanes of visemes and expressions, and curves. */
export class Lanes extends Drawing {
  /**
   * @param {{visemes: Stretch[], expressions: Stretch[], curves: Curve[]}} content @param {Span} span @param {number} time
   */
  draw({ visemes, expressions, curves }, span, time) {
    const lanes = /** @type {[string, Stretch[]][]} */ ([["visemes", visemes], ["expressions", expressions]]).filter(([, all]) => all.length);
    const colours = this.begin(Math.max(lanes.length * LANE + Math.min(curves.length, MOST_CURVES) * CURVE, LANE));
    const { context, width, height } = this;
    const x = (/** @type {number} */ at) => ((at - span.from) / Math.max(span.to - span.from, 1e-9)) * width;
    let top = 0;
    for (const [title, all] of lanes) {
      this._drawLane(title, all, x, top, colours);
      top += LANE;
    }
    curves.slice(0, MOST_CURVES).forEach((curve, k) => {
      this._drawCurve(curve, HUES[k % HUES.length], x, top, time, colours);
      top += CURVE;
    });
    if (!lanes.length && !curves.length) {
      context.fillStyle = colours.faint;
      context.fillText("no visemes or expressions are sent; choose a parameter above", 4, 15);
    }
    context.fillStyle = colours.accent;
    context.fillRect(x(time) - 0.5, 0, 1.5, height);
  }

  _drawLane(/** @type {string} */ title, /** @type {Stretch[]} */ all, /** @type {(at: number) => number} */ x, /** @type {number} */ top, /** @type {Record<string, string>} */ colours) {
    const { context } = this;
    for (const { from, to, name, share } of all) {
      const [left, wide] = [x(from), Math.max(x(to) - x(from) - 0.5, 1)];
      const hue = FACE_HUES[/** @type {keyof typeof FACE_HUES} */ (name)] ?? (name.length * 47 + name.charCodeAt(0) * 31) % 360;
      context.fillStyle = `hsl(${hue} 60% 55% / ${0.3 + 0.5 * share})`;
      context.fillRect(left, top + 2, wide, LANE - 4);
      if (wide < context.measureText(name).width + 4) continue;
      context.fillStyle = colours.text;
      context.fillText(name, left + 3, top + 15);
    }
    if (all[0] && x(all[0].from) > 70) {
      context.fillStyle = colours.faint;
      context.fillText(title, 3, top + 15);
    }
  }

  _drawCurve(/** @type {Curve} */ curve, /** @type {number} */ hue, /** @type {(at: number) => number} */ x, /** @type {number} */ top, /** @type {number} */ time, /** @type {Record<string, string>} */ colours) {
    const { context, width } = this;
    const room = CURVE - 16;
    const range = Math.max(curve.high - curve.low, 1e-9);
    const y = (/** @type {number} */ value) => top + 14 + room * (1 - (value - curve.low) / range);
    context.strokeStyle = `hsl(${hue} 70% 50%)`;
    context.lineWidth = 1.4;
    context.beginPath();
    let [pixel, low, high, now] = [-1, 0, 0, NaN];
    const flush = () => {
      if (pixel < 0) return;
      context.lineTo(pixel, y(low));
      if (high > low) context.lineTo(pixel, y(high));
    };
    curve.times.forEach((at, k) => {
      const value = curve.values[k];
      if (Number.isNaN(value)) return;
      if (at <= time + 1e-6) now = value;
      const place = Math.round(x(at));
      if (place < 0 || place > width) return;
      if (place !== pixel) {
        flush();
        [pixel, low, high] = [place, value, value];
      } else [low, high] = [Math.min(low, value), Math.max(high, value)];
    });
    flush();
    context.stroke();
    const { kind, number, name, unit } = curve.parameter;
    const text = (/** @type {number} */ value) => (Number.isFinite(value) ? String(Math.round(value * 10) / 10) : "–");
    context.fillStyle = colours.text;
    context.fillText(`${kind} ${number} ${name}: ${text(now)} ${unit}`, 3, top + 11);
    context.fillStyle = colours.faint;
    const scale = `${text(curve.low)} … ${text(curve.high)}`;
    context.fillText(scale, width - context.measureText(scale).width - 3, top + 11);
  }
}
