/** The meshes of a figure: what they look like, and their normals as they move. */
import { checkedList, checkedNumber, checkedNumbers, refuse } from "./container.js";

/** @typedef {import("./container.js").Arrays} Container */

/**
 * A mesh of a figure, whose vertices are count from `first` on. positions, normals: three numbers each, in metres, which
 * move. triangles: three vertices each, counted from 0, counter-clockwise from
 * outside. leaders: for each vertex the first that shares its normal. colour: linear light. gloss: 1 - roughness. colours: linear light, three numbers each, glosses: one each, or
 * null where all vertices have `colour` and `gloss`. texture: bytes of a picture in sRGB that multiplies the colours, or
 * null. texcoords: two numbers each, from the picture's top left. alpha: what texture's alpha and opacity mean, as in
 * `fba.mesh.Material`. across: of single hairs, eight numbers each; scatter, folds, closed, smooth, opaque: as in `FaceShape` of the
 * desktop player, which says what shaders take. fine: strength and repetitions of the skin's relief. ball: whether it is an eyeball, which has a shader of its own.
 * @typedef {{
 *   name: string, kind: string, first: number, count: number, positions: Float32Array, normals: Float32Array,
 *   triangles: Uint32Array, leaders: Uint32Array, colour: Float64Array, gloss: number, colours: Float32Array | null, glosses: Float32Array | null,
 *   texture: Uint8Array | null, texcoords: Float32Array | null, opacity: number, alpha: string, cutoff: number,
 *   twoSided: boolean, across: Float32Array | null, scatter: number, folds: boolean, closed: boolean, smooth: boolean, opaque: boolean,
 *   fine: number[], ball: boolean,
 * }} Part
 */

const ALPHAS = ["auto", "opaque", "mask", "blend"];

/**
 * Return the parts that a header lists; positions and normals of all of them are handed in.
 * @param {Container} container @param {unknown} listed @param {Float32Array} positions @param {Float32Array} normals @returns {Part[]}
 */
export function readParts(container, listed, positions, normals) {
  let first = 0;
  const parts = checkedList(listed, "parts").map((/** @type {Record<string, any>} */ entry) => {
    const what = `part ${JSON.stringify(entry?.name)}`;
    const count = checkedNumber(entry.count, `the vertices of ${what}`, positions.length / 3 - first + 1);
    const part = { ...surface(container, entry, count, what), ...mesh(container, entry, count, what) };
    const [start, stop] = [3 * first, 3 * (first + count)];
    const moving = { first, positions: positions.subarray(start, stop), normals: normals.subarray(start, stop) };
    first += count;
    return { ...part, ...moving };
  });
  if (3 * first !== positions.length) refuse(`has ${positions.length / 3} vertices, expected the ${first} of its parts`);
  return parts;
}

/** @param {Container} container @param {Record<string, any>} entry @param {number} count @param {string} what */
function mesh(container, entry, count, what) {
  const corners = container.indices(entry.triangles, `the triangles of ${what}`, count, undefined, 1);
  if (corners.length % 3) refuse(`has ${corners.length} corners in ${what}, expected three a triangle`);
  const leaders = new Uint32Array(count).map((_, at) => at);
  if (entry.seams !== undefined) {
    const before = container.indices(entry.seams, `the seams of ${what}`, count, count, 1);
    for (let at = 0; at < count; at += 1) {
      if (before[at] > at) refuse(`has a seam before the first vertex of ${what}`);
      leaders[at] -= before[at];
    }
  }
  return { name: String(entry.name), kind: String(entry.kind), count, triangles: new Uint32Array(corners), leaders };
}

/** @param {Container} container @param {Record<string, any>} entry @param {number} count @param {string} what */
function surface(container, entry, count, what) {
  const coded = entry.colours === undefined ? null : container.fractions(entry.colours, `the colours of ${what}`, count, 4);
  const texture = entry.texture === undefined ? null : container.file(entry.texture, `the texture of ${what}`);
  return {
    colour: checkedNumbers(entry.colour, `the colour of ${what}`, 3),
    gloss: checkedNumber(entry.gloss, `the gloss of ${what}`),
    colours: coded && new Float32Array(3 * count).map((_, at) => coded[4 * Math.floor(at / 3) + (at % 3)] ** 2),
    glosses: coded && new Float32Array(count).map((_, at) => coded[4 * at + 3]),
    texture,
    texcoords: texture && container.fractions(entry.texcoords, `the texture coordinates of ${what}`, count, 2),
    opacity: checkedNumber(entry.opacity, `the opacity of ${what}`),
    alpha: ALPHAS.includes(entry.alpha) ? String(entry.alpha) : refuse(`has an unknown alpha in ${what}`),
    cutoff: checkedNumber(entry.cutoff, `the cutoff of ${what}`),
    twoSided: entry.twoSided === true,
    across: entry.across === undefined ? null : hairs(container, entry, count, what),
    scatter: checkedNumber(entry.scatter ?? 0, `the scattering of ${what}`),
    folds: entry.folds === true,
    closed: entry.closed === true,
    smooth: entry.smooth === true,
    opaque: entry.opaque !== false,
    fine: [...checkedNumbers(entry.fine ?? [0, 1], `the relief of ${what}`, 2)],
    ball: entry.ball === true,
  };
}

/** @param {Container} container @param {Record<string, any>} entry @param {number} count @param {string} what */
function hairs(container, entry, count, what) {
  const directions = container.fractions(entry.across, `the hairs of ${what}`, count, 7);
  const widths = container.fractions(entry.widths, `the widths of hairs of ${what}`, count, 1);
  return new Float32Array(8 * count).map((_, at) => {
    const [vertex, column] = [Math.floor(at / 8), at % 8];
    return column === 3 ? widths[vertex] : directions[7 * vertex + column - Number(column > 3)];
  });
}

/** Computes the normals of a part from its triangles, smooth across vertices at one place. */
export class Shading {
  /** @param {Part} part whose positions are neutral @param {Uint8Array} moving which of its vertices may move by themselves */
  constructor({ triangles, positions: rest, leaders }, moving) {
    const count = rest.length / 3;
    this._group = leaders;
    const corners = new Uint32Array(triangles.length);
    for (let at = 0; at < triangles.length; at += 1) corners[at] = leaders[triangles[at]];
    const sums = new Float32Array(3 * count);
    sum(triangles, corners, rest, sums);
    normalise(sums, sums);
    /** Neutral normals. */
    this.rest = new Float32Array(3 * count);
    for (let vertex = 0; vertex < count; vertex += 1) {
      for (let axis = 0; axis < 3; axis += 1) this.rest[3 * vertex + axis] = sums[3 * leaders[vertex] + axis];
    }
    const changing = new Uint8Array(count);
    for (let at = 0; at < triangles.length; at += 3) {
      if (moving[triangles[at]] || moving[triangles[at + 1]] || moving[triangles[at + 2]]) {
        for (let corner = at; corner < at + 3; corner += 1) changing[corners[corner]] = 1;
      }
    }
    let used = 0;
    this._triangles = new Uint32Array(triangles.length);
    this._corners = new Uint32Array(triangles.length);
    for (let at = 0; at < triangles.length; at += 3) {
      if (!changing[corners[at]] && !changing[corners[at + 1]] && !changing[corners[at + 2]]) continue;
      for (let corner = at; corner < at + 3; corner += 1, used += 1) {
        this._triangles[used] = triangles[corner];
        this._corners[used] = corners[corner];
      }
    }
    this._triangles = this._triangles.subarray(0, used);
    this._corners = this._corners.subarray(0, used);
    this._vertices = leaders.map((_, at) => at).filter((at) => changing[leaders[at]]);
    this._sums = sums;
  }

  /** Write the normals of vertices that triangles of moving ones touch. @param {Float32Array} positions @param {Float32Array} normals */
  update(positions, normals) {
    const { _sums: sums, _group: group, _vertices: vertices, rest } = this;
    for (let at = 0; at < vertices.length; at += 1) {
      const to = 3 * group[vertices[at]];
      sums[to] = sums[to + 1] = sums[to + 2] = 0;
    }
    sum(this._triangles, this._corners, positions, sums);
    for (let at = 0; at < vertices.length; at += 1) {
      const from = 3 * group[vertices[at]];
      const to = 3 * vertices[at];
      const x = sums[from];
      const y = sums[from + 1];
      const z = sums[from + 2];
      const length = Math.sqrt(x * x + y * y + z * z);
      const still = !(length > 1e-15);
      const scale = 1 / length;
      normals[to] = still ? rest[to] : x * scale;
      normals[to + 1] = still ? rest[to + 1] : y * scale;
      normals[to + 2] = still ? rest[to + 2] : z * scale;
    }
  }
}

/** Add the normal of each triangle, twice its area long, to its corners in sums. @param {Uint32Array} triangles @param {Uint32Array} corners @param {Float32Array} positions @param {Float32Array} sums */
function sum(triangles, corners, positions, sums) {
  for (let at = 0; at < triangles.length; at += 3) {
    const a = 3 * triangles[at];
    const b = 3 * triangles[at + 1];
    const c = 3 * triangles[at + 2];
    const x = positions[a];
    const y = positions[a + 1];
    const z = positions[a + 2];
    const ux = positions[b] - x;
    const uy = positions[b + 1] - y;
    const uz = positions[b + 2] - z;
    const vx = positions[c] - x;
    const vy = positions[c + 1] - y;
    const vz = positions[c + 2] - z;
    const nx = uy * vz - uz * vy;
    const ny = uz * vx - ux * vz;
    const nz = ux * vy - uy * vx;
    const i = 3 * corners[at];
    const j = 3 * corners[at + 1];
    const k = 3 * corners[at + 2];
    sums[i] += nx;
    sums[i + 1] += ny;
    sums[i + 2] += nz;
    sums[j] += nx;
    sums[j + 1] += ny;
    sums[j + 2] += nz;
    sums[k] += nx;
    sums[k + 1] += ny;
    sums[k + 2] += nz;
  }
}

/** Scale vectors to length 1; those without a direction point forward. @param {Float32Array} vectors @param {Float32Array} out */
export function normalise(vectors, out) {
  for (let at = 0; at < vectors.length; at += 3) {
    const x = vectors[at];
    const y = vectors[at + 1];
    const z = vectors[at + 2];
    const length = Math.sqrt(x * x + y * y + z * z);
    const still = !(length > 1e-15);
    out[at] = still ? 0 : x / length;
    out[at + 1] = still ? 0 : y / length;
    out[at + 2] = still ? 1 : z / length;
  }
}
