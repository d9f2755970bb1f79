/** What is shown: a head, or a person whose head it is; moved by FAPs and BAPs. */
import { Body } from "./body.js";
import { Container, checkedList, checkedNumber, checkedNumbers, refuse } from "./container.js";
import { Face } from "./face.js";
import { IDENTITY, multiply } from "./matrices.js";
import { FaceLight, bodyLight } from "./light.js";
import { Skin } from "./skin.js";
import { Wrinkles } from "./wrinkles.js";

/** @typedef {import("./parts.js").Part} Part */
/**
 * The parts of a body or a face, and the arrays of all their vertices. light: four shares each, as shaders take them.
 * wrinkles: of a face. sway: how far a vertex of it turns with the head.
 * @typedef {{parts: Part[], positions: Float32Array, normals: Float32Array, light: Float32Array, wrinkles: Wrinkles | null}} Mesh
 */

/**
 * An eyeball, which is a part of the face, too. centre, radius: in the frame of matrix, which leads into the world, and of
 * local, which leads into that of the face. iris, pupil: their diameters. All in metres. lids: vertices of the face at the
 * middles of upper and lower lid and at the corners, -1 for those that it lacks.
 * @typedef {{
 *   part: Part, matrix: Float64Array, local: Float64Array, centre: Float64Array, radius: number, iris: number, pupil: number,
 *   lids: number[],
 * }} Eye
 */

const VERSION = 2;
const FAPS = 68;
const BAPS = 296;
const PUPILS = [28, 29]; // columns of FAPs 29 and 30

/**
 * A head or a person made by `fba_player.web.pack_face` or `pack_body`. Positions are in the world: metres, +x the
 * subject's left, +y up, +z forward; a person stands on y = 0, a head is where its model has it.
 */
export class Figure {
  /** @param {Uint8Array | import("./glb_face.js").Content} source a packed figure, or what `readHead` returned */
  constructor(source) {
    const packed = source instanceof Uint8Array ? new Container(source) : null;
    const { container, header } = packed ? { container: packed, header: packed.header } : /** @type {import("./glb_face.js").Content} */ (source);
    if (header.version !== VERSION) refuse(`is of version ${header.version}, expected ${VERSION}`);
    this.face = new Face(container, header.face ?? refuse("has no face"));
    this.body = header.body ? new Body(container, header.body) : null;
    this._positions = this.face.positions.slice();
    this._normals = this.face.normals.slice();
    if (this.body && this.face.positions.length) {
      const { parents, inverse } = this.body;
      this._skin = new Skin(container, header.body.faceSkin, this._positions.length / 3, parents.length, parents, inverse);
      this._placed = this._positions.slice();
      this._local = this._normals.slice();
    }
    /** The face's parts as they are shown: their positions are in the world. */
    const shown = this.face.parts.map((part) => {
      const range = /** @type {[number, number]} */ ([3 * part.first, 3 * (part.first + part.count)]);
      return { ...part, positions: this._positions.subarray(...range), normals: this._normals.subarray(...range) };
    });
    /** All parts, to be drawn. @type {Part[]} */
    this.parts = [...(this.body?.parts ?? []), ...shown];
    /** The same by body and face, for those who draw all at once. @type {Mesh[]} */
    this.meshes = [];
    if (this.body) {
      const { parts, positions, normals } = this.body;
      this.meshes.push({ parts, positions, normals, light: bodyLight(container, header.body.light ?? {}, positions.length / 3), wrinkles: null });
    }
    if (shown.length) {
      this._light = new FaceLight(container, header.face.light ?? {}, this.face.parts, this.face.sway);
      this._wrinkles = header.face.wrinkles ? new Wrinkles(container, header.face.wrinkles, this._positions.length / 3) : null;
      this.meshes.push({ parts: shown, positions: this._positions, normals: this._normals, light: this._light.values, wrinkles: this._wrinkles });
    }
    /** Bytes of the picture of the skin's relief, or null, and the metres after which it repeats. */
    this.relief = header.relief ? container.file(header.relief.picture, "the relief of the skin") : null;
    this.reliefSize = header.relief ? checkedNumber(header.relief.metres, "the size of the relief") : 1;
    /** Limbs of the body that keep light from others: joints at both ends, and radius (m). @type {number[][]} */
    this.limbs = checkedList(header.body?.light?.limbs ?? [], "limbs").map((limb) => {
      const [from, to, radius] = checkedNumbers(limb, "a limb", 3);
      const joints = this.body?.names.length ?? 0;
      return [checkedNumber(from, "a joint", joints), checkedNumber(to, "a joint", joints), radius];
    });
    /** @type {(Eye & {side: number, widest: number, step: number, number: number})[]} */
    this._eyes = (header.face.eyes ?? []).map((/** @type {Record<string, any>} */ eye) => {
      const number = checkedNumber(eye.part, "the part of an eye", shown.length);
      const [side, radius, iris, widest, step] = checkedNumbers(eye.numbers, "an eye", 5);
      const matrix = Float64Array.from(IDENTITY);
      const count = this.face.positions.length / 3;
      const lids = checkedNumbers(eye.lids, "the lids of an eye", 4);
      return {
        part: shown[number],
        number,
        matrix,
        local: this.face.partMatrices[number],
        lids: [...lids].map((row) => (row < 0 ? -1 : checkedNumber(row, "a vertex of a lid", count))),
        centre: checkedNumbers(eye.centre, "the centre of an eye", 3),
        side: checkedNumber(side, "the side of an eye", 2),
        radius,
        iris,
        pupil: widest,
        widest,
        step,
      };
    });
    /** From the frame of the face's model into the world, the head turned. */
    this.faceMatrix = this.body?.faceMatrix ?? this.face.headMatrix;
    const { centre, halfHeight, halfWidth } = header.face.subject;
    /** What a camera should have in view of the head, in the frame of its model: its middle, and half its size. */
    this.subject = { centre: checkedNumbers(centre, "the middle of the head", 3), halfHeight: checkedNumber(halfHeight, "the height"), halfWidth: checkedNumber(halfWidth, "the width") };
    this._faps = new Float64Array(FAPS).fill(NaN);
    this._baps = new Float64Array(this.body ? BAPS : 0).fill(NaN);
    this._nothing = new Float64Array(BAPS);
    this.show(new Float64Array(FAPS));
  }

  /** Eyeballs; their parts are among `parts`. @returns {Eye[]} */
  get eyes() {
    return this._eyes;
  }

  /** How the face fills in what is not sent, for a `Resolver` or a `Timeline`. */
  get rules() {
    return this.face.rules;
  }

  /**
   * Move the figure: positions and normals of `parts`, and the light on them.
   * @param {ArrayLike<number>} faps 68, as a `Resolver` gives them @param {ArrayLike<number>} [baps] 296, for a body
   */
  show(faps, baps = this._nothing) {
    const sameFace = same(this._faps, faps);
    const sameBody = same(this._baps, baps);
    if (sameFace && sameBody) return;
    this._faps.set(faps);
    this._baps.set(this.body ? baps : []);
    if (!sameFace) this.face.pose(faps);
    if (this.body) this._showPerson(this.body, sameFace);
    else this.face.place(this._positions, this._normals);
    for (const eye of this._eyes) {
      multiply(this.faceMatrix, this.face.partMatrices[eye.number], eye.matrix);
      eye.pupil = eye.widest + eye.step * this._faps[PUPILS[eye.side]];
    }
    this._light?.shade(this.face.positions, this.faceMatrix, this.body ? this.faceMatrix : IDENTITY);
    if (!sameFace) this._wrinkles?.show(faps);
  }

  /** Return the joints of the body for BAPs, 16 numbers each, none without a body; nothing else moves. @param {ArrayLike<number>} baps */
  turnJoints(baps) {
    this._baps.fill(NaN); // the next call of `show` moves all
    this.body?.turn(baps, this.face.headMatrix);
    return this.body?.joints ?? [];
  }

  /** @param {Body} body @param {boolean} sameFace */
  _showPerson(body, sameFace) {
    body.pose(this._baps, this.face.headMatrix, this._faps);
    if (!this._skin || !this._placed || !this._local) return;
    if (!sameFace) {
      this.face.place(this._positions, this._local, { withHead: false });
      body.placeFace(this._positions, this._placed);
    }
    this._skin.apply(body.joints, this._placed, this._local, this._positions, this._normals);
  }
}

/** @param {Float64Array} before @param {ArrayLike<number>} now */
function same(before, now) {
  for (let at = 0; at < before.length; at += 1) if (before[at] !== now[at]) return false;
  return true;
}
