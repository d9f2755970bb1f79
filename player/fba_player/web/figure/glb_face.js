/** Heads of .glb files as figures: those with this project's extension FBA_face, else by their shapes. */
import { FbaError } from "../decoder/errors.js";
import { FAP_NAMES, FAP_UNITS } from "../page/names.js";
import { MEMORY, checkedList, checkedNumber, checkedNumbers } from "./container.js";
import { PER_DISTANCE, fapNumber, listOf, measure, pointsOf, turnsOf } from "./fba_face.js";
import { Glb, inflated, refuse } from "./glb.js";
import { ADULT_EYES, Tracks, addSeams, commonHeader, eyeHeader, findBall, partHeader } from "./glb_parts.js";
import { bakeLight } from "./glb_light.js";
import { shapedFace } from "./glb_shapes.js";
import { IDENTITY } from "./matrices.js";
import { findTongues } from "./tongue.js";

/** What a `Figure` is made of. @typedef {{container: typeof MEMORY, header: Record<string, any>}} Content */
/** @typedef {import("./fba_face.js").Point} Point */

const SIZES = [0.01, 1]; // metres between the eyes, from dolls to giants
const [MOST_PARTS, MOST_BORDERS] = [1000, 4096];
const LIDS = [["3.1", "3.3", "3.7", "3.11"], ["3.2", "3.4", "3.12", "3.8"]];
/** Numbers of links of an interpolation table besides the FAPs. */
const FIELDS = ["viseme_select1", "viseme_select2", "viseme_blend", "expression_select1", "expression_intensity1", "expression_select2", "expression_intensity2"];

/** Return the head in a .glb file. Throws FbaError. @param {Uint8Array} bytes @returns {Promise<Content>} */
export async function readHead(bytes) {
  try {
    const glb = new Glb(bytes);
    const face = glb.root.extensions?.FBA_face ? await describedFace(glb, glb.root.extensions.FBA_face) : shapedFace(glb);
    return { container: MEMORY, header: { version: 2, face } };
  } catch (error) {
    if (error instanceof FbaError) throw error;
    return refuse(`is damaged: ${error instanceof Error ? error.message : error}`);
  }
}

/** Return a face with the extension FBA_face, as `fba.face.FaceModel` reads it. @param {Glb} glb @param {Record<string, any>} content */
async function describedFace(glb, content) {
  if (content.version !== 1) refuse(`has FBA_face of version ${content.version}, expected 1`);
  const pieces = listOf(content.parts, "parts", MOST_PARTS).map(({ node, kind, colour }) => {
    const { mesh, skin, name } = glb.entry("nodes", node);
    if (skin !== undefined || glb.worlds[node].some((entry, at) => entry !== IDENTITY[at])) refuse("has a part with a transform or a skin");
    const [entry] = glb.entry("meshes", mesh).primitives;
    const primitive = glb.primitive({ ...entry, targets: [] }); // the tables count
    const material = glb.material(entry);
    const ball = kind === "eye" ? findBall(primitive.positions) : null;
    const header = partHeader(String(name), String(kind), primitive, { ...material, colour: colour ?? material.colour, alpha: material.alpha ?? "auto" }, ball !== null);
    return { name: String(name), kind: String(kind), primitive, header, ball };
  });
  const starts = pieces.map(((sum) => ({ header }) => (sum += header.count) - header.count)(0));
  const points = pointsOf(content);
  const bound = (/** @type {string} */ name) => {
    const { part, vertex } = content.featurePoints[name] ?? {};
    return vertex === undefined ? -1 : starts[checkedNumber(part, "the part of a feature point", pieces.length)] + checkedNumber(vertex, "the vertex of a feature point", pieces[part].header.count);
  };
  const units = measure(points);
  const apart = units.ES * PER_DISTANCE;
  const eyes = [points.get("3.5"), points.get("3.6")].map((point) => point ?? refuse("lacks feature points of the eyes"));
  const factor = apart >= SIZES[0] && apart <= SIZES[1] ? 1 : ADULT_EYES / apart;
  const common = commonHeader(pieces, eyes, apart, factor, middleOf(points, ["2.1", "2.10"]), middleOf(points, ["10.7", "10.8", "10.5", "10.6", "7.1"]), units.ENS * PER_DISTANCE);
  const tracks = new Tracks();
  for (const { fap, meshes = [] } of listOf(content.tables ?? [], "tables", 66)) {
    const number = fapNumber(fap);
    const unit = units[FAP_UNITS[number - 1]];
    for (const mesh of listOf(meshes, "meshes", pieces.length)) {
      const part = checkedNumber(mesh.part, "a part of a table", pieces.length);
      await addMesh(glb, mesh, number, pieces[part].header.count, starts[part], unit * factor, tracks);
    }
  }
  const transforms = turnsOf(content, units, factor).map(({ part, ...turn }) => ({ part: part === null ? null : pieces[part].name, ...turn }));
  const iris = units.IRISD * PER_DISTANCE;
  /** @type {Record<string, any>} */
  const header = {
    ...common,
    centre: transforms.find(({ part, kind }) => part === null && kind === "rotation")?.centre ?? [0, 0, 0],
    points: Object.fromEntries([...points].map(([name, point]) => [name, Array.from(point, (place) => factor * place)])),
    eyes: pieces.flatMap(({ ball }, part) => (ball ? [eyeHeader(part, ball, Number(ball.centre[0] <= 0), iris, factor, LIDS[Number(ball.centre[0] <= 0)].map(bound))] : [])),
    definitions: [content.visemes, content.expressions].map((poses) => checkedList(poses, "definitions").map(({ faps }) => Object.fromEntries(Object.entries(faps).map(([name, value]) => [fapNumber(name), value])))),
    fit: content.fit ? readInterpolation(content.fit) : [],
    transforms,
    ...tracks.header(),
  };
  addSeams(header, pieces.map(({ primitive }) => primitive.normals));
  const lips = ["2.2", "2.3"].map(bound);
  header.tongues = findTongues(header, bound, factor * apart, factor * units.MNS * PER_DISTANCE);
  header.light = bakeLight(header, Math.min(...lips) < 0 ? [] : lips, factor * units.ENS * PER_DISTANCE);
  return header;
}

/**
 * Add what a FAP does to a part: of each border but 0 a shape, shown in full at that border and not at others.
 * @param {Glb} glb @param {Record<string, any>} mesh @param {number} fap @param {number} size vertices of the part @param {number} start @param {number} unit @param {Tracks} tracks
 */
async function addMesh(glb, mesh, fap, size, start, unit, tracks) {
  const borders = [...checkedNumbers(mesh.borders, "borders")];
  const zero = borders.indexOf(0);
  const count = checkedNumber(mesh.count, "the vertices that a FAP moves", size + 1);
  if (borders.length < 2 || borders.length > MOST_BORDERS || zero < 0) refuse(`has ${borders.length} borders of a FAP, expected 2 to ${MOST_BORDERS}, and 0 among them`);
  if (!count) return;
  const intervals = borders.length - 1;
  glb.charge(3 * count * (3 * intervals + 1));
  const rows = new Uint32Array(await inflated(glb.bytes(mesh.vertices), count));
  for (let at = 0; at < count; at += 1) rows[at] = start + checkedNumber(rows[at], "a vertex that a FAP moves", size);
  const steps = new Float32Array(await inflated(glb.bytes(mesh.displacements), 3 * count * intervals));
  /** @type {Float32Array[]} */
  const shapes = Array.from({ length: borders.length });
  for (const [from, to, way] of [[zero, borders.length - 1, 1], [zero, 0, -1]]) {
    const shift = new Float64Array(3 * count);
    for (let border = from; border !== to; border += way) {
      const interval = Math.min(border, border + way);
      const step = unit * (borders[border + way] - borders[border]);
      for (let axis = 0; axis < 3; axis += 1) {
        for (let k = 0; k < count; k += 1) shift[3 * k + axis] += step * steps[count * (3 * interval + axis) + k];
      }
      if (!shift.every((number) => Math.abs(number) < 1e30)) refuse(`has displacements of FAP ${fap} that are too large`);
      shapes[border + way] = Float32Array.from(shift);
    }
  }
  const places = [...borders.keys()].filter((border) => border !== zero);
  tracks.add(fap, borders, places.map((place) => borders.map((_, border) => Number(border === place))), rows, places.map((place) => shapes[place]));
}

/** Return the middle of the first two of points that there are, or null. @param {Map<string, Point>} points @param {string[]} names */
function middleOf(points, names) {
  const [one, other = one] = names.flatMap((name) => (points.has(name) ? [/** @type {Point} */ (points.get(name))] : []));
  return one ? [0, 1, 2].map((axis) => (one[axis] + other[axis]) / 2) : null;
}

/** Return the links of an interpolation table as `Rules` take them: to each FAP after those that it is computed from. @param {Record<string, any>} fit */
function readInterpolation(fit) {
  const place = (/** @type {string} */ name) => {
    const found = [...FAP_NAMES, ...FIELDS].indexOf(name);
    return found >= 0 ? found : refuse(`has an interpolation table with ${String(name).slice(0, 60)}, which does not exist`);
  };
  const terms = (/** @type {any[]} */ listed = []) =>
    listed.map(({ coefficient, powers = {}, when = {} }) => {
      const [condition] = Object.entries(when);
      return [coefficient, Object.entries(powers).map(([name, exponent]) => [place(name), exponent]), condition ? [place(condition[0]), condition[1]] : null];
    });
  /** @type {Map<number, {fap: number, source: number[], numerator: any[], denominator: any[]}[]>} */
  const waiting = new Map();
  for (const { source, destination } of checkedList(fit.links, "links")) {
    for (const [name, { numerator, denominator }] of Object.entries(destination)) {
      const fap = fapNumber(name);
      waiting.set(fap, [...(waiting.get(fap) ?? []), { fap, source: source.map(place), numerator: terms(numerator), denominator: terms(denominator) }]);
    }
  }
  const links = [];
  while (waiting.size) {
    const [next] = [...waiting].filter(([, links]) => !links.some(({ source }) => source.some((column) => waiting.has(column + 1))));
    if (!next) refuse("has an interpolation table with links in a circle");
    waiting.delete(next[0]);
    links.push(...next[1]);
  }
  return links;
}
