/**
 * Matrices of 16 numbers, column by column, as three.js and OpenGL have them.
 * @typedef {Float64Array | Float32Array | number[]} Matrix
 * @typedef {[number, number, number]} Vector
 */

export const IDENTITY = Float64Array.from([1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1]);

/** Write and return outer . inner; the result may be one of them. @param {Matrix} outer @param {Matrix} inner @param {Float64Array} [result] */
export function multiply(outer, inner, result = new Float64Array(16)) {
  const a = outer[0], b = outer[4], c = outer[8], d = outer[12]; // prettier-ignore
  const e = outer[1], f = outer[5], g = outer[9], h = outer[13]; // prettier-ignore
  const i = outer[2], j = outer[6], k = outer[10], l = outer[14]; // prettier-ignore
  const m = outer[3], n = outer[7], o = outer[11], p = outer[15]; // prettier-ignore
  for (let column = 0; column < 16; column += 4) {
    const x = inner[column];
    const y = inner[column + 1];
    const z = inner[column + 2];
    const w = inner[column + 3];
    result[column] = a * x + b * y + c * z + d * w;
    result[column + 1] = e * x + f * y + g * z + h * w;
    result[column + 2] = i * x + j * y + k * z + l * w;
    result[column + 3] = m * x + n * y + o * z + p * w;
  }
  return result;
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

/** Write the inverse of a rotation and shift; the result may be the same. @param {Float64Array} matrix @param {Float64Array} result */
export function invertRigid(matrix, result) {
  const [a, b, c, , d, e, f, , g, h, i, , x, y, z] = matrix;
  result.set([a, d, g, 0, b, e, h, 0, c, f, i, 0, -(a * x + b * y + c * z), -(d * x + e * y + f * z), -(g * x + h * y + i * z), 1]);
}

/** Set the matrix of a rotation about an axis times its angle, which leaves a centre where it is. @param {Float64Array} matrix @param {number} x @param {number} y @param {number} z @param {ArrayLike<number>} centre */
export function rotate(matrix, x, y, z, centre) {
  const angle = Math.sqrt(x * x + y * y + z * z);
  if (angle > 0) {
    x /= angle;
    y /= angle;
    z /= angle;
  }
  const c = Math.cos(angle);
  const s = Math.sin(angle);
  const d = 1 - c;
  setColumns(matrix, 0, x * x * d + c, y * x * d + z * s, z * x * d - y * s);
  setColumns(matrix, 4, x * y * d - z * s, y * y * d + c, z * y * d + x * s);
  setColumns(matrix, 8, x * z * d + y * s, y * z * d - x * s, z * z * d + c);
  for (let axis = 0; axis < 3; axis += 1) {
    matrix[12 + axis] = centre[axis] - (matrix[axis] * centre[0] + matrix[4 + axis] * centre[1] + matrix[8 + axis] * centre[2]);
  }
}

/** @param {Float64Array} matrix @param {number} at @param {number} x @param {number} y @param {number} z */
export function setColumns(matrix, at, x, y, z) {
  matrix[at] = x;
  matrix[at + 1] = y;
  matrix[at + 2] = z;
}

/** Write the unit quaternion w, x, y, z of a rotation, by its largest component. @param {ArrayLike<number>} matrix @param {Float64Array} result @param {number} [at] where to write */
export function quaternion(matrix, result, at = 0) {
  const a = matrix[0];
  const b = matrix[5];
  const c = matrix[10];
  const [x, y, z] = [matrix[6] - matrix[9], matrix[8] - matrix[2], matrix[1] - matrix[4]];
  const [xy, xz, yz] = [matrix[1] + matrix[4], matrix[2] + matrix[8], matrix[6] + matrix[9]];
  const trace = a + b + c;
  const largest = trace > 0 ? trace : Math.max(a, b, c);
  const root = Math.sqrt(1 + 2 * largest - (trace > 0 ? largest : trace));
  const half = 0.5 / root;
  const first = 0.5 * root;
  let [w, i, j, k] = [first, x * half, y * half, z * half];
  if (!(trace > 0)) {
    if (a >= b && a >= c) [w, i, j, k] = [x * half, first, xy * half, xz * half];
    else if (b >= c) [w, i, j, k] = [y * half, xy * half, first, yz * half];
    else [w, i, j, k] = [z * half, xz * half, yz * half, first];
  }
  const length = Math.sqrt(w * w + i * i + j * j + k * k);
  result[at] = w / length;
  result[at + 1] = i / length;
  result[at + 2] = j / length;
  result[at + 3] = k / length;
}

const TURN = new Float64Array(4);

/** Return the axis of a rotation times its angle, 0 to half a turn. @param {ArrayLike<number>} matrix @returns {[number, number, number]} */
export function turnVector(matrix) {
  quaternion(matrix, TURN);
  const [w, x, y, z] = TURN;
  const sine = Math.hypot(x, y, z);
  if (sine < 1e-12) return [0, 0, 0];
  const scale = ((w < 0 ? -2 : 2) * Math.atan2(sine, Math.abs(w))) / sine;
  return [x * scale, y * scale, z * scale];
}
