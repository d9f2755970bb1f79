/** A body's own head: FAPs mix its shapes and turn its eyes, as `fba.body.own_head` says. */
import { checkedList, checkedNumber, checkedNumbers } from "./container.js";
import { IDENTITY, multiply, rotate } from "./matrices.js";

/** @typedef {import("./container.js").Arrays} Container */

const FAPS = 68;
const [SMALL, FEW] = [0.1, 0.03]; // weights of keeping shapes small and few
const RADIAN = 1e-5;
const MOST_SHAPES = 512;
/** Columns of FAPs that turn an eye: yaw and pitch, of the left and the right one. */
const EYE_FAPS = [[22, 24], [23, 25]];
const SETTLED = 1e-10;

export class OwnHead {
  /** @param {Container} container @param {Record<string, any>} header @param {number} vertices of the body */
  constructor(container, header, vertices) {
    const rows = checkedList(header.counts, "shapes of the head").map((count) => checkedNumber(count, "the vertices of a shape", vertices + 1));
    const moved = rows.reduce((sum, count) => sum + count, 0);
    checkedNumber(rows.length, "the number of shapes", MOST_SHAPES);
    this._counts = rows;
    this._rows = container.indices(header.rows, "vertices of shapes", vertices, moved, 1);
    this._shifts = container.fractions(header.shifts, "shapes of the head", moved, 3);
    this._scales = checkedNumbers(header.scales, "scales of FAPs", FAPS);
    /** FAPs of each shape, scaled. */
    this._faps = checkedList(header.faps, "FAPs of shapes").map((faps) => checkedNumbers(faps, "FAPs of a shape", FAPS));
    if (this._faps.length !== rows.length) checkedNumber(this._faps.length, "the number of FAPs of shapes", 0);
    this._products = this._faps.map((one) => Float64Array.from(this._faps, (other) => product(one, other)));
    const turned = checkedList(header.eyes, "eyes").reduce((sum, { count }) => sum + checkedNumber(count, "the vertices of an eye", vertices + 1), 0);
    this._turned = container.indices(header.turned, "vertices of eyes", vertices, turned, 1);
    this._eyes = checkedList(header.eyes, "eyes").map(({ side, count, centre }) => ({ side: checkedNumber(side, "the side of an eye", 2), count, centre: checkedNumbers(centre, "the centre of an eye", 3) }));
    this._turns = [Float64Array.from(IDENTITY), Float64Array.from(IDENTITY)];
  }

  /** Return the weights, 0 to 1, of the shapes that together come closest to FAPs. @param {ArrayLike<number>} faps */
  weights(faps) {
    const reached = this._scales.map((scale, fap) => scale * faps[fap]);
    const goals = Float64Array.from(this._faps, (shape) => product(shape, reached));
    const result = new Float64Array(goals.length);
    const first = leastSquares(this._products, goals.map((goal) => goal - FEW), [...goals.keys()], SMALL ** 2);
    let chosen = [...first.keys()].filter((shape) => first[shape] > 0);
    while (chosen.length) { // shapes above 1 are fixed at 1, and the others compensate
      const fixed = [...result.keys()].filter((shape) => result[shape] > 0 && !chosen.includes(shape));
      const rest = goals.map((goal, shape) => goal - fixed.reduce((sum, other) => sum + this._products[shape][other] * result[other], 0));
      const found = leastSquares(this._products, rest, chosen, 0);
      for (const shape of chosen) result[shape] = Math.min(found[shape], 1);
      const left = chosen.filter((shape) => found[shape] <= 1);
      if (left.length === chosen.length) break;
      chosen = left;
    }
    return result;
  }

  /** Write the body's vertices as modelled, the head moved. @param {Float32Array} rest @param {ArrayLike<number>} faps @param {Float32Array} out */
  move(rest, faps, out) {
    out.set(rest);
    const weights = this.weights(faps);
    let from = 0;
    for (const [shape, count] of this._counts.entries()) {
      const stop = from + count;
      if (weights[shape] === 0) from = stop;
      for (; from < stop; from += 1) for (let axis = 0; axis < 3; axis += 1) out[3 * this._rows[from] + axis] += weights[shape] * this._shifts[3 * from + axis];
    }
    from = 0;
    for (const { side, count, centre } of this._eyes) {
      const [turn, pitch] = this._turns;
      rotate(turn, 0, RADIAN * faps[EYE_FAPS[side][0]], 0, centre);
      rotate(pitch, RADIAN * faps[EYE_FAPS[side][1]], 0, 0, centre);
      multiply(turn, pitch, turn);
      for (const stop = from + count; from < stop; from += 1) {
        const at = 3 * this._turned[from];
        const [x, y, z] = out.subarray(at, at + 3);
        for (let row = 0; row < 3; row += 1) out[at + row] = turn[row] * x + turn[4 + row] * y + turn[8 + row] * z + turn[12 + row];
      }
    }
  }
}

/** @param {ArrayLike<number>} one @param {ArrayLike<number>} other */
function product(one, other) {
  let sum = 0;
  for (let k = 0; k < one.length; k += 1) sum += one[k] * other[k];
  return sum;
}

/**
 * Return weights, none below 0, of the chosen columns of a matrix that come closest to a vector; 0 for others. (Lawson and Hanson,
 * "Solving least squares problems", 1974, chapter 23.)
 * @param {Float64Array[]} products of the columns with each other @param {Float64Array} goals their products with the vector @param {number[]} columns @param {number} ridge added to their squares
 */
function leastSquares(products, goals, columns, ridge) {
  const weights = new Float64Array(goals.length);
  /** @type {number[]} */
  let used = [];
  const refused = new Set();
  for (let round = 0; round < 3 * columns.length; round += 1) {
    const gain = (/** @type {number} */ column) => goals[column] - product(products[column], weights) - ridge * weights[column];
    const next = columns.filter((column) => !used.includes(column) && !refused.has(column)).reduce((best, column) => (best < 0 || gain(column) > gain(best) ? column : best), -1);
    if (next < 0 || !(gain(next) > SETTLED)) break;
    used.push(next);
    for (;;) {
      const wanted = solve(products, goals, used, ridge);
      if (!wanted || (wanted[used.length - 1] <= 0 && used[used.length - 1] === next && weights[next] === 0)) { // depends on the others
        refused.add(next);
        used.pop();
        break;
      }
      const low = used.filter((_, k) => wanted[k] <= 0);
      const share = low.length ? Math.min(...low.map((column) => weights[column] / Math.max(weights[column] - wanted[used.indexOf(column)], 1e-300))) : 1;
      used.forEach((column, k) => (weights[column] += share * (wanted[k] - weights[column])));
      if (!low.length) break;
      for (const column of low) if (weights[column] <= SETTLED) weights[column] = 0;
      used = used.filter((column) => weights[column] > 0);
    }
  }
  return weights;
}

/** Return the solution for some columns without bounds, or null where they depend on each other. @param {Float64Array[]} products @param {Float64Array} goals @param {number[]} columns @param {number} ridge */
function solve(products, goals, columns, ridge) {
  const count = columns.length;
  const rows = columns.map((row, at) => Float64Array.from([...columns.map((column, k) => products[row][column] + (k === at ? ridge : 0)), goals[row]]));
  for (let k = 0; k < count; k += 1) {
    if (!(rows[k][k] > 1e-12)) return null;
    for (let row = k + 1; row < count; row += 1) {
      const share = rows[row][k] / rows[k][k];
      if (share) for (let column = k; column <= count; column += 1) rows[row][column] -= share * rows[k][column];
    }
  }
  const found = new Float64Array(count);
  for (let k = count - 1; k >= 0; k -= 1) {
    let rest = rows[k][count];
    for (let column = k + 1; column < count; column += 1) rest -= rows[k][column] * found[column];
    found[k] = rest / rows[k][k];
  }
  return found;
}
