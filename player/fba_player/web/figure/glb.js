/** Reads .glb files (glTF 2.0): meshes, morph targets, materials and the places of nodes. */
import { FbaError } from "../decoder/errors.js";
import { MOST_NUMBERS, checkedList, checkedNumber, checkedNumbers } from "./container.js";
import { IDENTITY, multiply } from "./matrices.js";

/**
 * A mesh in its own frame: three numbers a vertex (texcoords: two, colours: four), three vertices a triangle. joints, weights: four a
 * vertex, or null. targets: shifts by morph target, null for those that move nothing.
 * @typedef {{
 *   positions: Float32Array, normals: Float32Array | null, texcoords: Float32Array | null, colours: Float32Array | null,
 *   triangles: Uint32Array, joints: Float32Array | null, weights: Float32Array | null, targets: (Float32Array | null)[],
 * }} Primitive
 * @typedef {{
 *   name: string, colour: number[], opacity: number, roughness: number, alpha: string | null, cutoff: number, twoSided: boolean,
 *   texture: Uint8Array | null, texcoord: number,
 * }} Material
 */

const [MAGIC, JSON_CHUNK, BINARY_CHUNK] = [0x46546c67, 0x4e4f534a, 0x004e4942];
const MOST_JSON = 1 << 24;
export const MOST_VERTICES = 500_000;
const MOST_SETS = 4;
const MOST_ABOVE = 4;
/** @type {Record<number, {type: any, top: number}>} */
const COMPONENTS = {
  5120: { type: Int8Array, top: 127 },
  5121: { type: Uint8Array, top: 255 },
  5122: { type: Int16Array, top: 32767 },
  5123: { type: Uint16Array, top: 65535 },
  5125: { type: Uint32Array, top: 1 },
  5126: { type: Float32Array, top: 1 },
};
/** @type {Record<string, number>} */
const WIDTHS = { SCALAR: 1, VEC2: 2, VEC3: 3, VEC4: 4, MAT4: 16 };
/** Extensions that do not change what is read here, or that are read. */
const UNDERSTOOD = ["KHR_mesh_quantization", "KHR_texture_transform", "KHR_materials_unlit", "KHR_lights_punctual", "EXT_texture_webp", "FBA_face"];
const CONVERT = "this file can be made a figure: fba export --model head.glb -o head.fbam";

/** @param {string} finding @param {"damage" | "unsupported"} [kind] @returns {never} */
export function refuse(finding, kind = "damage") {
  throw new FbaError(kind, `the model ${finding}`, undefined, undefined, CONVERT);
}

/** Whether bytes begin as those of a .glb file. @param {Uint8Array} bytes */
export function isGlb(bytes) {
  return bytes.length > 4 && new DataView(bytes.buffer, bytes.byteOffset).getUint32(0, true) === MAGIC;
}

/** A .glb file. Throws FbaError where it is damaged, too large, or needs what is not read here. */
export class Glb {
  /** @param {Uint8Array} bytes */
  constructor(bytes) {
    const view = new DataView(bytes.buffer, bytes.byteOffset, bytes.byteLength);
    /** @type {Record<number, Uint8Array>} */
    const chunks = {};
    for (let at = 12; at < bytes.length; ) {
      if (at + 8 > bytes.length || at + 8 + view.getUint32(at, true) > bytes.length) refuse(`ends at byte ${bytes.length}, inside its chunks`);
      const start = at + 8;
      at = start + view.getUint32(at, true);
      chunks[view.getUint32(start - 4, true)] ??= bytes.subarray(start, at);
    }
    const text = chunks[JSON_CHUNK] ?? refuse("has no JSON");
    if (text.length > MOST_JSON) refuse(`has ${text.length} bytes of JSON, expected ${MOST_JSON} at most`);
    /** @type {Record<string, any>} */
    this.root = JSON.parse(new TextDecoder().decode(text));
    this._binary = chunks[BINARY_CHUNK] ?? new Uint8Array(0);
    this._numbers = 0;
    for (const name of this.root.extensionsRequired ?? []) if (!UNDERSTOOD.includes(name)) refuse(`needs the extension ${String(name).slice(0, 60)}, which this player does not read`, "unsupported");
    /** @type {number[]} */
    this._parents = [];
    /** From the frame of each node into the scene's. */
    this.worlds = this._worlds();
  }

  /** Return an entry of a list of the document. @param {string} list @param {unknown} place @returns {Record<string, any>} */
  entry(list, place) {
    const entries = checkedList(this.root[list], list);
    return entries[checkedNumber(place, `a place in ${list}`, entries.length)];
  }

  /** Count numbers that are going to take memory. @param {number} count */
  charge(count) {
    this._numbers += count;
    if (this._numbers > MOST_NUMBERS) refuse(`has more than ${MOST_NUMBERS} numbers`);
  }

  /** Return the bytes of a buffer view. @param {unknown} place */
  bytes(place) {
    const { buffer, byteOffset = 0, byteLength } = this.entry("bufferViews", place);
    if (buffer !== 0 || this.root.buffers?.[0]?.uri !== undefined) refuse("keeps its data in other files", "unsupported");
    const start = checkedNumber(byteOffset, "the start of a buffer view", this._binary.length + 1);
    const size = checkedNumber(byteLength, "the size of a buffer view", this._binary.length - start + 1);
    return this._binary.subarray(start, start + size);
  }

  /** Return numbers; whole ones scaled to 0 to 1 or -1 to 1 where the file says so. @param {unknown} place @param {string[]} types @param {number} [count] how many elements there must be */
  numbers(place, types, count) {
    const entry = this.entry("accessors", place);
    const width = WIDTHS[entry.type];
    if (!types.includes(entry.type)) refuse(`has ${String(entry.type).slice(0, 20)} where ${types.join(" or ")} is expected`);
    const size = checkedNumber(entry.count, "the count of an accessor", MOST_NUMBERS);
    if ((count ?? size) !== size) refuse(`has ${size} elements in an accessor, expected ${count}`);
    const { type, top } = COMPONENTS[entry.componentType] ?? refuse("has an unknown type of numbers");
    this.charge(2 * size * width);
    const values = entry.bufferView === undefined ? new type(size * width) : this._read(entry, size, width, type);
    if (entry.sparse) {
      const rows = checkedNumber(entry.sparse.count, "the count of a sparse accessor", size + 1);
      this.charge(rows * (1 + width));
      const kind = COMPONENTS[entry.sparse.indices.componentType] ?? refuse("has an unknown type of numbers");
      const places = this._read(entry.sparse.indices, rows, 1, kind.type);
      const replaced = this._read(entry.sparse.values, rows, width, type);
      for (let row = 0; row < rows; row += 1) {
        checkedNumber(places[row], "a place in a sparse accessor", size);
        values.set(replaced.subarray(width * row, width * row + width), width * places[row]);
      }
    }
    const scaled = new Float32Array(values.length);
    for (let at = 0; at < values.length; at += 1) {
      scaled[at] = entry.normalized ? Math.max(values[at] / top, -1) : values[at];
      if (!Number.isFinite(scaled[at])) refuse("has a number that is not finite in an accessor");
    }
    return scaled;
  }

  /** @param {Record<string, any>} where with bufferView and byteOffset @param {number} count @param {number} width @param {any} type */
  _read(where, count, width, type) {
    const bytes = this.bytes(where.bufferView);
    const element = width * type.BYTES_PER_ELEMENT;
    const stride = checkedNumber(this.entry("bufferViews", where.bufferView).byteStride ?? element, "a stride", 1024);
    const start = checkedNumber(where.byteOffset ?? 0, "the start of an accessor", bytes.length + 1);
    if (stride < element || (count && start + stride * (count - 1) + element > bytes.length)) refuse(`ends inside an accessor of ${count} elements`);
    const packed = new Uint8Array(count * element);
    for (let row = 0; row < count; row += 1) packed.set(bytes.subarray(start + row * stride, start + row * stride + element), row * element);
    return new type(packed.buffer);
  }

  /** Return a primitive of a mesh. @param {Record<string, any>} entry @param {number} [texcoord] which set of texture coordinates @returns {Primitive} */
  primitive({ attributes, indices, targets = [], mode = 4 }, texcoord = 0) {
    if (mode !== 4) refuse("has other surfaces than lists of triangles", "unsupported");
    const positions = this.numbers(attributes.POSITION, ["VEC3"]);
    const count = positions.length / 3;
    if (count > MOST_VERTICES) refuse(`has ${count} vertices, expected ${MOST_VERTICES} at most`);
    const optional = (/** @type {string} */ name, /** @type {string[]} */ ...types) => (attributes[name] === undefined ? null : this.numbers(attributes[name], types, count));
    const corners = indices === undefined ? Float32Array.from({ length: count }, (_, at) => at) : this.numbers(indices, ["SCALAR"]);
    if (corners.length % 3) refuse(`has ${corners.length} corners of triangles, not three each`);
    for (const corner of corners) if (!(corner < count)) refuse(`has a triangle at vertex ${corner}, expected 0 to ${count - 1}`);
    const three = attributes.COLOR_0 !== undefined && this.entry("accessors", attributes.COLOR_0).type === "VEC3";
    const colours = optional("COLOR_0", "VEC3", "VEC4");
    return {
      positions,
      normals: optional("NORMAL", "VEC3"),
      texcoords: optional(`TEXCOORD_${checkedNumber(texcoord, "a set of texture coordinates", MOST_SETS)}`, "VEC2"),
      colours: colours && three ? new Float32Array(4 * count).map((_, at) => (at % 4 < 3 ? colours[3 * (at >> 2) + (at % 4)] : 1)) : colours,
      triangles: Uint32Array.from(corners),
      joints: optional("JOINTS_0", "VEC4"),
      weights: optional("WEIGHTS_0", "VEC4"),
      targets: checkedList(targets, "morph targets").map(({ POSITION }) => (POSITION === undefined ? null : this.numbers(POSITION, ["VEC3"], count))),
    };
  }

  /** Return the material of a primitive. @param {Record<string, any>} primitive @returns {Material} */
  material({ material }) {
    if (material === undefined) return { name: "", colour: [0.8, 0.8, 0.8], opacity: 1, roughness: 0.6, alpha: null, cutoff: 0.5, twoSided: false, texture: null, texcoord: 0 };
    const { name, pbrMetallicRoughness: surface = {}, alphaMode = null, alphaCutoff = 0.5, doubleSided } = this.entry("materials", material);
    const [red, green, blue, opacity] = checkedNumbers(surface.baseColorFactor ?? [1, 1, 1, 1], "a colour", 4);
    const { index, texCoord = 0 } = surface.baseColorTexture ?? {};
    return {
      name: String(name),
      colour: [red, green, blue],
      opacity,
      roughness: checkedNumber(surface.roughnessFactor ?? 1, "a roughness"),
      alpha: alphaMode && String(alphaMode).toLowerCase(),
      cutoff: Math.min(checkedNumber(alphaCutoff, "a cutoff"), 1),
      twoSided: doubleSided === true,
      texture: index === undefined ? null : this._picture(this.entry("textures", index)),
      texcoord: texCoord,
    };
  }

  /** Return the matrices by which the joints of a skin carry vertices. @param {unknown} place */
  skinMatrices(place) {
    const { joints, inverseBindMatrices } = this.entry("skins", place);
    const given = inverseBindMatrices === undefined ? null : this.numbers(inverseBindMatrices, ["MAT4"]);
    return checkedList(joints, "joints").map((joint, at) => {
      const matrix = Float64Array.from(this.worlds[checkedNumber(joint, "a joint", this.worlds.length)]);
      if (given && 16 * at + 16 > given.length) refuse("has not all matrices of a skin");
      multiply(matrix, Float64Array.from(given ? given.subarray(16 * at, 16 * at + 16) : IDENTITY), matrix);
      return matrix;
    });
  }

  /** Return the names of the nodes above one, the nearest first. @param {number} number @returns {string[]} */
  namesAbove(number) {
    const names = [];
    for (let above = this._parents[number]; above >= 0 && names.length < MOST_ABOVE; above = this._parents[above]) names.push(String(this.root.nodes[above].name ?? ""));
    return names;
  }

  /** @param {Record<string, any>} texture */
  _picture({ source, extensions }) {
    const { bufferView } = this.entry("images", extensions?.EXT_texture_webp?.source ?? source);
    return this.bytes(bufferView);
  }

  /** Return the matrix of each node. */
  _worlds() {
    const nodes = checkedList(this.root.nodes ?? [], "nodes");
    /** @type {number[]} */
    const parents = nodes.map(() => -1);
    nodes.forEach(({ children = [] }, number) => {
      for (const child of checkedList(children, "children")) parents[checkedNumber(child, "a node", nodes.length)] = number;
    });
    this._parents = parents;
    const worlds = nodes.map(localMatrix);
    const order = [...parents.keys()].filter((number) => parents[number] < 0);
    for (const number of order) { // grows during the loop
      for (const child of new Set(nodes[number].children)) {
        if (parents[child] !== number) continue; // a child of another, too
        multiply(worlds[number], worlds[child], worlds[child]);
        order.push(child);
      }
    }
    if (order.length < nodes.length) refuse("has a node that is its own ancestor");
    return worlds;
  }
}

/** @param {Record<string, any>} node */
function localMatrix({ matrix, translation = [0, 0, 0], rotation = [0, 0, 0, 1], scale = [1, 1, 1] }) {
  if (matrix !== undefined) return checkedNumbers(matrix, "the matrix of a node", 16);
  const quaternion = checkedNumbers(rotation, "the turn of a node", 4);
  const [x, y, z, w] = quaternion.map((part) => part / Math.hypot(...quaternion));
  const local = Float64Array.from(IDENTITY);
  local.set([1 - 2 * (y * y + z * z), 2 * (x * y + z * w), 2 * (x * z - y * w)]);
  local.set([2 * (x * y - z * w), 1 - 2 * (x * x + z * z), 2 * (y * z + x * w)], 4);
  local.set([2 * (x * z + y * w), 2 * (y * z - x * w), 1 - 2 * (x * x + y * y)], 8);
  checkedNumbers(scale, "the scale of a node", 3).forEach((by, axis) => {
    for (let at = 4 * axis; at < 4 * axis + 3; at += 1) local[at] *= by;
  });
  local.set(checkedNumbers(translation, "the place of a node", 3), 12);
  return local;
}

/** Return numbers of 32 bits that this project packed: the lowest bytes of all, then the others, by zlib. @param {Uint8Array} bytes @param {number} count @returns {Promise<ArrayBuffer>} */
export async function inflated(bytes, count) {
  const reader = new Blob([/** @type {BlobPart} */ (bytes)]).stream().pipeThrough(new DecompressionStream("deflate")).getReader();
  const planes = new Uint8Array(4 * count);
  let at = 0;
  for (let { value } = await reader.read(); value; { value } = await reader.read()) {
    if (at + value.length > planes.length) refuse(`unpacks to more than ${count} numbers`);
    planes.set(value, at);
    at += value.length;
  }
  if (at < planes.length) refuse(`unpacks to fewer than ${count} numbers`);
  const numbers = new Uint8Array(4 * count);
  for (let plane = 0; plane < 4; plane += 1) for (let k = 0; k < count; k += 1) numbers[4 * k + plane] = planes[plane * count + k];
  return numbers.buffer;
}
