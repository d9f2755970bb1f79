/** What all heads of .glb files have: looks of their parts, round eyes, the bend of the neck, motion as tracks. */
import { PER_DISTANCE } from "./fba_face.js";
import { MEMORY } from "./container.js";
import { Face } from "./face.js";
import { MOST_VERTICES, refuse } from "./glb.js";

/**
 * @typedef {import("./glb.js").Primitive} Primitive
 * @typedef {import("./glb.js").Material} Material
 * @typedef {import("./fba_face.js").Point} Point
 */

export const ADULT_EYES = 0.062; // metres between them
/** Gloss of a material, never 0, which is that of hair painted on skin. @param {{roughness: number}} material */
export const glossOf = (material) => Math.max(1 - material.roughness, 0.03);
const MOST_SURFACES = 16; // that meet at one place
const [SEAM_COSINE, SEAM_MOTION] = [0.7, 0.01];
const [FEWEST, ROUNDNESS, FLAT] = [12, 0.03, 0.3]; // of an eyeball: vertices, error, depth by width
/** @type {Record<string, number>} */
const SCATTER = { skin: 1, tongue: 0.8, mouth: 0.8, teeth: 0.5, eye: 0.3 };
const TWO_SIDED = ["brow", "lash", "hair", "other", "teeth", "tongue"];

/**
 * Return a part for the header of a face.
 * @param {string} name @param {string} kind @param {Primitive} primitive @param {Material & {alpha: string | null}} material @param {boolean} ball whether it is a round eye
 */
export function partHeader(name, kind, primitive, material, ball) {
  const { positions, texcoords, colours, triangles } = primitive;
  const pictured = material.texture && texcoords;
  return {
    name,
    kind,
    count: positions.length / 3,
    triangles,
    colour: [...material.colour],
    gloss: glossOf(material),
    colours: colours?.map((value, at) => (at % 4 < 3 ? Math.sqrt(Math.min(Math.max(value, 0), 1)) : value)), // as packed ones, roots of light
    texture: pictured ? material.texture : undefined,
    texcoords,
    opacity: material.opacity,
    alpha: material.alpha,
    cutoff: material.cutoff,
    twoSided: material.twoSided || TWO_SIDED.includes(kind),
    scatter: SCATTER[kind] ?? 0,
    opaque: !pictured || !hasAlpha(/** @type {Uint8Array} */ (material.texture)),
    ball,
  };
}

/** Whether pixels of a picture can be transparent. @param {Uint8Array} picture */
function hasAlpha(picture) {
  const kind = String.fromCharCode(...picture.subarray(0, 4), ...picture.subarray(12, 16));
  if (kind.startsWith("\x89PNG")) return (picture[25] & 4) > 0;
  return kind.startsWith("RIFF") && (kind.endsWith("VP8X") ? (picture[20] & 16) > 0 : kind.endsWith("VP8L"));
}

/** Return the lowest and the highest corner of points. @param {ArrayLike<number>} positions */
export function boxOf(positions) {
  const [low, high] = [[Infinity, Infinity, Infinity], [-Infinity, -Infinity, -Infinity]];
  for (let at = 0; at < positions.length; at += 1) {
    low[at % 3] = Math.min(low[at % 3], positions[at]);
    high[at % 3] = Math.max(high[at % 3], positions[at]);
  }
  return [low, high];
}

/** Return the sphere that fits a part, or null if it is not round; as the desktop player's `find_eyeball`. @param {Float32Array} positions */
export function findBall(positions) {
  const [low, high] = boxOf(positions);
  const widths = high.map((most, axis) => most - low[axis]);
  if (positions.length < 3 * FEWEST || Math.min(...widths) < FLAT * Math.max(...widths)) return null;
  let rows = Array.from({ length: positions.length / 3 }, (_, row) => row);
  let away = [0];
  let ball = { centre: [0, 0, 0], radius: 0 };
  for (let round = 0; round < 4; round += 1) { // without what stands out, such as a cornea
    ball = fitSphere(positions, rows);
    const { centre, radius } = ball;
    away = Array.from({ length: positions.length / 3 }, (_, row) => Math.abs(Math.hypot(...centre.map((place, axis) => positions[3 * row + axis] - place)) - radius));
    const most = Math.max(quantile(away, 0.7), 1e-9);
    rows = [...away.keys()].filter((row) => away[row] <= most);
  }
  const round = ball.radius > 0 && quantile(away, 0.5) <= ROUNDNESS * ball.radius && Math.max(...widths) <= 2.4 * ball.radius;
  return round ? ball : null;
}

/** @param {number[]} values @param {number} share */
function quantile(values, share) {
  const sorted = Float64Array.from(values).sort();
  const place = share * (sorted.length - 1);
  const [low, high] = [sorted[Math.floor(place)], sorted[Math.ceil(place)]];
  return low + (high - low) * (place % 1);
}

/** Return the sphere nearest to points, by least squares. @param {Float32Array} positions @param {number[]} rows */
function fitSphere(positions, rows) {
  const middle = [0, 1, 2].map((axis) => rows.reduce((sum, row) => sum + positions[3 * row + axis], 0) / rows.length);
  const [products, sums] = [new Float64Array(9), [0, 0, 0]];
  let mean = 0;
  for (const row of rows) {
    const near = middle.map((place, axis) => positions[3 * row + axis] - place);
    const square = near[0] ** 2 + near[1] ** 2 + near[2] ** 2;
    mean += square / rows.length;
    for (let i = 0; i < 3; i += 1) {
      sums[i] += (near[i] * square) / 2;
      for (let j = 0; j < 3; j += 1) products[3 * i + j] += near[i] * near[j];
    }
  }
  const columns = [0, 1, 2].map((axis) => [products[axis], products[3 + axis], products[6 + axis]]);
  const volume = determinant(columns);
  const shift = [0, 1, 2].map((axis) => determinant(columns.map((column, at) => (at === axis ? sums : column))) / volume);
  const square = shift.reduce((sum, part) => sum + part * part, 0);
  return { centre: middle.map((place, axis) => place + shift[axis]), radius: Math.sqrt(Math.max(mean + square, 0)) };
}

/** @param {number[][]} columns three */
function determinant([[a, b, c], [d, e, f], [g, h, i]]) {
  return a * (e * i - f * h) + b * (f * g - d * i) + c * (d * h - e * g);
}

/** @param {number} share */
function smooth(share) {
  const t = Math.min(Math.max(share, 0), 1);
  return t * t * (3 - 2 * t);
}

/** Meshes that become the parts of a face. @typedef {{name: string, kind: string, primitive: Primitive, header: Record<string, any>}} Piece */

/**
 * Return what all faces have. eyes: (left and right) the middles of both pupils, in the file's unit.
 * @param {Piece[]} pieces @param {Point[]} eyes @param {number} apart between them @param {number} factor by which all is scaled to metres @param {Point | null} chin @param {Point | null} lobe @param {number} nose from the eyes down to it
 */
export function commonHeader(pieces, eyes, apart, factor, chin, lobe, nose) {
  const middle = [0, 1, 2].map((axis) => (eyes[0][axis] + eyes[1][axis]) / 2);
  const count = pieces.reduce((sum, { header }) => sum + header.count, 0);
  if (!count || count > MOST_VERTICES) refuse(`has ${count} vertices, expected 1 to ${MOST_VERTICES}`);
  const [positions, sway] = [new Float32Array(3 * count), new Float32Array(count).fill(1)];
  const heads = pieces.filter(({ kind }) => kind === "skin");
  const top = Math.max(...(heads.length ? heads : pieces).map(({ primitive }) => boxOf(primitive.positions)[1][1]));
  const tall = 5.2 * nose;
  let low = chin ? chin[1] : top - tall;
  const highest = top - low > 0.5 * tall && top - low < 2 * tall ? top : low + tall; // high hair, a hat, or a body below
  let at = 0;
  for (const { kind, primitive, header } of pieces) {
    for (let k = 0; k < header.count; k += 1, at += 1) {
      const [, y, z] = primitive.positions.subarray(3 * k, 3 * k + 3);
      for (let axis = 0; axis < 3; axis += 1) positions[3 * at + axis] = factor * primitive.positions[3 * k + axis];
      if (!chin || !lobe || !["skin", "hair", "other"].includes(kind)) continue;
      const reach = 2.3 * nose; // over which the neck bends
      const along = Math.min(Math.max((z - lobe[2]) / Math.max(chin[2] - lobe[2], 1e-6), 0), 1);
      sway[at] = smooth(1 - (lobe[1] + (chin[1] - 0.12 * reach - lobe[1]) * along - y) / reach);
    }
  }
  const height = factor * (highest - low);
  const subject = {
    centre: [factor * middle[0], factor * (highest + low) / 2 - 0.07 * height, factor * middle[2] - 0.3 * height],
    halfHeight: 0.71 * height,
    halfWidth: 0.6 * height,
  };
  return { parts: pieces.map(({ header }) => header), positions, sway, subject, scale: (factor * apart) / ADULT_EYES };
}

/** Return an eyeball for a header. @param {number} part @param {{centre: Point, radius: number}} ball @param {number} side @param {number} iris diameter @param {number} factor @param {number[]} lids */
export function eyeHeader(part, { centre, radius }, side, iris, factor, lids) {
  return { part, centre: Array.from(centre, (place) => factor * place), numbers: [side, factor * radius, factor * iris, (factor * iris) / 3, (factor * iris) / PER_DISTANCE], lids };
}

/** Shapes, and which vertices they move by which value. */
export class Tracks {
  constructor() {
    /** @type {Record<string, any>[]} */
    this._tracks = [];
    /** @type {ArrayLike<number>[]} */
    this._rows = [];
    /** @type {Float32Array[]} */
    this._shapes = [];
  }

  /** @param {number} fap @param {number[]} borders @param {number[][]} curves @param {ArrayLike<number>} rows @param {Float32Array[]} shapes */
  add(fap, borders, curves, rows, shapes) {
    this._tracks.push({ fap, borders, curves, rows: rows.length });
    this._rows.push(rows);
    this._shapes.push(...shapes);
  }

  header() {
    const values = new Float32Array(this._shapes.reduce((sum, { length }) => sum + length, 0));
    const rows = new Uint32Array(this._rows.reduce((sum, { length }) => sum + length, 0));
    let at = 0;
    for (const shape of this._shapes) values.set(shape, (at += shape.length) - shape.length);
    at = 0;
    for (const listed of this._rows) rows.set(listed, (at += listed.length) - listed.length);
    return { tracks: this._tracks, rows, shapes: { array: { values, rows: values.length / 3, columns: 3 }, step: 1 } };
  }
}


/** Let vertices at one place share a normal, where they move alike, as `fba.face.Deformer` does. @param {Record<string, any>} header of a face @param {(Float32Array | null)[]} normals of its parts */
export function addSeams(header, normals) {
  const face = new Face(MEMORY, header);
  const rest = face.positions.slice();
  const motions = [1, -1].map((sign) => {
    face.pose(Float64Array.from({ length: 68 }, (_, column) => (column < 2 ? 0 : sign * (200 + 37 * (((column + 1) * 29) % 67)))));
    return face.positions.map((place, at) => place - rest[at]);
  });
  face.pose(new Float64Array(68));
  for (const [number, { first, count, normals: computed }] of face.parts.entries()) {
    const given = normals[number] ?? computed;
    /** @type {Map<string, number[]>} */
    const leaders = new Map();
    header.parts[number].seams = new Uint32Array(count).map((_, vertex) => {
      const at = 3 * (first + vertex);
      const place = `${rest[at]},${rest[at + 1]},${rest[at + 2]}`; // also of -0
      const others = leaders.get(place) ?? [];
      const leader = others.find((other) => alike(given, 3 * other, 3 * vertex) && motions.every((motion) => together(motion, 3 * (first + other), at)));
      if (leader !== undefined) return vertex - leader;
      if (others.length < MOST_SURFACES) leaders.set(place, [...others, vertex]);
      return 0;
    });
  }
}

/** @param {Float32Array} normals @param {number} one @param {number} other */
function alike(normals, one, other) {
  return normals[one] * normals[other] + normals[one + 1] * normals[other + 1] + normals[one + 2] * normals[other + 2] > SEAM_COSINE;
}

/** @param {Float32Array} motion @param {number} one @param {number} other */
function together(motion, one, other) {
  const far = Math.max(...[0, 1, 2].map((axis) => Math.abs(motion[one + axis])));
  return [0, 1, 2].every((axis) => Math.abs(motion[one + axis] - motion[other + axis]) <= SEAM_MOTION * far);
}
