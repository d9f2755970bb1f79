/** Bakes the light on a head of a .glb file: what `face_light.py` and `occlusion.py` of the desktop player do. */
import { MEMORY } from "./container.js";
import { Face } from "./face.js";
import { HARMONICS, harmonics } from "./light.js";

const DIRECTIONS = Array.from({ length: 72 }, (_, k) => { // spread evenly over the sphere
  const [y, around] = [1 - (2 * k + 1) / 72, Math.PI * (1 + Math.sqrt(5)) * (k + 0.5)];
  return [Math.sqrt(1 - y * y) * Math.cos(around), y, Math.sqrt(1 - y * y) * Math.sin(around)];
});
const FLAT = Float64Array.from(DIRECTIONS.flat());
const BASIS = Float64Array.from(DIRECTIONS.flatMap(harmonics));
const COLUMNS = HARMONICS + 1; // and the open share of the sky
const SOFTNESS = [1, ...Array(3).fill(0.92), ...Array(5).fill(0.72), ...Array(7).fill(0.46)]; // of each harmonic, for large lights
const [PIXEL, MOST_PIXELS] = [0.002, 300]; // of depth maps, metres
const MOST_SHADED = 100_000; // vertices; on larger heads light is free
const MOST_DRAWN = 5_000_000; // pixels of a depth map, each time that one is drawn
const LEAST_SWAY = 0.05; // of vertices that are shaded: others do not go with the head
/** FAPs of closed eyes. @type {Record<number, number>} */
const LIDS_CLOSED = { 19: 1024, 20: 1024 };
const LID_MOVED = 0.008; // of closed lids' vertices that are lit like this, times the nose's length
/** FAPs of a mouth so wide open that light falls in. @type {Record<number, number>} */
const MOUTH_OPEN = { 3: 700, 4: -250, 8: -200, 9: -200, 5: -900, 10: -700, 11: -700, 51: -250, 55: -200, 56: -200, 52: -900, 57: -700, 58: -700 };

/**
 * Return the light of a header, as `FaceLight` takes it.
 * @param {Record<string, any>} header all else of a face @param {number[]} lips vertices at the middles of the lips, none where they are unknown @param {number} nose from the eyes down to it, metres
 */
export function bakeLight(header, lips, nose) {
  const face = new Face(MEMORY, header);
  const triangles = Uint32Array.from(face.parts.filter(({ kind }) => kind !== "lash" && kind !== "brow").flatMap(({ triangles, first }) => Array.from(triangles, (corner) => corner + first)));
  const all = [...face.sway.keys()];
  const small = all.length <= MOST_SHADED && triangles.length <= 6 * MOST_SHADED;
  const shaded = small ? all.filter((vertex) => face.sway[vertex] > LEAST_SWAY) : [];
  const shut = new Float32Array(COLUMNS * all.length);
  for (const vertex of all) shut.set([1 / BASIS[0]], COLUMNS * vertex), (shut[COLUMNS * vertex + HARMONICS] = 1);
  const baked = bake(face, triangles, shaded);
  shaded.forEach((vertex, at) => shut.set(baked.subarray(COLUMNS * at, COLUMNS * at + COLUMNS), COLUMNS * vertex));
  const gap = () => Math.hypot(...[0, 1, 2].map((axis) => face.positions[3 * lips[0] + axis] - face.positions[3 * lips[1] + axis]));
  const still = Float32Array.from(face.positions);
  face.pose(Float64Array.from({ length: 68 }, (_, column) => LIDS_CLOSED[column + 1] ?? 0));
  // Lids keep the light that falls on them closed: skin that comes out of a fold is lit then.
  const lids = shaded.filter((vertex) => Math.hypot(...[0, 1, 2].map((axis) => face.positions[3 * vertex + axis] - still[3 * vertex + axis])) > LID_MOVED * nose);
  bake(face, triangles, lids).forEach((value, at) => (shut[COLUMNS * lids[Math.floor(at / COLUMNS)] + (at % COLUMNS)] = value));
  face.pose(new Float64Array(68));
  const common = { shut, basis: SOFTNESS.flatMap((share, row) => SOFTNESS.map((_, column) => (row === column ? share : 0))), visible: HARMONICS, reach: 0.12 * nose };
  if (!lips.length || !small) return { ...common, lips: [], gaps: [0, 1], near: new Uint32Array(0), wide: new Float32Array(0) };
  const closed = gap();
  const middle = [0, 1, 2].map((axis) => (face.positions[3 * lips[0] + axis] + face.positions[3 * lips[1] + axis]) / 2);
  const near = all.filter((vertex) => Math.hypot(...middle.map((place, axis) => face.positions[3 * vertex + axis] - place)) < 1.1 * nose);
  face.pose(Float64Array.from({ length: 68 }, (_, column) => MOUTH_OPEN[column + 1] ?? 0));
  const wide = bake(face, triangles, near).map((value, at) => value - shut[COLUMNS * near[Math.floor(at / COLUMNS)] + (at % COLUMNS)]);
  return { ...common, lips, gaps: [closed, gap()], near: Uint32Array.from(near), wide };
}

/** Return what light from any direction reaches vertices past the mesh: harmonics, and the open share of the sky. @param {Face} face @param {Uint32Array} triangles @param {number[]} rows */
function bake({ positions, normals }, triangles, rows) {
  if (!rows.length) return new Float32Array(0); // a head too large, or without lids that move
  const [low, high] = [[Infinity, Infinity, Infinity], [-Infinity, -Infinity, -Infinity]];
  for (const row of rows) {
    for (let axis = 0; axis < 3; axis += 1) {
      low[axis] = Math.min(low[axis], positions[3 * row + axis]);
      high[axis] = Math.max(high[axis], positions[3 * row + axis]);
    }
  }
  const centre = low.map((least, axis) => (least + high[axis]) / 2);
  const reach = Math.max(Math.hypot(...high.map((most, axis) => most - centre[axis])), 1e-6);
  const size = Math.min(Math.max(Math.floor((2 * reach) / PIXEL), 16), MOST_PIXELS);
  const [seen, depth] = [new Float32Array(positions.length), new Float32Array(size * size)];
  const visible = DIRECTIONS.map((direction) => {
    project(positions, centre, reach, direction, size, seen);
    draw(seen, triangles, depth, size);
    return Float32Array.from(rows, (row) => read(seen, 3 * row, depth, size, reach, dot(normals, 3 * row, direction)));
  });
  const result = new Float32Array(COLUMNS * rows.length);
  const mirrored = new Float64Array(3);
  for (let at = 0, to = 0; at < rows.length; at += 1, to += COLUMNS) {
    const normal = normals.subarray(3 * rows[at], 3 * rows[at] + 3);
    let [open, all] = [0, 1e-9];
    for (let k = 0; k < DIRECTIONS.length; k += 1) {
      const up = dot(normal, 0, DIRECTIONS[k]);
      let counted = k;
      if (up < 0) { // below the horizon the surface hides itself, which shading by the normal accounts for already
        for (let axis = 0; axis < 3; axis += 1) mirrored[axis] = DIRECTIONS[k][axis] - 2 * up * normal[axis];
        counted = nearest(mirrored);
      }
      const free = visible[counted][at];
      const share = ((4 * Math.PI) / DIRECTIONS.length) * free;
      for (let harmonic = 0; harmonic < HARMONICS; harmonic += 1) result[to + harmonic] += share * BASIS[HARMONICS * k + harmonic];
      open += Math.max(up, 0) * free;
      all += Math.max(up, 0);
    }
    result[to + HARMONICS] = open / all;
  }
  return result;
}

/** @param {ArrayLike<number>} vectors @param {number} at @param {ArrayLike<number>} direction */
function dot(vectors, at, direction) {
  return vectors[at] * direction[0] + vectors[at + 1] * direction[1] + vectors[at + 2] * direction[2];
}

/** Return the number of the direction nearest to a vector. @param {Float64Array} vector */
function nearest(vector) {
  let best = -2;
  let found = 0;
  for (let k = 0; k < DIRECTIONS.length; k += 1) {
    const near = vector[0] * FLAT[3 * k] + vector[1] * FLAT[3 * k + 1] + vector[2] * FLAT[3 * k + 2];
    if (near > best) {
      best = near;
      found = k;
    }
  }
  return found;
}

/** Write places in a depth map, in pixels, and depths towards the viewer, who looks from a direction. @param {Float32Array} positions @param {number[]} centre @param {number} reach @param {number[]} direction @param {number} size @param {Float32Array} seen */
function project(positions, [cx, cy, cz], reach, [x, y, z], size, seen) {
  const flat = Math.abs(y) < 0.9 ? [-z, 0, x] : [0, z, -y];
  const [ax, ay, az] = flat.map((part) => part / Math.hypot(...flat));
  const [bx, by, bz] = [y * az - z * ay, z * ax - x * az, x * ay - y * ax];
  const half = size / 2;
  for (let at = 0; at < positions.length; at += 3) {
    const px = positions[at] - cx, py = positions[at + 1] - cy, pz = positions[at + 2] - cz; // prettier-ignore
    seen[at] = ((ax * px + ay * py + az * pz) / reach + 1) * half - 0.5;
    seen[at + 1] = ((bx * px + by * py + bz * pz) / reach + 1) * half - 0.5;
    seen[at + 2] = (x * px + y * py + z * pz) / reach;
  }
}

/** Draw the depths of triangles that face the viewer. @param {Float32Array} seen @param {Uint32Array} triangles @param {Float32Array} depth @param {number} size */
function draw(seen, triangles, depth, size) {
  depth.fill(-10);
  let drawn = 0;
  for (let at = 0; at < triangles.length; at += 3) {
    const a = 3 * triangles[at], b = 3 * triangles[at + 1], c = 3 * triangles[at + 2]; // prettier-ignore
    const ax = seen[a], ay = seen[a + 1], bx = seen[b], by = seen[b + 1], cx = seen[c], cy = seen[c + 1]; // prettier-ignore
    const area = (bx - ax) * (cy - ay) - (cx - ax) * (by - ay);
    if (!(area > 1e-9)) continue;
    const last = Math.min(Math.floor(Math.max(ay, by, cy)), size - 1);
    const right = Math.min(Math.floor(Math.max(ax, bx, cx)), size - 1);
    const left = Math.max(Math.ceil(Math.min(ax, bx, cx)), 0);
    for (let row = Math.max(Math.ceil(Math.min(ay, by, cy)), 0); row <= last && drawn < MOST_DRAWN; row += 1) {
      drawn += right - left + 1;
      for (let column = left; column <= right; column += 1) {
        const u = ((bx - column) * (cy - row) - (cx - column) * (by - row)) / area;
        const v = ((cx - column) * (ay - row) - (ax - column) * (cy - row)) / area;
        if (u < -1e-5 || v < -1e-5 || u + v > 1 + 1e-5) continue;
        const here = row * size + column;
        depth[here] = Math.max(depth[here], u * seen[a + 2] + v * seen[b + 2] + (1 - u - v) * seen[c + 2]);
      }
    }
  }
}

/** Return the visibility of a vertex, 0 to 1. @param {Float32Array} seen @param {number} at @param {Float32Array} depth @param {number} size @param {number} reach @param {number} facing cosine of its normal */
function read(seen, at, depth, size, reach, facing) {
  const column = Math.min(Math.max(Math.floor(seen[at]), 0), size - 2);
  const row = Math.min(Math.max(Math.floor(seen[at + 1]), 0), size - 2);
  const fx = Math.min(Math.max(seen[at] - column, 0), 1);
  const fy = Math.min(Math.max(seen[at + 1] - row, 0), 1);
  const slant = ((2 * reach) / size) * (1.2 + 1.5 / Math.max(Math.abs(facing), 0.15)); // the depth of a slanted surface changes within a pixel
  let free = 0;
  for (let k = 0; k < 4; k += 1) {
    const gap = (depth[(row + (k >> 1)) * size + column + (k & 1)] - seen[at + 2]) * reach;
    free += (k & 1 ? fx : 1 - fx) * (k >> 1 ? fy : 1 - fy) * Math.min(Math.max(2 - gap / slant, 0), 1);
  }
  return free;
}
