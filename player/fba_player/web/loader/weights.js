/** FAPs as weights of ARKit's 52 shapes: those whose FAPs come closest, as `fba.capture.blendshapes.to_blendshapes`. */
import { CLOSED, JAW, METRES, SHAPES, SHARED_WEIGHT } from "./shapes.js";

/** @type {Record<string, string>} */
const SIDES = { l: "left", r: "right", lft: "left", rgt: "right" };
const MOST_COMMON_WORDS = 4;
const MOST_SWEEPS = 200;
const SETTLED = 1e-4;
const FAPS = METRES.length;

/** ARKit's names by their words. @type {Map<string, string>} */
const NAMES = new Map(Object.keys(SHAPES).map((name) => [wordsOf(name), name]));

/**
 * Return ARKit's names of morph targets, such as "blendShape1.eyeBlink_L", undefined for others. Where none is known, words that
 * all names may begin with are left out.
 * @param {unknown[]} names
 */
export function arkitNames(names) {
  const texts = names.map((name) => String(name).slice(0, 200));
  for (let without = 0; without < MOST_COMMON_WORDS; without += 1) {
    const found = texts.map((text) => NAMES.get(wordsOf(text, without)) ?? NAMES.get(wordsOf(text.split(/[.:|/]/).pop() ?? "", without)));
    if (found.some(Boolean)) return found;
  }
  return texts.map(() => undefined);
}

/** Return the words of a name in a fixed order, as programs put the side first or last. @param {string} name @param {number} [without] how many at its start */
function wordsOf(name, without = 0) {
  const words = (name.match(/[A-Z]+(?![a-z])|[A-Z]?[a-z]+/g) ?? []).slice(without);
  return [...new Set(words.map((word) => SIDES[word.toLowerCase()] ?? word.toLowerCase()))].sort().join(" ");
}

/** Weights of shapes for one face after another. */
export class ShapeWeights {
  /** @param {string[]} [names] of shapes that the face has; others are left out */
  constructor(names = Object.keys(SHAPES)) {
    this.names = names.filter((name) => Object.hasOwn(SHAPES, name));
    this._rows = this.names.map((name) => {
      const row = new Float64Array(FAPS);
      // "mouthClose" does nothing beyond "jawOpen": an open jaw with lips together
      for (const shape of name === CLOSED && this.names.includes(JAW) ? [name, JAW] : [name]) {
        for (const [fap, amount] of Object.entries(SHAPES[shape])) row[Number(fap) - 1] += amount * METRES[Number(fap) - 1];
      }
      return row;
    });
    this._products = this._rows.map((a, i) => Float64Array.from(this._rows, (b, j) => product(a, b) + (i === j ? SHARED_WEIGHT ** 2 : 0)));
    /** The last weights, 0 to 1, of `names`. */
    this.weights = new Float64Array(this.names.length);
    this._shown = new Float64Array(this.names.length);
  }

  /** Return the weights for FAPs 1 to 68, visemes and expressions resolved. @param {ArrayLike<number>} faps */
  of(faps) {
    const moved = Float64Array.from(METRES, (metres, k) => faps[k] * metres);
    const goals = this._rows.map((row) => product(row, moved));
    const { weights, _products: products } = this;
    for (let sweep = 0, change = 1; sweep < MOST_SWEEPS && change >= SETTLED; sweep += 1) {
      change = 0;
      for (let k = 0; k < weights.length; k += 1) {
        const rest = goals[k] - product(products[k], weights);
        const better = Math.min(Math.max(weights[k] + rest / products[k][k], 0), 1);
        change = Math.max(change, Math.abs(better - weights[k]));
        weights[k] = better;
      }
    }
    this._shown.set(weights);
    const [jaw, closed] = [this.names.indexOf(JAW), this.names.indexOf(CLOSED)];
    if (jaw >= 0 && closed >= 0) this._shown[jaw] = Math.min(weights[jaw] + weights[closed], 1);
    return this._shown;
  }
}

/** @param {Float64Array} a @param {Float64Array} b */
function product(a, b) {
  let sum = 0;
  for (let k = 0; k < a.length; k += 1) sum += a[k] * b[k];
  return sum;
}
