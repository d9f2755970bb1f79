/** Light that reaches the vertices of a face as it turns and opens its mouth: what `face_light.py` of the desktop player does. */
import { checkedList, checkedNumber, checkedNumbers, refuse } from "./container.js";

/** @typedef {import("./container.js").Arrays} Container */

const KEY = [0.7, 0.68, 0.8]; // directions of key and rim light, as in shaders/lighting.glsl
const RIM = [-0.55, 0.5, -0.85];
export const HARMONICS = 16;
const MOUTH_SHUT = 0.01; // lips count as shut up to this share, as positions are not exact
const MOUTH_CURVE = 0.4; // the first millimetres of an open mouth let in most of the light
const TEETH_FILL = 0.56; // share of the missing light that is added on teeth when the mouth is open
const FREE = [0.9, 0.8, 0, 0.3]; // on a tongue that is put out
const STEPS = 100; // in which turns and mouth are rounded: light changes by less than can be seen

/** Light on a face: four shares a vertex, key light, sky, through the skin, rim light. */
export class FaceLight {
  /** @param {Container} container @param {Record<string, any>} header @param {import("./parts.js").Part[]} parts @param {Float32Array} sway */
  constructor(container, header, parts, sway) {
    const count = sway.length;
    this.values = new Float32Array(4 * count);
    this._basis = checkedNumbers(header.basis, "the basis of the light", undefined);
    this._size = this._basis.length / HARMONICS;
    this._visible = checkedNumber(header.visible, "the numbers of the light", this._size + 1);
    this._shut = container.fractions(header.shut, "the light", count, this._size + 1);
    this._near = container.indices(header.near, "vertices near the mouth", count, undefined, 1);
    this._wide = container.fractions(header.wide, "the light of an open mouth", this._near.length, this._size + 1);
    this._table = this._shut.slice();
    this._lips = checkedList(header.lips, "lips").map((lip) => checkedNumber(lip, "a vertex of the lips", count));
    if (this._lips.length % 2 || this._lips.length > 2) refuse(`has ${this._lips.length} lips, expected 2`);
    this._gaps = checkedNumbers(header.gaps, "the gaps of the lips", 2);
    this._reach = checkedNumber(header.reach, "the reach of the tongue");
    this._teeth = parts.filter(({ kind }) => kind === "teeth");
    this._tongues = parts.filter(({ kind }) => kind === "tongue");
    this._sway = sway;
    this._open = 0;
    this._last = "";
  }

  /**
   * Compute the light. positions: without the turns of parts and head. matrix: of the head into the world. still: where its
   * neck stands, if that bends.
   * @param {Float32Array} positions @param {Float64Array} matrix @param {Float64Array} still
   */
  shade(positions, matrix, still) {
    const open = this._mouthOpen(positions);
    const out = this._tongues.length && this._tongueOut(positions);
    const state = [open, out, ...[...matrix, ...still].map((entry) => Math.round(STEPS * entry))].join();
    if (state === this._last) return;
    this._last = state;
    const columns = this._size + 1;
    if (open !== this._open) this._open_(open, columns);
    const now = this._weights(matrix);
    const rest = this._weights(still);
    const { values, _table: table, _sway: sway, _visible: visible, _size: size } = this;
    for (let vertex = 0, at = 0, to = 0; vertex < sway.length; vertex += 1, at += columns, to += 4) {
      const share = sway[vertex];
      let key = 0, rim = 0, back = 0; // prettier-ignore
      for (let k = 0; k < visible; k += 1) {
        key += table[at + k] * (rest.key[k] + share * (now.key[k] - rest.key[k]));
        rim += table[at + k] * (rest.rim[k] + share * (now.rim[k] - rest.rim[k]));
      }
      for (let k = visible; k < size; k += 1) back += table[at + k] * (rest.rim[k] + share * (now.rim[k] - rest.rim[k]));
      values[to] = Math.min(Math.max(key, 0), 1);
      values[to + 1] = table[at + size];
      values[to + 2] = Math.min(Math.max(back, 0), 1);
      values[to + 3] = Math.min(Math.max(rim, 0), 1);
    }
    for (const { first, count } of this._teeth) {
      for (let at = 4 * first; at < 4 * (first + count); at += 4) {
        for (let k = at; k < at + 2; k += 1) values[k] += TEETH_FILL * open * (1 - values[k]);
      }
    }
    if (out) this._freeTongue(positions);
  }

  /** Return how far the mouth is open, 0..1. @param {Float32Array} positions */
  _mouthOpen(positions) {
    if (!this._lips.length) return 0;
    const [upper, lower] = this._lips.map((lip) => 3 * lip);
    const gap = Math.hypot(positions[upper] - positions[lower], positions[upper + 1] - positions[lower + 1], positions[upper + 2] - positions[lower + 2]);
    const share = (gap - this._gaps[0]) / Math.max(this._gaps[1] - this._gaps[0], 1e-6);
    const open = (share - MOUTH_SHUT) / (1 - MOUTH_SHUT);
    return Math.round(Math.min(Math.max(open, 0), 1) ** MOUTH_CURVE * STEPS) / STEPS;
  }

  /** Bring the table in line with the mouth. @param {number} open @param {number} columns */
  _open_(open, columns) {
    this._open = open;
    const { _near: near, _wide: wide, _table: table, _shut: shut } = this;
    for (let place = 0, from = 0; place < near.length; place += 1) {
      for (let at = columns * near[place], stop = at + columns; at < stop; at += 1, from += 1) table[at] = shut[at] + open * wide[from];
    }
  }

  /** Return the weights of a vertex's numbers for key and rim light. @param {Float64Array} matrix of the head */
  _weights(matrix) {
    const [key, rim] = [KEY, RIM].map((lamp) => {
      const seen = harmonics([0, 4, 8].map((at) => matrix[at] * lamp[0] + matrix[at + 1] * lamp[1] + matrix[at + 2] * lamp[2]));
      return Float64Array.from({ length: this._size }, (_, row) => seen.reduce((sum, value, k) => sum + value * this._basis[HARMONICS * row + k], 0));
    });
    return { key, rim };
  }

  /** Return how far the tongues are out between the lips, as a sum over their vertices. @param {Float32Array} positions */
  _tongueOut(positions) {
    let sum = 0;
    for (const { first, count } of this._tongues) for (let at = first; at < first + count; at += 1) sum += this._out(positions, at);
    return sum;
  }

  /** Return how far a vertex is out between the lips, 0..1. @param {Float32Array} positions @param {number} vertex */
  _out(positions, vertex) {
    const lips = this._lips.length ? Math.min(positions[3 * this._lips[0] + 2], positions[3 * this._lips[1] + 2]) : Infinity;
    return Math.min(Math.max((positions[3 * vertex + 2] - lips) / this._reach, 0), 1);
  }

  /** @param {Float32Array} positions */
  _freeTongue(positions) {
    for (const { first, count } of this._tongues) {
      for (let vertex = first; vertex < first + count; vertex += 1) {
        const share = this._out(positions, vertex);
        for (let k = 0; k < 4; k += 1) this.values[4 * vertex + k] += share * (FREE[k] - this.values[4 * vertex + k]);
      }
    }
  }
}

/** Return the light on a body that its folds leave. @param {Container} container @param {Record<string, any>} header @param {number} count of vertices */
export function bodyLight(container, header, count) {
  const open = container.fractions(header.open, "the light on the body", count, 1);
  const [key, sky, through, rim] = checkedNumbers(header.light, "the light on a body", 4);
  const values = new Float32Array(4 * count);
  for (let at = 0; at < count; at += 1) values.set([key, sky * open[at], through, rim * open[at]], 4 * at);
  return values;
}

/** Return the spherical harmonics of a direction, up to the third band. @param {number[]} direction */
export function harmonics(direction) {
  const length = Math.hypot(...direction) || 1;
  const [x, y, z] = direction.map((number) => number / length);
  return [
    0.282095, 0.488603 * y, 0.488603 * z, 0.488603 * x, 1.092548 * x * y, 1.092548 * y * z, 0.315392 * (3 * z * z - 1),
    1.092548 * x * z, 0.546274 * (x * x - y * y), 0.590044 * y * (3 * x * x - y * y), 2.890611 * x * y * z,
    0.457046 * y * (5 * z * z - 1), 0.373176 * z * (5 * z * z - 3), 0.457046 * x * (5 * z * z - 1),
    1.445306 * z * (x * x - y * y), 0.590044 * x * (x * x - 3 * y * y),
  ]; // prettier-ignore
}
