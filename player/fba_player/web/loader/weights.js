/** FAPs as weights of ARKit's 52 shapes: those whose FAPs come closest, as `fba.capture.blendshapes.to_blendshapes`. */
import { CLOSED, JAW, METRES, SHAPES, SHARED_WEIGHT } from "./shapes.js";

/** @type {Record<string, string>} */
const SIDES = { l: "left", r: "right", lft: "left", rgt: "right" };
const MOST_COMMON_WORDS = 4;
/** Most changes of the set of free weights in a frame, for each weight. */
const MOST_CHANGES = 100;
/** Change that a weight must be worth to leave a bound. */
const SETTLED = 1e-9;
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
    /** Weights between the bounds, and the rows of the Cholesky factor of their products. @type {number[]} */
    this._free = [];
    /** @type {Float64Array[]} */
    this._factor = this.names.map(() => new Float64Array(this.names.length));
  }

  /** Return the weights for FAPs 1 to 68, visemes and expressions resolved. @param {ArrayLike<number>} faps */
  of(faps) {
    const moved = Float64Array.from(METRES, (metres, k) => faps[k] * metres);
    const goals = this._rows.map((row) => product(row, moved));
    const { weights, _free: free, _products: products } = this;
    // An active set, begun with that of the frame before: free weights solve their normal equations; the first that meets a bound
    // on the way stops there; once all are there, that at a bound which is most worth moving becomes free.
    for (let change = 0; change < MOST_CHANGES * weights.length; change += 1) {
      const best = this._solve(goals);
      let [share, place, bound] = [1, -1, 0];
      best.forEach((value, row) => {
        const old = weights[free[row]];
        const end = value < 0 ? 0 : 1;
        if ((value < 0 || value > 1) && (end - old) / (value - old) < share) [share, place, bound] = [(end - old) / (value - old), row, end];
      });
      best.forEach((value, row) => (weights[free[row]] = place < 0 ? value : weights[free[row]] + share * (value - weights[free[row]])));
      if (place >= 0) {
        weights[free[place]] = bound;
        free.splice(place, 1);
        this._factorRows(place);
        continue;
      }
      let [most, better] = [SETTLED, -1];
      for (let k = 0; k < weights.length; k += 1) {
        if (free.includes(k)) continue;
        const worth = ((goals[k] - product(products[k], weights)) / products[k][k]) * (weights[k] === 1 ? -1 : 1);
        if (worth > most) [most, better] = [worth, k];
      }
      if (better < 0) break;
      free.push(better);
      this._factorRows(free.length - 1);
    }
    this._shown.set(weights);
    const [jaw, closed] = [this.names.indexOf(JAW), this.names.indexOf(CLOSED)];
    if (jaw >= 0 && closed >= 0) this._shown[jaw] = Math.min(weights[jaw] + weights[closed], 1);
    return this._shown;
  }

  /** Return the best values of the free weights, without bounds. @param {number[]} goals */
  _solve(goals) {
    const { weights, _free: free, _products: products, _factor: factor } = this;
    const bound = weights.map((weight, k) => (free.includes(k) ? 0 : weight));
    const best = free.map((k) => goals[k] - product(products[k], bound));
    for (let row = 0; row < best.length; row += 1) {
      for (let k = 0; k < row; k += 1) best[row] -= factor[row][k] * best[k];
      best[row] /= factor[row][row];
    }
    for (let row = best.length - 1; row >= 0; row -= 1) {
      for (let k = row + 1; k < best.length; k += 1) best[row] -= factor[k][row] * best[k];
      best[row] /= factor[row][row];
    }
    return best;
  }

  /** Compute rows of the Cholesky factor of the products of the free weights. @param {number} first */
  _factorRows(first) {
    const { _free: free, _products: products, _factor: factor } = this;
    for (let row = first; row < free.length; row += 1) {
      for (let column = 0; column <= row; column += 1) {
        let rest = products[free[row]][free[column]];
        for (let k = 0; k < column; k += 1) rest -= factor[row][k] * factor[column][k];
        factor[row][column] = row === column ? Math.sqrt(rest) : rest / factor[column][column];
      }
    }
  }
}

/** @param {Float64Array} a @param {Float64Array} b */
function product(a, b) {
  let sum = 0;
  for (let k = 0; k < a.length; k += 1) sum += a[k] * b[k];
  return sum;
}
