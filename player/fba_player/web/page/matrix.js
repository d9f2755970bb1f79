/**
 * Matrices (4, 4) as 16 numbers, column after column, as OpenGL takes them.
 * @typedef {Float64Array | Float32Array | number[]} Matrix
 * @typedef {[number, number, number]} Vector
 */

export const IDENTITY = [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1];

/** Return the product a b. @param {Matrix} a @param {Matrix} b */
export function multiply(a, b) {
  const product = new Float64Array(16);
  for (let column = 0; column < 4; column += 1) {
    for (let row = 0; row < 4; row += 1) {
      let sum = 0;
      for (let k = 0; k < 4; k += 1) sum += a[4 * k + row] * b[4 * column + k];
      product[4 * column + row] = sum;
    }
  }
  return product;
}

/** Return the inverse, by Gauss-Jordan elimination. @param {Matrix} matrix */
export function invert(matrix) {
  const [from, to] = [Float64Array.from(matrix), Float64Array.from(IDENTITY)];
  for (let column = 0; column < 4; column += 1) {
    let pivot = column;
    for (let row = column; row < 4; row += 1) {
      if (Math.abs(from[4 * column + row]) > Math.abs(from[4 * column + pivot])) pivot = row;
    }
    for (const side of [from, to]) {
      for (let k = 0; k < 4; k += 1) [side[4 * k + column], side[4 * k + pivot]] = [side[4 * k + pivot], side[4 * k + column]];
    }
    const scale = 1 / from[4 * column + column];
    for (const side of [from, to]) for (let k = 0; k < 4; k += 1) side[4 * k + column] *= scale;
    for (let row = 0; row < 4; row += 1) {
      const factor = from[4 * column + row];
      if (row === column || !factor) continue;
      for (const side of [from, to]) for (let k = 0; k < 4; k += 1) side[4 * k + row] -= factor * side[4 * k + column];
    }
  }
  return to;
}

/** Return the upper left (3, 3) of a matrix, column after column. @param {Matrix} matrix */
export function rotationOf(matrix) {
  return [0, 1, 2, 4, 5, 6, 8, 9, 10].map((k) => matrix[k]);
}
