/** The figures of a page: what a packed model is drawn as. */
import { Figure } from "../figure/figure.js";
import { isGlb } from "../figure/glb.js";
import { readHead } from "../figure/glb_face.js";
import { Resolver } from "../figure/resolve.js";
import { IDENTITY, multiply } from "../figure/matrices.js";

/**
 * Figures to choose from: a head, a person or both. Of each its file, whether it has a body, the pictures of its parts by
 * their place, that of the skin's relief, and the figure for the first performance.
 * @typedef {{pictures: Map<number, ImageBitmap>, relief: ImageBitmap | null}} Pictures
 * @typedef {{source: Uint8Array | import("../figure/glb_face.js").Content, hasBody: boolean, pictures: Pictures, spare: Figure | null}[]} Model
 * @typedef {import("./renderer.js").Shape} Shape
 * @typedef {import("./camera.js").Subject} Subject
 * @typedef {import("./timeline.js").Timeline} Timeline
 */

const SMALLEST_PUPIL = 0.03;
const LARGEST_PUPIL = 0.92; // of the iris
const OPEN_LIDS = [0, 0.5, 0.86, 0, -0.5, 0.86, 1, 0, 0.3, -1, 0, 0.3];
const MOST_LIMBS = 12; // as in face.vert
const FAR = -1e4; // metres: the place of limbs that a body lacks, away from the light
const SAMPLES = 48; // moments at which the reach of a body is measured
const FARTHEST = 4; // metres that a person moves before the camera follows
/** Joints with a shadow: radius (m), darkness, and height at rest (m). @type {Record<string, [number, number, number]>} */
const SHADOWS = {
  HumanoidRoot: [0.55, 0.42, 0.97],
  l_midtarsal: [0.2, 0.55, 0.03],
  r_midtarsal: [0.2, 0.55, 0.03],
  l_subtalar: [0.16, 0.4, 0.04],
  r_subtalar: [0.16, 0.4, 0.04],
};

/** Return what gzip packed. @param {Uint8Array} bytes */
async function unzipped(bytes) {
  const stream = new Blob([/** @type {BlobPart} */ (bytes)]).stream().pipeThrough(new DecompressionStream("gzip"));
  return new Uint8Array(await new Response(stream).arrayBuffer());
}

/** Return the model in files, packed by gzip or not; pictures are decoded. @param {Uint8Array[]} files @returns {Promise<Model>} */
export function readModel(...files) {
  return Promise.all(files.map(readFigure));
}

/** @param {Uint8Array} file */
async function readFigure(file) {
  const bytes = file[0] === 0x1f && file[1] === 0x8b ? await unzipped(file) : file;
  const source = isGlb(bytes) ? await readHead(bytes) : bytes;
  const figure = new Figure(source);
  const pictures = new Map();
  const decoded = figure.parts.map(async ({ texture, name }, place) => texture && pictures.set(place, await pictureOf(texture, `of part "${name}"`)));
  const [relief] = await Promise.all([figure.relief && pictureOf(figure.relief, "of the skin"), ...decoded]);
  return { source, hasBody: figure.body !== null, pictures: { pictures, relief }, spare: /** @type {Figure | null} */ (figure) };
}

/** @param {Uint8Array} bytes @param {string} what */
async function pictureOf(bytes, what) {
  try {
    return await createImageBitmap(new Blob([/** @type {BlobPart} */ (bytes)]), { premultiplyAlpha: "none", colorSpaceConversion: "none" });
  } catch {
    throw new Error(`the model's picture ${what} cannot be decoded`);
  }
}

/**
 * Return the figure for a performance, and what resolves its FAPs.
 * @param {Model} model @param {boolean} hasBody whether a body moves @param {boolean} hasFace whether a face does
 */
export function makeFigure(model, hasBody, hasFace) {
  const chosen = model.find((packed) => packed.hasBody === hasBody) ?? model[0];
  if (!chosen) throw new Error("the page has no figure");
  if (hasBody && !hasFace && !chosen.hasBody) {
    throw new Error("the stream moves a body, and this page has a head alone; make the page again with fba export");
  }
  const figure = chosen.spare ?? new Figure(chosen.source);
  chosen.spare = null;
  return { figure: new Drawn(figure, chosen.pictures), resolver: new Resolver(figure.rules) };
}

/** A figure as it is drawn: a `Figure` of the stage. */
class Drawn {
  /** @param {Figure} figure @param {Pictures} pictures */
  constructor(figure, { pictures, relief }) {
    this._figure = figure;
    this.hasBody = figure.body !== null;
    this._limbs = figure.limbs.length ? Float32Array.from({ length: 8 * MOST_LIMBS }, (_, k) => (k % 4 < 3 ? FAR : 1e-3)) : null;
    this._meshes = figure.meshes.map(({ parts, positions, normals, light, wrinkles }, mesh) => {
      const before = mesh ? figure.meshes[0].parts.length : 0;
      const shape = {
        ...shapeOf(parts, positions.length / 3, (part) => pictures.get(before + part) ?? null),
        wrinkles,
        relief: relief && { picture: relief, metres: figure.reliefSize },
      };
      const strengths = wrinkles?.strengths ?? null;
      return { shape, positions, normals, light, world: IDENTITY, wrinkles: strengths, limbs: wrinkles || mesh ? null : this._limbs };
    });
    this._feet = Object.entries(SHADOWS).flatMap(([name, shadow]) => {
      const joint = figure.body?.names.indexOf(name) ?? -1;
      return joint < 0 ? [] : [{ joint, shadow }];
    });
    this._subject = this._headSubject();
    /** The space of the performance, before it is measured that of somebody who stands. @type {Subject | null} */
    this.bodySubject = this.hasBody ? { centre: [0, 0.88, 0], halfHeight: 0.98, halfWidth: 0.62 } : null;
    this.follows = this.hasBody;
  }

  /** The head at the start. */
  get subject() {
    return this._subject;
  }

  /** Measure the space that a performance takes. @param {Timeline} timeline */
  measure(timeline) {
    const [faps, baps] = [new Float32Array(68), new Float64Array(296)];
    const [low, high] = [[Infinity, Infinity, Infinity], [-Infinity, -Infinity, -Infinity]];
    const path = [];
    const count = this.hasBody ? Math.min(timeline.frames.length, SAMPLES) : 0;
    for (let k = 0; k < count; k += 1) {
      timeline.at(timeline.timeOf(Math.floor((k * (timeline.frames.length - 1)) / Math.max(count - 1, 1))), faps, baps);
      const joints = this._figure.turnJoints(baps);
      path.push(this.root);
      for (let at = 12; at < joints.length; at += 16) {
        for (let axis = 0; axis < 3; axis += 1) {
          low[axis] = Math.min(low[axis], joints[at + axis]);
          high[axis] = Math.max(high[axis], joints[at + axis]);
        }
      }
    }
    timeline.at(timeline.start, faps, baps);
    this._figure.show(faps, baps);
    this._subject = this._headSubject();
    if (!count) {
      this.follows = false;
      return;
    }
    this.follows = Math.max(...high.map((value, axis) => value - low[axis])) > FARTHEST;
    if (this.follows) {
      const [x, y, z] = this.root;
      this.bodySubject = { centre: [x, y - 0.09, z], halfHeight: 0.98, halfWidth: 0.62 };
      return;
    }
    const standing = [(low[0] + high[0]) / 2 - 0.35, -0.07, (low[2] + high[2]) / 2 - 0.3];
    [0.1, 0.06, 0.1].forEach((room, axis) => (low[axis] = Math.min(low[axis] - room, standing[axis])));
    [0.1, 0.14, 0.1].forEach((room, axis) => (high[axis] += room)); // the head is above its joint
    const centre = low.map((value, axis) => (value + high[axis]) / 2);
    const towards = Math.max(...path.map(([x, , z]) => Math.hypot(x - centre[0], z - centre[2])));
    this.bodySubject = {
      centre,
      halfHeight: Math.max(((high[1] - low[1]) / 2) * 1.06, 0.9),
      halfWidth: Math.max(Math.hypot(high[0] - low[0], high[2] - low[2]) / 2, 0.62),
      halfDepth: Math.max(towards - 0.12, 0),
    };
  }

  /** Where the root of the body is in the last pose. */
  get root() {
    const joints = this._figure.body?.joints;
    return joints ? [joints[12], joints[13], joints[14]] : [0, 0, 0];
  }

  /** @param {Float32Array} faps @param {Float64Array} baps @returns {import("./renderer.js").View} */
  pose(faps, baps) {
    const figure = this._figure;
    figure.show(faps, baps);
    const joints = figure.body?.joints;
    figure.limbs.slice(0, MOST_LIMBS).forEach(([from, to, radius], limb) => {
      [from, to].forEach((joint, end) => this._limbs?.set([...(joints?.subarray(16 * joint + 12, 16 * joint + 15) ?? []), radius], 8 * limb + 4 * end));
    });
    return {
      figures: this._meshes,
      eyes: figure.eyes.map((eye) => this._eye(eye)),
      shadows: joints ? this._feet.map(({ joint, shadow }) => shadowOf(joints.subarray(16 * joint + 12, 16 * joint + 15), shadow)) : [],
      ground: this.hasBody,
      background: null,
    };
  }

  /** @param {import("../figure/figure.js").Eye} eye @returns {import("./renderer.js").Eye} */
  _eye(eye) {
    const { centre, radius } = eye;
    const ball = multiply(eye.matrix, [radius, 0, 0, 0, 0, radius, 0, 0, 0, 0, radius, 0, centre[0], centre[1], centre[2], 1]);
    const iris = eye.iris / 2 / radius;
    const head = this._figure.faceMatrix;
    const size = Math.max(Math.hypot(head[0], head[1], head[2]), 1e-9);
    const faces = this._figure.face.positions;
    const moved = multiply(eye.local, [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, centre[0], centre[1], centre[2], 1]);
    const lids = OPEN_LIDS.map((open, k) => {
      const row = eye.lids[Math.floor(k / 3)];
      return row < 0 ? open : (faces[3 * row + (k % 3)] - moved[12 + (k % 3)]) / radius;
    });
    return {
      matrix: ball,
      iris,
      pupil: Math.min(Math.max(eye.pupil / 2 / radius, SMALLEST_PUPIL), iris * LARGEST_PUPIL),
      lids,
      axes: [0, 1, 2, 4, 5, 6, 8, 9, 10].map((k) => head[k] / size),
    };
  }

  /** @returns {Subject} */
  _headSubject() {
    const { centre, halfHeight, halfWidth } = this._figure.subject;
    if (!this.hasBody) return { centre: [...centre], halfHeight, halfWidth };
    const head = this._figure.faceMatrix;
    const size = Math.hypot(head[0], head[1], head[2]);
    const [x, y, z] = centre;
    const placed = [0, 1, 2].map((row) => head[row] * x + head[4 + row] * y + head[8 + row] * z + head[12 + row]);
    return { centre: placed, halfHeight: halfHeight * size, halfWidth: halfWidth * size };
  }
}

/** @param {Float64Array} place @param {[number, number, number]} shadow */
function shadowOf([x, y, z], [radius, darkness, rest]) {
  const height = Math.max(y - rest, 0);
  return [x, z, radius * (1 + height), darkness / (1 + 4 * height)];
}

/**
 * Return the shape of parts whose vertices follow each other.
 * @param {import("../figure/parts.js").Part[]} parts @param {number} count of vertices @param {(part: number) => ImageBitmap | null} pictureOf
 */
function shapeOf(parts, count, pictureOf) {
  const colours = new Float32Array(4 * count);
  const texcoords = parts.some((part) => part.texcoords) ? new Float32Array(2 * count) : null;
  const across = parts.some((part) => part.across) ? new Float32Array(8 * count) : null;
  const triangles = new Uint32Array(parts.reduce((sum, part) => sum + (part.ball ? 0 : part.triangles.length), 0));
  const drawn = [];
  let corners = 0;
  for (const [place, part] of parts.entries()) {
    for (let k = 0, to = 4 * part.first; k < part.count; k += 1, to += 4) {
      for (let channel = 0; channel < 3; channel += 1) colours[to + channel] = part.colours ? part.colours[3 * k + channel] : part.colour[channel];
      colours[to + 3] = part.glosses ? part.glosses[k] : part.gloss;
    }
    if (part.texcoords) texcoords?.set(part.texcoords, 2 * part.first);
    if (part.across) across?.set(part.across, 8 * part.first);
    const { kind, scatter, folds, closed, smooth, twoSided, opaque, alpha, opacity, cutoff, fine, ball } = part;
    if (!ball) {
      const picture = part.texcoords ? pictureOf(place) : null;
      drawn.push({ first: corners, count: part.triangles.length, picture, opaque, scatter, folds, twoSided, closed, hairs: part.across !== null, smooth, alpha, opacity, cutoff, fine, wrinkled: kind === "skin" });
      for (let at = 0; at < part.triangles.length; at += 1, corners += 1) triangles[corners] = part.triangles[at] + part.first;
    }
  }
  return { count, triangles, parts: drawn, colours, texcoords, across };
}
