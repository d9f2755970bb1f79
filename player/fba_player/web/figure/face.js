/** Moves the vertices of a face by FAPs: what `fba.face.Deformer` does, with the motion of each FAP as few shapes. */
import { checkedFap, checkedList, checkedNumber, checkedNumbers, refuse } from "./container.js";
import { followGaze, readGazes } from "./lids.js";
import { IDENTITY, multiply, rotate, setColumns, turnVector } from "./matrices.js";
import { Shading, readParts } from "./parts.js";
import { Rules } from "./resolve.js";
import { Tongue } from "./tongue.js";
import { ShapeWeights } from "../loader/weights.js";

/** @typedef {import("./container.js").Arrays} Container */

/**
 * What a FAP does to some vertices of a part: shapes, the first at `shape`, times curves over its value; curve c has at border b
 * the value curves[c * borders.length + b], and is linear between them and beyond.
 * @typedef {{column: number, part: number, borders: Float64Array, curves: Float64Array, count: number, row: number, rows: number, shape: number}} Track
 *
 * @typedef {{column: number, kind: string, amount: Float64Array, centre: Float64Array}} Transform
 */

const FAPS = 68;
const KINDS = ["translation", "rotation", "scale"];

/** A face that FAPs move. Axes: +x the subject's left, +y up, +z forward; metres. */
export class Face {
  /** @param {Container} container @param {Record<string, any>} header */
  constructor(container, header) {
    this._rest = container.fractions(header.positions, "positions of the face", undefined, 3);
    const count = this._rest.length / 3;
    /** Positions moved by FAPs, three numbers a vertex, without the turns of parts and head. */
    this.positions = this._rest.slice();
    /** Their normals. */
    this.normals = new Float32Array(3 * count);
    this.parts = readParts(container, header.parts, this.positions, this.normals);
    /** How the face fills in what is not sent; see `Resolver`. */
    this.rules = new Rules(header);
    /** Where the head turns about. */
    this.centre = checkedNumbers(header.centre, "the centre of the head", 3);
    /** How far each vertex turns with the head. */
    this.sway = container.fractions(header.sway, "the sway of the neck", count, 1);
    this._rows = container.indices(header.rows, "the rows of the motion", count, undefined, 1);
    this._shapes = container.integers(header.shapes?.array, "the shapes of the motion");
    this._step = checkedNumber(header.shapes.step, "the step of the motion");
    if (this._shapes.columns !== 3) refuse("has shapes that are not of three numbers");
    this._tracks = readTracks(header, this._rows, this._shapes.rows, this.parts);
    this._transforms = readTransforms(header, this.parts);
    this._gazes = readGazes(checkedList(header.eyes ?? [], "eyes"));
    this._tongues = checkedList(header.tongues ?? [], "tongues").map((tongue) => new Tongue(container, tongue, this.parts));
    const moving = new Uint8Array(count);
    for (const { row, rows } of this._tracks) for (let at = row; at < row + rows; at += 1) moving[this._rows[at]] = 1;
    for (const { part } of this._tongues) moving.fill(1, this.parts[part].first, this.parts[part].first + this.parts[part].count);
    this._shadings = this.parts.map((part) => {
      const shading = new Shading(part, moving.subarray(part.first, part.first + part.count));
      part.normals.set(shading.rest);
      return shading;
    });
    this._faps = new Float64Array(FAPS);
    /** What mixes the shapes of a head of another program, whose tracks are of shapes. */
    this._mixer = header.weights ? new ShapeWeights(header.weights) : null;
    /** Values of what moves vertices. @type {ArrayLike<number>} */
    this._values = this._faps;
    this._touched = new Uint8Array(this.parts.length);
    this._was = new Uint8Array(this.parts.length);
    /** Turn of each part within the head, 16 numbers each, column by column. */
    this.partMatrices = this.parts.map(() => Float64Array.from(IDENTITY));
    /** Turn of the head, 16 numbers, column by column. */
    this.headMatrix = Float64Array.from(IDENTITY);
    this._bent = Float64Array.from(IDENTITY);
    this._combined = Float64Array.from(IDENTITY);
  }

  /**
   * Move the face: positions, normals, partMatrices and headMatrix. Lids follow the gaze, and a tongue keeps between teeth and
   * lips. faps: 68 numbers, as a `Resolver` gives them.
   * @param {ArrayLike<number>} faps
   */
  pose(faps) {
    this._faps.set(faps);
    if (!this._mixer) followGaze(this._gazes, this._faps); // shapes that look up and down move lids
    this._values = this._mixer?.of(faps) ?? this._faps;
    this.positions.set(this._rest);
    this._touched.fill(0);
    for (const track of this._tracks) this._move(track);
    this.parts.forEach((_, at) => composeTurns(this._transforms[at], this._faps, this.partMatrices[at]));
    for (const tongue of this._tongues) if (tongue.bend(this, faps)) this._touched[tongue.part] = 1;
    this.parts.forEach((part, at) => {
      if (this._touched[at]) this._shadings[at].update(part.positions, part.normals);
      else if (this._was[at]) part.normals.set(this._shadings[at].rest);
    });
    this._was.set(this._touched);
    composeTurns(this._transforms[this.parts.length], this._faps, this.headMatrix);
  }

  /** @param {Track} track */
  _move({ column, part, borders, curves, count, row, rows, shape }) {
    const value = this._values[column];
    if (value === 0) return;
    this._touched[part] = 1;
    const { positions, _rows: moved } = this;
    const { values } = this._shapes;
    const size = borders.length;
    let border = 1;
    while (border < size - 1 && value > borders[border]) border += 1;
    const share = (value - borders[border - 1]) / (borders[border] - borders[border - 1]);
    for (let curve = 0, from = 3 * shape; curve < count; curve += 1) {
      const low = curves[curve * size + border - 1];
      const weight = (low + (curves[curve * size + border] - low) * share) * this._step;
      if (weight === 0) {
        from += 3 * rows;
        continue;
      }
      for (let at = row; at < row + rows; at += 1, from += 3) {
        const to = 3 * moved[at];
        positions[to] += weight * values[from];
        positions[to + 1] += weight * values[from + 1];
        positions[to + 2] += weight * values[from + 2];
      }
    }
  }

  /**
   * Write positions and normals, parts and head turned, in the frame of the model. bend: whether the neck bends, as players
   * show it; else all of the model turns with the head. withHead: false for the frame of the head.
   * @param {Float32Array} positions @param {Float32Array} normals @param {{bend?: boolean, withHead?: boolean}} [options]
   */
  place(positions, normals, { bend = true, withHead = true } = {}) {
    const [x, y, z] = turnVector(this.headMatrix);
    const bends = withHead && bend && (x !== 0 || y !== 0 || z !== 0);
    for (let number = 0; number < this.parts.length; number += 1) {
      const { first, count } = this.parts[number];
      const stop = first + count;
      for (let start = first, next = first; start < stop; start = next) {
        const share = bends ? this.sway[start] : 1;
        while (next < stop && (!bends || this.sway[next] === share)) next += 1;
        if (share < 1) rotate(this._bent, x * share, y * share, z * share, this.centre);
        multiply(!withHead ? IDENTITY : share < 1 ? this._bent : this.headMatrix, this.partMatrices[number], this._combined);
        put(this._combined, this.positions, positions, 3 * start, 3 * next, 1);
        put(this._combined, this.normals, normals, 3 * start, 3 * next, 0);
      }
    }
  }
}

const TURN = new Float64Array(16);

/** Write the product of transforms, the outermost first. @param {Transform[]} transforms @param {ArrayLike<number>} faps @param {Float64Array} result */
export function composeTurns(transforms, faps, result) {
  result.set(IDENTITY);
  for (const { column, kind, amount, centre } of transforms) {
    const value = faps[column];
    if (value === 0) continue;
    const [x, y, z] = [value * amount[0], value * amount[1], value * amount[2]];
    TURN.set(IDENTITY);
    if (kind === "translation") setColumns(TURN, 12, x, y, z);
    else if (kind === "rotation") rotate(TURN, x, y, z, centre);
    else {
      [TURN[0], TURN[5], TURN[10]] = [1 + x, 1 + y, 1 + z];
      setColumns(TURN, 12, -x * centre[0], -y * centre[1], -z * centre[2]);
    }
    multiply(result, TURN, result);
  }
}

/**
 * Return what each FAP does to each part.
 * @param {Record<string, any>} header @param {ArrayLike<number>} moved vertices of all tracks @param {number} shapes how many rows there are @param {import("./parts.js").Part[]} parts
 */
function readTracks(header, moved, shapes, parts) {
  let [row, shape] = [0, 0];
  return checkedList(header.tracks, "tracks").map((entry) => {
    const borders = checkedNumbers(entry.borders, "borders");
    const curves = checkedList(entry.curves, "curves").map((curve) => checkedNumbers(curve, "a curve", borders.length));
    if (borders.length < 2 || borders.some((border, at) => at && border <= borders[at - 1])) refuse("has borders that do not rise");
    const rows = checkedNumber(entry.rows, "rows of a FAP", moved.length - row + 1);
    /** @type {Track} */
    const track = {
      column: checkedFap(entry.fap),
      part: rows ? parts.findIndex(({ first, count }) => moved[row] >= first && moved[row] < first + count) : 0,
      borders,
      curves: Float64Array.from(curves.flatMap((curve) => [...curve])),
      count: curves.length,
      row,
      rows,
      shape,
    };
    row += rows;
    shape += rows * curves.length;
    if (shape > shapes) refuse("ends inside the shapes of the motion");
    return track;
  });
}

/** Return what turns each part, outermost first, then the head. @param {Record<string, any>} header @param {import("./parts.js").Part[]} parts @returns {Transform[][]} */
function readTransforms(header, parts) {
  /** @type {Transform[][]} */
  const transforms = Array.from({ length: parts.length + 1 }, () => []);
  for (const entry of checkedList(header.transforms, "turns")) {
    const part = entry.part === null ? parts.length : parts.findIndex(({ name }) => name === entry.part);
    if (!KINDS.includes(entry.kind)) refuse(`has an unknown turn ${JSON.stringify(entry.kind)}`);
    if (part < 0) continue; // of a part that is not shown
    const column = checkedFap(entry.fap);
    const numbers = { amount: checkedNumbers(entry.amount, "a turn", 3), centre: checkedNumbers(entry.centre, "a turn's centre", 3) };
    transforms[part].push({ column, kind: entry.kind, ...numbers });
  }
  return transforms;
}

/**
 * Write moved vectors.
 * @param {Float64Array} matrix @param {Float32Array} from @param {Float32Array} to @param {number} start @param {number} stop @param {number} shift 1 for points, 0 for directions
 */
function put(matrix, from, to, start, stop, shift) {
  const a = matrix[0], b = matrix[1], c = matrix[2], d = matrix[4], e = matrix[5], f = matrix[6]; // prettier-ignore
  const g = matrix[8], h = matrix[9], i = matrix[10], j = matrix[12], k = matrix[13], l = matrix[14]; // prettier-ignore
  for (let at = start; at < stop; at += 3) {
    const x = from[at];
    const y = from[at + 1];
    const z = from[at + 2];
    to[at] = a * x + d * y + g * z + shift * j;
    to[at + 1] = b * x + e * y + h * z + shift * k;
    to[at + 2] = c * x + f * y + i * z + shift * l;
  }
}
