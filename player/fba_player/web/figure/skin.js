/** Moves vertices with joints by dual quaternions: what `fba.body.skin` does, with twisted limbs, girdles and armpits. */
import { checkedList, checkedNumber, checkedNumbers } from "./container.js";
import { multiply, quaternion } from "./matrices.js";

/** @typedef {import("./container.js").Arrays} Container */
/** @typedef {{joint: number, child: number, count: number, centre: Float64Array, axis: Float64Array, childAxis: Float64Array}} Bone */
/** @typedef {{joints: number[], centre: Float64Array, arm: Float64Array}} Girdle */

const LIFT = 0.16; // turn of the shoulder blade, relative to the arm's swing; the collar bone turns by half of that
const SMALLEST = 1e-30;
const INFLUENCES = 4;

/** The joints that carry the vertices of a mesh, and by how much. */
export class Skin {
  /** @param {Container} container @param {Record<string, any>} header @param {number} vertices @param {number} joints @param {number[]} parents @param {Float64Array[]} inverse inverses of the joints as modelled */
  constructor(container, header, vertices, joints, parents, inverse) {
    /** Four joints a vertex, the strongest first. */
    this.joints = container.indices(header.joints, "joints of vertices", joints, vertices, INFLUENCES);
    const lesser = container.fractions(header.weights, "weights of vertices", vertices, INFLUENCES - 1);
    /** Their weights, with a sum of 1. */
    this.weights = new Float32Array(INFLUENCES * vertices);
    for (let at = 0, to = 0; at < lesser.length; at += 3, to += INFLUENCES) {
      this.weights[to] = 1 - lesser[at] - lesser[at + 1] - lesser[at + 2];
      for (let k = 0; k < 3; k += 1) this.weights[to + 1 + k] = lesser[at + k];
    }
    this._parents = parents;
    this._inverse = inverse;
    this._duals = new Float64Array(8 * joints);
    this._matrix = new Float64Array(16);
    this._rows = new Float64Array(12 * joints);
    const number = (/** @type {unknown} */ joint) => checkedNumber(joint, "a joint", joints);
    /** @type {Bone[]} */
    this._bones = checkedList(header.bones, "bones").map((bone) => ({
      joint: number(bone.joint),
      child: number(bone.child),
      count: checkedNumber(bone.count, "the vertices of a bone", vertices + 1),
      centre: checkedNumbers(bone.centre, "a bone", 3),
      axis: checkedNumbers(bone.axis, "a bone", 3),
      childAxis: checkedNumbers(bone.childAxis, "a bone", 3),
    }));
    const turned = this._bones.reduce((sum, { count }) => sum + count, 0);
    this._turned = container.indices(header.turned, "vertices that twist", vertices, turned, 1);
    this._shares = container.fractions(header.shares, "shares of twists", turned, 2);
    /** @type {Girdle[]} */
    this._girdles = checkedList(header.girdles, "shoulder girdles").map((girdle) => ({
      joints: Array.from(checkedNumbers(girdle.joints, "joints of a girdle", 4), number),
      centre: checkedNumbers(girdle.centre, "a girdle", 3),
      arm: checkedNumbers(girdle.arm, "a girdle", 3),
    }));
    this._armpits = container.indices(header.armpits, "vertices of armpits", vertices, undefined, 1);
    this._straight = container.fractions(header.straight, "shares of armpits", this._armpits.length, 1);
    this._twisted = new Float32Array(3 * vertices);
  }

  /**
   * Write the vertices and normals of a mesh for joint matrices, 16 numbers each.
   * @param {Float64Array} matrices @param {Float32Array} vertices as modelled @param {Float32Array} normals as modelled @param {Float32Array} out @param {Float32Array} outNormals
   */
  apply(matrices, vertices, normals, out, outNormals) {
    this._findDuals(matrices);
    this._twisted.set(vertices);
    this._twist(vertices);
    for (const girdle of this._girdles) this._turnGirdle(girdle);
    this._findRows();
    this._blend(this._twisted, normals, out, outNormals);
    this._straighten(out);
    const [x, y, z] = [matrices[12], matrices[13], matrices[14]];
    for (let at = 0; at < out.length; at += 3) {
      out[at] += x;
      out[at + 1] += y;
      out[at + 2] += z;
    }
  }

  /** Find each joint's rotation, and half its shift from the root times it; of two signs, the one nearer to its parent's. @param {Float64Array} matrices */
  _findDuals(matrices) {
    const { _duals: duals, _matrix: matrix } = this;
    for (let joint = 0, at = 0; joint < this._parents.length; joint += 1, at += 8) {
      multiply(matrices.subarray(16 * joint, 16 * joint + 16), this._inverse[joint], matrix);
      quaternion(matrix, duals, at);
      const above = 8 * this._parents[joint];
      if (above >= 0) {
        const nearer = duals[at] * duals[above] + duals[at + 1] * duals[above + 1] + duals[at + 2] * duals[above + 2] + duals[at + 3] * duals[above + 3];
        if (nearer < 0) for (let k = at; k < at + 4; k += 1) duals[k] = -duals[k];
      }
      const w = duals[at], x = duals[at + 1], y = duals[at + 2], z = duals[at + 3]; // prettier-ignore
      const tx = matrix[12] - matrices[12], ty = matrix[13] - matrices[13], tz = matrix[14] - matrices[14]; // prettier-ignore
      duals[at + 4] = -0.5 * (tx * x + ty * y + tz * z);
      duals[at + 5] = 0.5 * (tx * w + ty * z - tz * y);
      duals[at + 6] = 0.5 * (ty * w + tz * x - tx * z);
      duals[at + 7] = 0.5 * (tz * w + tx * y - ty * x);
    }
  }

  /** Turn vertices of limbs about their bones. @param {Float32Array} vertices */
  _twist(vertices) {
    let k = 0;
    for (const { joint, child, count, centre, axis, childAxis } of this._bones) {
      const own = this._twistOf(joint, axis);
      const next = this._twistOf(child, childAxis);
      const [ax, ay, az] = axis;
      for (const stop = k + count; k < stop; k += 1) {
        const at = 3 * this._turned[k];
        const angle = this._shares[2 * k] * own + this._shares[2 * k + 1] * next;
        const s = Math.sin(angle);
        const c = Math.cos(angle);
        const px = vertices[at] - centre[0];
        const py = vertices[at + 1] - centre[1];
        const pz = vertices[at + 2] - centre[2];
        const along = (ax * px + ay * py + az * pz) * (1 - c);
        this._twisted[at] = px * c + (ay * pz - az * py) * s + ax * along + centre[0];
        this._twisted[at + 1] = py * c + (az * px - ax * pz) * s + ay * along + centre[1];
        this._twisted[at + 2] = pz * c + (ax * py - ay * px) * s + az * along + centre[2];
      }
    }
  }

  /** Return a joint's turn about an axis, fading to 0 where the limb is turned back on itself. @param {number} joint @param {Float64Array} axis */
  _twistOf(joint, axis) {
    if (this._parents[joint] < 0) return 0;
    const [w, x, y, z] = this._relative(this._parents[joint], joint);
    const about = axis[0] * x + axis[1] * y + axis[2] * z;
    return 2 * Math.atan2(about, w) * smoothstep((w * w + about * about - 0.03) / 0.12);
  }

  /** Return the rotation of one joint seen from another. @param {number} one @param {number} other @returns {[number, number, number, number]} */
  _relative(one, other) {
    const [w, x, y, z] = this._duals.subarray(8 * one, 8 * one + 4);
    const [a, b, c, d] = this._duals.subarray(8 * other, 8 * other + 4);
    return [w * a + x * b + y * c + z * d, w * b - x * a - y * d + z * c, w * c + x * d - y * a - z * b, w * d - x * c + y * b - z * a];
  }

  /** Turn collar bone and shoulder blade with the arm. @param {Girdle} girdle */
  _turnGirdle({ joints: [trunk, inner, outer, shoulder], centre, arm }) {
    const [w, x, y, z] = this._relative(trunk, shoulder);
    const [ax, ay, az] = arm;
    const [ux, uy, uz] = [y * az - z * ay, z * ax - x * az, x * ay - y * ax];
    const dx = ax + 2 * (w * ux + y * uz - z * uy);
    const dy = ay + 2 * (w * uy + z * ux - x * uz);
    const dz = az + 2 * (w * uz + x * uy - y * ux);
    const [cx, cy, cz] = [ay * dz - az * dy, az * dx - ax * dz, ax * dy - ay * dx];
    const sine = Math.sqrt(cx * cx + cy * cy + cz * cz);
    if (sine < 1e-6) return;
    const cosine = ax * dx + ay * dy + az * dz;
    const wanted = LIFT * Math.atan2(sine, cosine) * smoothstep((cosine + 1) / 0.15); // near 180 degrees the axis is undefined
    const [a, b, c, d] = this._relative(trunk, outer);
    const along = (b * cx + c * cy + d * cz) / sine;
    const turned = 2 * Math.atan2(a >= 0 ? along : -along, Math.abs(a));
    const angle = wanted - Math.min(Math.max(turned, 0), wanted);
    this._turn(outer, angle, cx / sine, cy / sine, cz / sine, centre);
    this._turn(inner, angle / 2, cx / sine, cy / sine, cz / sine, centre);
  }

  /** Turn a joint about an axis through a point, before its own motion. @param {number} joint @param {number} angle @param {number} cx @param {number} cy @param {number} cz @param {Float64Array} centre */
  _turn(joint, angle, cx, cy, cz, [px, py, pz]) {
    const s = Math.sin(angle / 2);
    const g = Math.cos(angle / 2);
    const [h, i, j] = [s * cx, s * cy, s * cz];
    const [e, f, k] = [py * j - pz * i, pz * h - px * j, px * i - py * h];
    const [w, x, y, z, a, b, c, d] = this._duals.subarray(8 * joint, 8 * joint + 8);
    const first = [w * g - x * h - y * i - z * j, w * h + x * g + y * j - z * i, w * i + y * g + z * h - x * j, w * j + z * g + x * i - y * h];
    this._duals.set(first, 8 * joint);
    this._duals[8 * joint + 4] = a * g - b * h - c * i - d * j - x * e - y * f - z * k;
    this._duals[8 * joint + 5] = a * h + b * g + c * j - d * i + w * e + y * k - z * f;
    this._duals[8 * joint + 6] = a * i + c * g + d * h - b * j + w * f + z * e - x * k;
    this._duals[8 * joint + 7] = a * j + d * g + b * i - c * h + w * k + x * f - y * e;
  }

  /** Find the matrices of the joints, three rows of four numbers. */
  _findRows() {
    const { _duals: duals, _rows: rows } = this;
    for (let at = 0, to = 0; at < duals.length; at += 8, to += 12) {
      const w = duals[at], x = duals[at + 1], y = duals[at + 2], z = duals[at + 3]; // prettier-ignore
      const a = duals[at + 4], b = duals[at + 5], c = duals[at + 6], d = duals[at + 7]; // prettier-ignore
      rows[to] = 1 - 2 * (y * y + z * z);
      rows[to + 1] = 2 * (x * y - w * z);
      rows[to + 2] = 2 * (x * z + w * y);
      rows[to + 3] = 2 * (w * b - x * a + y * d - z * c);
      rows[to + 4] = 2 * (x * y + w * z);
      rows[to + 5] = 1 - 2 * (x * x + z * z);
      rows[to + 6] = 2 * (y * z - w * x);
      rows[to + 7] = 2 * (w * c - y * a + z * b - x * d);
      rows[to + 8] = 2 * (x * z - w * y);
      rows[to + 9] = 2 * (y * z + w * x);
      rows[to + 10] = 1 - 2 * (x * x + y * y);
      rows[to + 11] = 2 * (w * d - z * a + x * c - y * b);
    }
  }

  /** @param {Float32Array} vertices @param {Float32Array} normals @param {Float32Array} out @param {Float32Array} outNormals */
  _blend(vertices, normals, out, outNormals) {
    const { joints, weights, _duals: duals, _rows: rows } = this;
    for (let vertex = 0, at = 0; at < vertices.length; vertex += INFLUENCES, at += 3) {
      const px = vertices[at], py = vertices[at + 1], pz = vertices[at + 2]; // prettier-ignore
      const nx = normals[at], ny = normals[at + 1], nz = normals[at + 2]; // prettier-ignore
      if (weights[vertex + 1] === 0) {
        for (let row = 12 * joints[vertex], axis = at; axis < at + 3; row += 4, axis += 1) {
          out[axis] = rows[row] * px + rows[row + 1] * py + rows[row + 2] * pz + rows[row + 3];
          outNormals[axis] = rows[row] * nx + rows[row + 1] * ny + rows[row + 2] * nz;
        }
        continue;
      }
      let w = 0, x = 0, y = 0, z = 0, a = 0, b = 0, c = 0, d = 0; // prettier-ignore
      for (let k = vertex; k < vertex + INFLUENCES && weights[k] !== 0; k += 1) {
        const share = weights[k];
        const from = 8 * joints[k];
        w += share * duals[from];
        x += share * duals[from + 1];
        y += share * duals[from + 2];
        z += share * duals[from + 3];
        a += share * duals[from + 4];
        b += share * duals[from + 5];
        c += share * duals[from + 6];
        d += share * duals[from + 7];
      }
      const factor = 2 / Math.max(w * w + x * x + y * y + z * z, SMALLEST);
      const ux = y * pz - z * py + w * px;
      const uy = z * px - x * pz + w * py;
      const uz = x * py - y * px + w * pz;
      out[at] = px + factor * (y * uz - z * uy + w * b - x * a + y * d - z * c);
      out[at + 1] = py + factor * (z * ux - x * uz + w * c - y * a + z * b - x * d);
      out[at + 2] = pz + factor * (x * uy - y * ux + w * d - z * a + x * c - y * b);
      const vx = y * nz - z * ny + w * nx;
      const vy = z * nx - x * nz + w * ny;
      const vz = x * ny - y * nx + w * nz;
      outNormals[at] = nx + factor * (y * vz - z * vy);
      outNormals[at + 1] = ny + factor * (z * vx - x * vz);
      outNormals[at + 2] = nz + factor * (x * vy - y * vx);
    }
  }

  /** Blend the vertices of armpits with linear skinning. @param {Float32Array} out */
  _straighten(out) {
    const { joints, weights, _twisted: vertices, _rows: rows } = this;
    for (let k = 0; k < this._armpits.length; k += 1) {
      const at = 3 * this._armpits[k];
      const straight = this._straight[k];
      for (let axis = 0; axis < 3; axis += 1) {
        let sum = 0;
        for (let slot = 0; slot < INFLUENCES; slot += 1) {
          const influence = INFLUENCES * this._armpits[k] + slot;
          const row = 12 * joints[influence] + 4 * axis;
          sum += weights[influence] * (rows[row] * vertices[at] + rows[row + 1] * vertices[at + 1] + rows[row + 2] * vertices[at + 2] + rows[row + 3]);
        }
        out[at + axis] += straight * (sum - out[at + axis]);
      }
    }
  }
}

/** @param {number} share */
function smoothstep(share) {
  const t = Math.min(Math.max(share, 0), 1);
  return t * t * (3 - 2 * t);
}
