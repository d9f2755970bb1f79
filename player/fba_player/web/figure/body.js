/** Poses a body by BAPs: what `fba.body.BapSolver` and `fba.body.footing` do, and its head as FAPs turn it. */
import { checkedList, checkedNumber, checkedNumbers, refuse } from "./container.js";
import { OwnHead } from "./own_head.js";
import { IDENTITY, invertRigid, multiply } from "./matrices.js";
import { Shading, normalise, readParts } from "./parts.js";
import { Skin } from "./skin.js";

/** @typedef {import("./container.js").Arrays} Container */
/** @typedef {{joint: number, place: Float64Array}} SolePoint a point of a sole, relative to the joint that moves it */

const BAPS = 296;
const MOST_JOINTS = 10_000;
const UNIT = 1e-5; // radians in a unit of a BAP

/** The joints of a skeleton, and the angles that BAPs turn them by. */
export class Solver {
  /** @param {Record<string, any>} header */
  constructor(header) {
    /** Names of the joints, as in the standard. @type {string[]} */
    this.names = checkedList(header.names, "joints").map(String);
    const count = this.names.length;
    if (count < 1 || count > MOST_JOINTS) refuse(`has ${count} joints, expected 1 to ${MOST_JOINTS}`);
    /** The joint that each hangs from, -1 for the first. @type {number[]} */
    this.parents = checkedList(header.parents, "parents").map((parent, at) => (at ? checkedNumber(parent, `the parent of joint ${at}`, at) : -1));
    if (this.parents.length !== count) refuse("has not as many parents as joints");
    this._offsets = checkedNumbers(header.offsets, "offsets of joints", 3 * count);
    /** Column, axis and sign of each angle, the outermost first. @type {[number, number, number][][]} */
    this._turns = checkedList(header.turns, "angles of joints").map((turns) =>
      checkedList(turns, "angles").map(([column, axis, sign]) => [checkedNumber(column, "a BAP", BAPS), checkedNumber(axis, "an axis", 3), checkedNumber(sign, "a sign")]),
    );
    if (this._turns.length !== count) refuse("has not angles for all joints");
    /** Column of each BAP that moves the root, and metres of one unit. */
    this._shift = [0, 1, 2].map((axis) => [checkedNumber(header.translation?.[axis], "a BAP", BAPS), checkedNumber(header.metres?.[axis], "metres")]);
  }

  /** Write the matrix of each joint, 16 numbers, column by column. @param {ArrayLike<number>} baps @param {Float64Array} result */
  pose(baps, result) {
    for (let joint = 0, at = 0; joint < this.parents.length; joint += 1, at += 16) {
      const up = 16 * this.parents[joint];
      const x = this._offsets[3 * joint], y = this._offsets[3 * joint + 1], z = this._offsets[3 * joint + 2]; // prettier-ignore
      if (up < 0) {
        result.set(IDENTITY, at);
        [x, y, z].forEach((place, axis) => (result[at + 12 + axis] = place + this._shift[axis][1] * baps[this._shift[axis][0]]));
      } else {
        result.copyWithin(at, up, up + 16);
        for (let row = 0; row < 3; row += 1) result[at + 12 + row] += result[up + row] * x + result[up + 4 + row] * y + result[up + 8 + row] * z;
      }
      for (const [column, axis, sign] of this._turns[joint]) {
        const angle = baps[column] * sign * UNIT;
        if (angle === 0) continue;
        const s = Math.sin(angle);
        const c = Math.cos(angle);
        const first = at + 4 * ((axis + 1) % 3);
        const second = at + 4 * ((axis + 2) % 3);
        for (let row = 0; row < 3; row += 1) {
          const a = result[first + row];
          const b = result[second + row];
          result[first + row] = c * a + s * b;
          result[second + row] = c * b - s * a;
        }
      }
    }
  }
}

/** A body that BAPs move. Axes: +x the subject's left, +y up, +z forward; metres. */
export class Body {
  /** @param {Container} container @param {Record<string, any>} header */
  constructor(container, header) {
    this._solver = new Solver(header.skeleton);
    const { names, parents } = this._solver;
    this.names = names;
    this.parents = parents;
    const count = names.length;
    /** Matrix of each joint in the world, with the head as FAPs turn it: 16 numbers, column by column. */
    this.joints = new Float64Array(16 * count);
    const bind = checkedList(header.bind, "joints as modelled").map((matrix) => checkedNumbers(matrix, "a joint as modelled", 16));
    if (bind.length !== count) refuse("has not all joints as modelled");
    /** Inverses of the joints as modelled. */
    this.inverse = bind.map((matrix) => {
      const inverse = new Float64Array(16);
      invertRigid(matrix, inverse);
      return inverse;
    });
    this._rest = container.fractions(header.positions, "positions of the body", undefined, 3);
    /** Positions in the world, three numbers a vertex. */
    this.positions = this._rest.slice();
    /** Their normals. */
    this.normals = new Float32Array(this._rest.length);
    this.parts = readParts(container, header.parts, this.positions, this.normals);
    const modelled = container.fractions(header.normals, "the normals of the body", this._rest.length / 3, 3);
    normalise(modelled, modelled);
    this._surface = new Float32Array(this._rest.length);
    this._shadings = this.parts.map((part) => {
      const shading = new Shading(part, new Uint8Array(part.count).fill(1));
      const surface = this._surface.subarray(3 * part.first, 3 * (part.first + part.count));
      surface.set(shading.rest);
      return { shading, positions: part.positions, surface };
    });
    /** What the normals as modelled are besides those of the triangles. */
    this._besides = modelled;
    for (let at = 0; at < modelled.length; at += 1) this._besides[at] -= this._surface[at];
    this._skin = new Skin(container, header.skin, this._rest.length / 3, count, parents, this.inverse);
    /** What moves a head of its own. */
    this._ownHead = header.ownHead ? new OwnHead(container, header.ownHead, this._rest.length / 3) : null;
    this._moved = this._ownHead ? this._rest.slice() : this._rest;
    this._ground = header.standard ? readGround(header, this._solver) : null;
    const skull = checkedNumber(header.skull, "the skull", count);
    this._skull = skull;
    const below = bind.map((_, joint) => joint === skull);
    for (let joint = skull + 1; joint < count; joint += 1) below[joint] = below[parents[joint]];
    this._below = below;
    /** How the head turns within the body as modelled: about a centre, shifts as large as the size says. */
    this._turn = { size: checkedNumber(header.turn?.size, "the size of the head"), centre: checkedNumbers(header.turn?.centre, "the centre of the head", 3) };
    /** From the frame of the face's model into the body's, as modelled. */
    this._place = Float64Array.from(IDENTITY);
    const size = checkedNumber(header.place?.size, "the size of the face");
    this._place[0] = this._place[5] = this._place[10] = size;
    this._place.set(checkedNumbers(header.place.shift, "the place of the face", 3), 12);
    this._motion = new Float64Array(16);
    this._within = new Float64Array(16);
    this._inverseMotion = new Float64Array(16);
    /** From the frame of the face's model into the world, the head turned. */
    this.faceMatrix = Float64Array.from(IDENTITY);
  }

  /**
   * Move the body: joints, positions, normals, faceMatrix. baps: 296 numbers. headMatrix: turn of the head by FAPs, as
   * `Face.headMatrix`. faps: 68, which move a head of its own.
   * @param {ArrayLike<number>} baps @param {Float64Array} headMatrix @param {ArrayLike<number>} faps
   */
  pose(baps, headMatrix, faps) {
    const { joints } = this;
    this.turn(baps, headMatrix);
    this._ownHead?.move(this._rest, faps, this._moved);
    this._skin.apply(joints, this._moved, this._besides, this.positions, this.normals);
    for (const { shading, positions, surface } of this._shadings) shading.update(positions, surface);
    for (let at = 0; at < this.normals.length; at += 1) this.normals[at] += this._surface[at];
    normalise(this.normals, this.normals);
  }

  /** Move joints and faceMatrix alone. @param {ArrayLike<number>} baps @param {Float64Array} headMatrix */
  turn(baps, headMatrix) {
    const { joints } = this;
    this._solver.pose(baps, joints);
    if (this._ground) {
      const { standard, standing, soles, joints: others } = this._ground;
      standard.pose(baps, others);
      const lift = lowest(others, standing) - lowest(joints, soles);
      for (let at = 13; at < joints.length; at += 16) joints[at] += lift;
    }
    this._turnHead(headMatrix);
  }

  /** @param {Float64Array} turn */
  _turnHead(turn) {
    const { _motion: motion, _within: within, _inverseMotion: inverse, joints } = this;
    const skull = 16 * this._skull;
    multiply(joints.subarray(skull, skull + 16), this.inverse[this._skull], motion);
    const { size, centre } = this._turn;
    within.set(turn);
    for (let row = 0; row < 3; row += 1) {
      within[12 + row] = size * turn[12 + row] + centre[row] - (turn[row] * centre[0] + turn[4 + row] * centre[1] + turn[8 + row] * centre[2]);
    }
    if (within.some((entry, at) => entry !== IDENTITY[at])) {
      invertRigid(motion, inverse);
      multiply(within, inverse, within);
      multiply(motion, within, within);
      for (let joint = this._skull; joint < this._below.length; joint += 1) {
        const matrix = joints.subarray(16 * joint, 16 * joint + 16);
        if (this._below[joint]) multiply(within, matrix, matrix);
      }
      multiply(joints.subarray(skull, skull + 16), this.inverse[this._skull], motion);
    }
    multiply(motion, this._place, this.faceMatrix);
  }

  /** Write positions in the frame of the face's model, in the body's as modelled. @param {Float32Array} positions @param {Float32Array} placed */
  placeFace(positions, placed) {
    const [size, [x, y, z]] = [this._place[0], this._place.subarray(12, 15)];
    for (let at = 0; at < positions.length; at += 3) {
      placed[at] = size * positions[at] + x;
      placed[at + 1] = size * positions[at + 1] + y;
      placed[at + 2] = size * positions[at + 2] + z;
    }
  }
}

/** Return what says how far above the ground a body stands. @param {Record<string, any>} header @param {Solver} solver */
function readGround(header, solver) {
  const standard = new Solver(header.standard);
  const [standing, soles] = [standard, solver].map((one, which) =>
    checkedList(header.soles?.[which], "points of soles").map(([joint, ...place]) => ({
      joint: checkedNumber(joint, "the joint of a sole", one.names.length),
      place: checkedNumbers(place, "a point of a sole", 3),
    })),
  );
  return { standard, standing, soles, joints: new Float64Array(16 * standard.names.length) };
}

/** Return the height of the lowest point. @param {Float64Array} joints @param {SolePoint[]} points */
function lowest(joints, points) {
  let least = Infinity;
  for (const { joint, place } of points) {
    const at = 16 * joint;
    least = Math.min(least, joints[at + 13] + joints[at + 1] * place[0] + joints[at + 5] * place[1] + joints[at + 9] * place[2]);
  }
  return least;
}
