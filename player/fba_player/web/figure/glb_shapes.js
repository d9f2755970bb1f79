/** Heads of other programs in .glb files, which have morph targets named as ARKit's shapes. */
import { DEFINITIONS } from "../loader/definitions.js";
import { arkitNames } from "../loader/weights.js";
import { checkedList, checkedNumber } from "./container.js";
import { refuse } from "./glb.js";
import { bakeLight } from "./glb_light.js";
import { ADULT_EYES, Tracks, addSeams, commonHeader, eyeHeader, findBall, glossOf, partHeader } from "./glb_parts.js";
import { normalise } from "./parts.js";

/** @typedef {import("./glb.js").Glb} Glb */
/** @typedef {import("./glb.js").Primitive} Primitive */
/** @typedef {import("./glb.js").Material} Material */

const RADIAN = 1e-5;
const [PITCH, YAW, ROLL] = [48, 49, 50];
const EYE_FAPS = [[23, 25], [24, 26]]; // yaw and pitch, left and right
/** Where an adult's head has its points, from the middle between the eyes, metres. */
const [CHIN, LOBE, NECK, NOSE] = [[0, -0.107, -0.001], [0, -0.042, -0.076], [0, -0.03, -0.08], 0.048];
/** Names that say nothing. */
const GENERIC = /^(object|mesh|node|group|primitive)?[\s_.-]?\d*$/i;
/** Kinds of parts by words in their names. @type {[RegExp, string][]} */
const KINDS = [
  [/cornea|eye_?wet|tear|occlusion|highlight/i, "none"],
  [/lash|cilia|eye_?line/i, "lash"],
  [/brow/i, "brow"],
  [/glasses|eye_?wear/i, "other"],
  [/eye(?!_?(lid|socket))|iris|sclera|pupil/i, "eye"],
  [/teeth|tooth|denture|gum/i, "teeth"],
  [/tongue/i, "tongue"],
  [/mouth|oral|palate/i, "mouth"],
  [/hair|scalp|beard|moustache/i, "hair"],
];
const UNITS = [1, 0.1, 0.01, 0.001, 0.0254]; // metres of metres, decimetres, centimetres, millimetres, inches
const SIZES = [0.04, 0.08]; // metres between the eyes of people
const IRIS = 0.0118; // metres, of an adult
/** Colour and roughness of parts that have none of their own. @type {Record<string, [number, number, number, number]>} */
const LOOKS = {
  skin: [0.71, 0.47, 0.36, 0.55],
  teeth: [0.83, 0.8, 0.72, 0.25],
  tongue: [0.55, 0.16, 0.15, 0.4],
  mouth: [0.35, 0.1, 0.09, 0.4],
  brow: [0.06, 0.04, 0.03, 0.8],
  lash: [0.02, 0.015, 0.01, 0.8],
  hair: [0.06, 0.04, 0.03, 0.6],
};
const MOVED = 0.5; // share of the largest motion from which a vertex shows where a shape is

/** Return a face that ARKit's shapes move, as `fba.capture.to_blendshapes` mixes them. @param {Glb} glb */
export function shapedFace(glb) {
  const facing = glb.root.extensions?.VRM ? -1 : 1; // avatars of VRM 0 look to -z
  const names = new Set();
  const pieces = checkedList(glb.root.nodes, "nodes").flatMap((node, number) => {
    if (node.mesh === undefined) return [];
    const mesh = glb.entry("meshes", node.mesh);
    return checkedList(mesh.primitives, "primitives").map((entry) => {
      const material = glb.material(entry);
      const primitive = glb.primitive(entry, material.texcoord);
      const named = [mesh.primitives.length > 1 ? material.name : "", node.name, mesh.name, ...glb.namesAbove(number)];
      const name = named.find((given) => given && !GENERIC.test(given)) ?? "";
      const given = arkitNames(checkedList(mesh.extras?.targetNames ?? mesh.primitives[0].extras?.targetNames ?? [], "names of morph targets"));
      /** @type {Map<string, Float32Array>} */
      const shapes = new Map();
      primitive.targets.forEach((shift, at) => shift && given[at] && !shapes.has(given[at]) && shapes.set(given[at], shift));
      for (const shape of shapes.keys()) names.add(shape);
      place(glb, node, number, primitive, facing);
      const shades = [...material.colour, 0];
      primitive.colours = primitive.colours && primitive.colours.map((value, at) => (at % 4 < 3 ? value * shades[at % 4] : glossOf(material)));
      const kind = KINDS.find(([words]) => words.test(name))?.[1] ?? (shapes.size ? "skin" : "other");
      return { name: `${name} ${number}`, kind, primitive, material, shapes };
    });
  });
  if (!names.has("eyeBlinkLeft") || !names.has("eyeBlinkRight")) refuse("has neither FBA_face nor morph targets named as ARKit's shapes, such as eyeBlinkLeft and jawOpen", "unsupported");
  const shown = pieces.filter(({ kind }) => kind !== "none").map((piece) => {
    const ball = piece.kind === "eye" ? findBall(piece.primitive.positions) : null;
    return { ...piece, ball, header: partHeader(piece.name, piece.kind, piece.primitive, { ...looks(piece), alpha: piece.material.alpha ?? "opaque" }, ball !== null) };
  });
  const lids = ["eyeBlinkLeft", "eyeBlinkRight"].map((shape) => middleOfMotion(shown, shape));
  const balls = shown.flatMap(({ ball }) => (ball ? [ball] : [])).sort((one, other) => other.centre[0] - one.centre[0]);
  const eyes = balls.length === 2 ? balls.map(({ centre }) => centre) : lids;
  const apart = eyes[0][0] - eyes[1][0];
  if (!(apart > 0)) refuse("has its left eye on the right: expected a head that looks to +z");
  const size = apart / ADULT_EYES;
  const middle = [0, 1, 2].map((axis) => (eyes[0][axis] + eyes[1][axis]) / 2);
  const from = (/** @type {number[]} */ offset) => offset.map((by, axis) => middle[axis] + size * by);
  const factor = UNITS.find((unit) => apart * unit >= SIZES[0] && apart * unit <= SIZES[1]) ?? ADULT_EYES / apart;
  const header = commonHeader(shown, eyes, apart, factor, from(CHIN), from(LOBE), size * NOSE);
  const neck = from(NECK).map((place) => factor * place);
  const tracks = new Tracks();
  const weights = [...names];
  /** @type {Record<string, any>[]} */
  const transforms = [[YAW, [0, RADIAN, 0]], [ROLL, [0, 0, RADIAN]], [PITCH, [RADIAN, 0, 0]]].map(([fap, amount]) => ({ part: null, kind: "rotation", fap, amount, centre: neck }));
  const found = [];
  let start = 0;
  for (const [part, { name, ball, primitive, shapes }] of shown.entries()) {
    for (const [shape, shift] of shapes) addShape(tracks, weights.indexOf(shape) + 1, shift, start, factor);
    start += primitive.positions.length / 3;
    if (!ball) continue;
    const side = Number(ball.centre[0] < middle[0]);
    found.push(eyeHeader(part, ball, side, Math.min(ball.radius, size * IRIS), factor, [-1, -1, -1, -1]));
    const looks = [...shapes].some(([shape, shift]) => shape.startsWith("eyeLook") && shift.some((by) => by !== 0));
    const centre = Array.from(ball.centre, (place) => factor * place);
    if (!looks) transforms.push(...[[0, RADIAN, 0], [RADIAN, 0, 0]].map((amount, which) => ({ part: name, kind: "rotation", fap: EYE_FAPS[side][which], amount, centre })));
  }
  /** @type {Record<string, any>} */
  const content = { ...header, centre: neck, points: {}, eyes: found, definitions: DEFINITIONS, fit: [], weights, transforms, ...tracks.header() };
  addSeams(content, shown.map(({ primitive }) => primitive.normals));
  content.light = bakeLight(content, [], factor * size * NOSE);
  return content;
}

/** Return the material of a part, that of its kind where it has only the light grey of programs. @param {{kind: string, primitive: Primitive, material: Material}} piece */
function looks({ kind, primitive, material }) {
  const [red, green, blue] = material.colour;
  const plain = !material.texture && !primitive.colours && Math.min(red, green, blue) > 0.5 && Math.max(red, green, blue) - Math.min(red, green, blue) < 0.03;
  if (!plain || !LOOKS[kind]) return material;
  return { ...material, colour: LOOKS[kind].slice(0, 3), roughness: LOOKS[kind][3] };
}

/** Put a mesh where its node, or the joints of its skin, have it. @param {Glb} glb @param {Record<string, any>} node @param {number} number @param {Primitive} primitive @param {number} facing 1, or -1 for what looks backwards */
function place(glb, node, number, primitive, facing) {
  const matrices = node.skin === undefined || !primitive.joints || !primitive.weights ? null : glb.skinMatrices(node.skin);
  const { positions, normals, targets, triangles, joints, weights } = primitive;
  const matrix = new Float64Array(16);
  let mirrored = false;
  for (let vertex = 0; vertex < positions.length / 3; vertex += 1) {
    matrix.set(glb.worlds[number]);
    if (matrices && joints && weights) blend(matrices, joints.subarray(4 * vertex, 4 * vertex + 4), weights.subarray(4 * vertex, 4 * vertex + 4), matrix);
    for (const at of [0, 2, 4, 6, 8, 10, 12, 14]) matrix[at] *= facing;
    if (!vertex) mirrored = mirrors(matrix);
    move(matrix, positions, 3 * vertex, 1);
    if (normals) move(matrix, normals, 3 * vertex, 0);
    for (const target of targets) if (target) move(matrix, target, 3 * vertex, 0);
  }
  if (normals) normalise(normals, normals);
  if (mirrored) for (let at = 0; at < triangles.length; at += 3) [triangles[at], triangles[at + 2]] = [triangles[at + 2], triangles[at]];
}

/** Write the mean of the matrices of joints, if they carry a vertex at all. @param {Float64Array[]} matrices @param {Float32Array} joints @param {Float32Array} weights @param {Float64Array} result */
function blend(matrices, joints, weights, result) {
  const total = weights.reduce((sum, weight) => sum + weight, 0);
  if (!(total > 0)) return;
  result.fill(0);
  joints.forEach((joint, slot) => {
    const matrix = matrices[checkedNumber(joint, "a joint", matrices.length)];
    for (let at = 0; at < 16; at += 1) result[at] += (matrix[at] * weights[slot]) / total;
  });
}

/** Move a point (shift 1) or a direction (0). @param {Float64Array} matrix @param {Float32Array} vectors @param {number} at @param {number} shift */
function move(matrix, vectors, at, shift) {
  const [x, y, z] = vectors.subarray(at, at + 3);
  for (let row = 0; row < 3; row += 1) vectors[at + row] = matrix[row] * x + matrix[4 + row] * y + matrix[8 + row] * z + shift * matrix[12 + row];
}

/** Whether a matrix mirrors. @param {Float64Array} m */
function mirrors(m) {
  return m[0] * (m[5] * m[10] - m[9] * m[6]) + m[4] * (m[9] * m[2] - m[1] * m[10]) + m[8] * (m[1] * m[6] - m[5] * m[2]) < 0;
}

/** Add what a shape does to a part. @param {Tracks} tracks @param {number} number from 1 @param {Float32Array} shift @param {number} start the part's first vertex @param {number} factor */
function addShape(tracks, number, shift, start, factor) {
  /** @type {number[]} */
  const rows = [];
  for (let row = 0; row < shift.length / 3; row += 1) if (shift[3 * row] || shift[3 * row + 1] || shift[3 * row + 2]) rows.push(row);
  if (!rows.length) return;
  const moved = new Float32Array(3 * rows.length).map((_, at) => factor * shift[3 * rows[Math.floor(at / 3)] + (at % 3)]);
  tracks.add(number, [0, 1], [[0, 1]], rows.map((row) => row + start), [moved]);
}

/** Return the middle of what a shape moves. @param {{primitive: Primitive, shapes: Map<string, Float32Array>}[]} pieces @param {string} shape */
function middleOfMotion(pieces, shape) {
  const [sum, moving] = [[0, 0, 0], pieces.filter(({ shapes }) => shapes.has(shape))];
  const far = moving.map(({ shapes }) => Float32Array.from({ length: /** @type {Float32Array} */ (shapes.get(shape)).length / 3 }, (_, row) => Math.hypot(.../** @type {Float32Array} */ (shapes.get(shape)).subarray(3 * row, 3 * row + 3))));
  const most = Math.max(...far.map((lengths) => lengths.reduce((one, other) => Math.max(one, other), 0)));
  let count = 0;
  moving.forEach(({ primitive: { positions } }, k) => {
    far[k].forEach((length, row) => {
      if (!(length >= MOVED * most)) return;
      count += 1;
      for (let axis = 0; axis < 3; axis += 1) sum[axis] += positions[3 * row + axis];
    });
  });
  return sum.map((total) => total / count);
}
