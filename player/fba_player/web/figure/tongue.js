/** Keeps a tongue, as it is shown, between the teeth and over the lower lip: what `_tongue.py` of the desktop player does. */
import { checkedList, checkedNumber, checkedNumbers, refuse } from "./container.js";
import { IDENTITY } from "./matrices.js";

/** @typedef {import("./container.js").Arrays} Container */
/** @typedef {import("./face.js").Face} Face */
/** @typedef {[number, number, number]} Place */

const TONGUE_FAPS = [42, 43, 44, 45, 46]; // columns
const FULL_AT = 60; // value of one of them from which the tongue keeps fully to the room that it has
const [ADULT, CLEARANCE, SOFT, THICK_TEETH] = [0.064, 0.0006, 0.007, 0.006]; // metres; eyes of an adult are so far apart
const [SHUT, WIDE] = [0.0015, 0.0045]; // gaps between which a tongue begins to come out
const [LATERAL, DROOP] = [0.8, 6];
const [LIPS, TEETH] = [["2.2", "2.3", "2.4", "2.5"], ["9.10", "9.11", "9.8", "9.9"]];
const SLICES = 18;

/** A tongue, and what is around it. */
export class Tongue {
  /** @param {Container} container @param {Record<string, any>} header @param {import("./parts.js").Part[]} parts */
  constructor(container, header, parts) {
    this.part = checkedNumber(header.part, "the part of a tongue", parts.length);
    const last = parts[parts.length - 1];
    const vertex = (/** @type {unknown} */ row) => checkedNumber(row, "a vertex around a tongue", last.first + last.count);
    const { count } = parts[this.part];
    this._slices = container.indices(header.slices, "the slices of a tongue", 256, count, 1);
    this._length = container.fractions(header.length, "the length of a tongue", count, 1);
    this._size = checkedNumber(header.size, "the size of a face");
    if (!(this._size > 0)) refuse("has a face of no size");
    const around = [...checkedList(header.lips, "lips"), ...checkedList(header.teeth, "teeth"), header.front].map(vertex);
    if (around.length !== 9) refuse("lacks lips and teeth around a tongue");
    this._around = around.map((row) => ({ row, part: parts.findIndex(({ first, count: size }) => row >= first && row < first + size) }));
    this._kept = new Float64Array(3 * count);
    const slices = this._slices.reduce((most, slice) => Math.max(most, slice + 1), 1);
    this._sums = new Float64Array(5 * slices);
    this._shifts = new Float64Array(slices);
  }

  /**
   * Move the tongue's vertices to where there is room; return whether it did. face: moved by FAPs, the turns of its parts known.
   * @param {Face} face @param {ArrayLike<number>} faps
   */
  bend(face, faps) {
    const share = Math.min(Math.max(...TONGUE_FAPS.map((column) => Math.abs(faps[column]))) / FULL_AT, 1);
    if (share === 0) return false;
    const { positions } = face.parts[this.part];
    const turn = face.partMatrices[this.part];
    if (turn.some((entry, at) => entry !== IDENTITY[at])) {
      for (let at = 0; at < positions.length; at += 3) positions.set(turned(turn, positions, at), at);
      turn.set(IDENTITY);
    }
    const places = this._around.map(({ row, part }) => turned(face.partMatrices[part], face.positions, 3 * row));
    const room = new Room(places, this._size);
    const points = this._kept;
    for (let at = 0; at < points.length; at += 3) room.stop(positions, points, at);
    this._level(points, room);
    for (let at = 0; at < points.length; at += 3) {
      room.bounds(points[at], points[at + 2]);
      points[at + 1] = clip(points[at + 1], room.floor, room.roof);
      for (let k = at; k < at + 3; k += 1) positions[k] += share * (points[k] - positions[k]);
    }
    return true;
  }

  /** Move points up or down by cross sections, so that each lies within the room. @param {Float64Array} points @param {Room} room */
  _level(points, room) {
    const { _slices: slices, _sums: sums, _shifts: shifts, _length: length } = this;
    for (let at = 0; at < sums.length; at += 5) sums.set([Infinity, -Infinity, 0, 0, 0], at);
    slices.forEach((slice, vertex) => {
      const [to, at] = [5 * slice, 3 * vertex];
      sums[to] = Math.min(sums[to], points[at + 1]);
      sums[to + 1] = Math.max(sums[to + 1], points[at + 1]);
      sums[to + 2] += points[at];
      sums[to + 3] += points[at + 2];
      sums[to + 4] += 1;
    });
    for (let slice = 0; slice < shifts.length; slice += 1) {
      const [low, high, x, z, count] = sums.subarray(5 * slice, 5 * slice + 5);
      room.bounds(x / count, z / count);
      const half = Math.min((high - low) / 2, Math.max(room.roof - room.floor, 0) / 2);
      const lowest = room.floor + half;
      shifts[slice] = count ? clip((low + high) / 2, lowest, Math.max(room.roof - half, lowest)) - (low + high) / 2 : 0;
    }
    for (let round = 0; round < 2; round += 1) {
      let before = shifts[0];
      shifts.forEach((shift, slice) => {
        shifts[slice] = (before + 2 * shift + (shifts[slice + 1] ?? shift)) / 4;
        before = shift;
      });
    }
    for (let vertex = 0; vertex < length.length; vertex += 1) {
      const place = clip(length[vertex] - 0.5, 0, shifts.length - 1);
      const slice = Math.min(Math.floor(place), Math.max(shifts.length - 2, 0));
      const next = shifts[slice + 1] ?? shifts[slice];
      points[3 * vertex + 1] += shifts[slice] + (place - slice) * (next - shifts[slice]) - room.droop(points[3 * vertex + 2]);
    }
  }
}

/** The room that a tongue has. */
class Room {
  /** @param {Place[]} places of lips, teeth, and the foremost point of the lower lip @param {number} size of the face, 1 for an adult's */
  constructor([upper, lower, left, right, topEdge, lowEdge, topRoot, lowRoot, front], size) {
    this._size = size;
    this._lips = [upper, lower, left.map((place, axis) => (place + right[axis]) / 2)];
    this._half = Math.max(Math.abs(left[0] - right[0]) / 2, 1e-6);
    this._front = front[2];
    const teeth = shareOpen(topEdge[1] - lowEdge[1], size);
    const lips = shareOpen(upper[1] - lower[1], size);
    const behindTeeth = Math.min(topEdge[2], lowEdge[2]) - 0.0022 * size;
    const behindLips = Math.min(upper[2], lower[2]) - 0.003 * size;
    this._knee = behindTeeth + teeth * Math.max(behindLips - behindTeeth, 0) + teeth * lips * 0.2 * size - SOFT * size;
    const inner = Math.min(topEdge[2], lowEdge[2]) - THICK_TEETH * size;
    this._gate = Math.max(topEdge[2], lowEdge[2]);
    this._depth = [inner - 0.045 * size, inner - 0.006 * size, inner, this._gate];
    this._floors = [lowRoot[1] - 0.05 * size, lowRoot[1], lowEdge[1], lowEdge[1]];
    this._roofs = [topRoot[1], topRoot[1], topEdge[1], topEdge[1]];
    this.floor = 0;
    this.roof = 0;
  }

  /** Write a point that closed teeth or lips stop, and that cheeks hold. @param {ArrayLike<number>} from @param {Float64Array} to @param {number} at */
  stop(from, to, at) {
    const soft = SOFT * this._size;
    const beyond = from[at + 2] - this._knee;
    to[at + 2] = beyond > 0 ? this._knee + soft * (1 - Math.exp(-beyond / soft)) : from[at + 2];
    const wide = LATERAL * this._half + 1.2 * Math.max(to[at + 2] - this._front, 0);
    to[at] = clip(from[at], -wide, wide);
    to[at + 1] = from[at + 1];
  }

  /** Compute the lowest and the highest y of a tongue at x and z. @param {number} x @param {number} z */
  bounds(x, z) {
    this.floor = -Infinity;
    this.roof = Infinity;
    if (z > this._front + 0.001 * this._size) return;
    const [upper, lower, corner] = this._lips;
    const across = Math.min(Math.abs(x) / this._half, 1) ** 2;
    const ahead = z + (1 - Math.sqrt(Math.max(1 - 0.8 * across, 0))) * 1.6 * this._half; // the arches of teeth and lips curve back
    const atLips = smooth((z + across * (lower[2] - corner[2]) - this._gate) / Math.max(lower[2] - this._gate, 1e-4));
    let [floor, roof] = [between(ahead, this._depth, this._floors), between(ahead, this._depth, this._roofs)];
    floor += atLips * (lower[1] + across * (corner[1] - lower[1]) - floor) + CLEARANCE * this._size;
    roof += atLips * (upper[1] + across * (corner[1] - upper[1]) - roof) - CLEARANCE * this._size;
    this.floor = Math.min(floor, (floor + roof) / 2);
    this.roof = Math.max(roof, (floor + roof) / 2);
  }

  /** Return by how many metres a point before the lips hangs down. @param {number} z */
  droop(z) {
    return (DROOP / this._size) * Math.max(z - this._front, 0) ** 2;
  }
}

/** @param {number} value @param {number} low @param {number} high */
function clip(value, low, high) {
  return Math.min(Math.max(value, low), high);
}

/** @param {number} share */
function smooth(share) {
  const t = clip(share, 0, 1);
  return t * t * (3 - 2 * t);
}

/** @param {number} gap @param {number} size */
function shareOpen(gap, size) {
  return smooth((gap / size - SHUT) / (WIDE - SHUT));
}

/** Return the value of a curve through points at x. @param {number} x @param {number[]} places rising @param {number[]} values */
function between(x, places, values) {
  if (x <= places[0]) return values[0];
  for (let k = 1; k < places.length; k += 1) {
    if (x < places[k]) return values[k - 1] + ((x - places[k - 1]) / (places[k] - places[k - 1])) * (values[k] - values[k - 1]);
  }
  return values[values.length - 1];
}

/** Return a turned point. @param {Float64Array} matrix @param {ArrayLike<number>} points @param {number} at @returns {Place} */
function turned(matrix, points, at) {
  const [x, y, z] = [points[at], points[at + 1], points[at + 2]];
  const [a, b, c] = [0, 1, 2].map((row) => matrix[row] * x + matrix[4 + row] * y + matrix[8 + row] * z + matrix[12 + row]);
  return [a, b, c];
}

/**
 * Return headers of the tongues of a face of a .glb file whose lips and teeth are known.
 * @param {Record<string, any>} header of the face @param {(name: string) => number} bound vertices of feature points, -1 for missing ones @param {number} apart between the eyes @param {number} nose from it to the upper lip; metres
 */
export function findTongues(header, bound, apart, nose) {
  const [lips, teeth] = [LIPS, TEETH].map((names) => names.map(bound));
  if (Math.min(...lips, ...teeth) < 0) return [];
  const front = frontOfLip(header, lips[1], nose);
  let first = 0;
  return header.parts.flatMap((/** @type {{kind: string, count: number, triangles: ArrayLike<number>}} */ { kind, count, triangles }, /** @type {number} */ part) => {
    const z = Float64Array.from({ length: count }, (_, vertex) => header.positions[3 * (first + vertex) + 2]);
    first += count;
    const sorted = z.slice().sort();
    if (kind !== "tongue" || !triangles.length || !(sorted[count - 1] > sorted[0])) return [];
    const steps = Array.from({ length: SLICES + 1 }, (_, k) => {
      const place = (k / SLICES) * (count - 1);
      const [low, high] = [sorted[Math.floor(place)], sorted[Math.ceil(place)]];
      return low + (high - low) * (place % 1);
    });
    const borders = steps.filter((border, k) => k === 0 || border > steps[k - 1]);
    const length = Float32Array.from(z, (depth) => between(depth, borders, [...borders.keys()]));
    const numbers = Array.from(length, (place) => Math.min(Math.floor(place), borders.length - 2));
    const used = [...new Set(numbers)].sort((one, other) => one - other);
    const slices = Int32Array.from(numbers, (number) => used.indexOf(number));
    return [{ part, slices, length, lips, teeth, front, size: apart / ADULT }];
  });
}

/** Return the foremost vertex of the lower lip near the midline. @param {Record<string, any>} header @param {number} lip the vertex of its middle @param {number} nose */
function frontOfLip({ parts, positions }, lip, nose) {
  const [x, y] = positions.subarray(3 * lip, 3 * lip + 2);
  let [found, first] = [-1, 0];
  for (const { kind, count } of parts) {
    for (let at = first; kind === "skin" && at < first + count; at += 1) {
      const below = y - positions[3 * at + 1];
      const near = Math.abs(positions[3 * at] - x) < 0.1 * nose && below >= 0 && below < 0.3 * nose;
      if (near && (found < 0 || positions[3 * at + 2] > positions[3 * found + 2])) found = at;
    }
    first += count;
  }
  return found < 0 ? lip : found;
}
