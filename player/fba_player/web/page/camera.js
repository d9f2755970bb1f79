/** The camera: an orbit about a target, with the named views of the desktop player. */
import { multiply } from "../figure/matrices.js";

/**
 * The box that a camera is fitted to: its centre, and half its height, width and depth, metres.
 * @typedef {{centre: number[], halfHeight: number, halfWidth: number, halfDepth?: number}} Subject
 * @typedef {import("../figure/matrices.js").Vector} Vector
 */

/** Yaw (to the subject's left) and pitch (from above) of the named views, degrees. */
export const VIEWS = /** @type {Record<string, [number, number]>} */ ({
  "front": [0, 0],
  "three-quarter": [35, 5],
  "profile": [90, 0],
  "body": [25, 8],
});
const FIELD_OF_VIEW = 24;
const SCALE = 1 / Math.tan((FIELD_OF_VIEW * Math.PI) / 360);
const STEEPEST = 89;
const [NEAREST, FARTHEST] = [0.05, 100];

/** Looks at `target` from `distance` metres; yaw and pitch in degrees, 0, 0 from the front. */
export class Camera {
  constructor(target = /** @type {Vector} */ ([0, 0, 0]), yaw = 0, pitch = 0, distance = 1) {
    this.target = target;
    this.yaw = yaw;
    this.pitch = pitch;
    this.distance = distance;
  }

  copy() {
    return new Camera([...this.target], this.yaw, this.pitch, this.distance);
  }

  /** Move along the line of sight so that the subject fills the picture. @param {Subject} subject @param {number} aspect */
  fit(subject, aspect) {
    const half = Math.max(subject.halfHeight, subject.halfWidth / Math.max(aspect, 1e-3));
    this.target = /** @type {Vector} */ ([...subject.centre]);
    this.distance = clamped(half * SCALE + (subject.halfDepth ?? 0), NEAREST, FARTHEST);
    return this;
  }

  /** Turn about the target. @param {number} yaw @param {number} pitch degrees */
  orbit(yaw, pitch) {
    this.yaw = ((((this.yaw + yaw + 180) % 360) + 360) % 360) - 180;
    this.pitch = clamped(this.pitch + pitch, -STEEPEST, STEEPEST);
  }

  /** @param {number} factor of the distance: below 1 comes nearer */
  zoom(factor) {
    this.distance = clamped(this.distance * factor, NEAREST, FARTHEST);
  }

  /** Move the target across the view. @param {number} right @param {number} up shares of the picture's height */
  pan(right, up) {
    const [x, y] = this._axes();
    const size = (2 * this.distance) / SCALE;
    for (let k = 0; k < 3; k += 1) this.target[k] += (x[k] * right + y[k] * up) * size;
  }

  /** Return a camera between this one (share 0) and another (share 1), the shorter way round. @param {Camera} other @param {number} share */
  between(other, share) {
    const turn = ((((other.yaw - this.yaw + 180) % 360) + 360) % 360) - 180;
    const target = /** @type {Vector} */ (this.target.map((from, k) => from + (other.target[k] - from) * share));
    const distance = this.distance * (other.distance / this.distance) ** share;
    return new Camera(target, this.yaw + turn * share, this.pitch + (other.pitch - this.pitch) * share, distance);
  }

  /** Position of the camera. */
  get eye() {
    const back = this._axes()[2];
    return /** @type {Vector} */ (this.target.map((from, k) => from + back[k] * this.distance));
  }

  /** Return the matrix from world to clip space. @param {number} aspect width / height of the picture */
  matrix(aspect) {
    const [axes, eye] = [this._axes(), this.eye];
    const seen = new Float64Array(16);
    axes.forEach((axis, row) => {
      for (let k = 0; k < 3; k += 1) seen[4 * k + row] = axis[k];
      seen[12 + row] = -(axis[0] * eye[0] + axis[1] * eye[1] + axis[2] * eye[2]);
    });
    seen[15] = 1;
    const [near, far] = [this.distance * 0.05, this.distance * 4 + 60];
    const projection = new Float64Array(16);
    projection[0] = SCALE / Math.max(aspect, 1e-3);
    projection[5] = SCALE;
    projection[10] = (far + near) / (near - far);
    projection[14] = (2 * far * near) / (near - far);
    projection[11] = -1;
    return multiply(projection, seen);
  }

  /** Size of a pixel at a distance of 1. @param {number} height of the picture, pixels */
  pixel(height) {
    return 2 / SCALE / Math.max(height, 1);
  }

  /** Right, up and backward of the camera, in the world. @returns {[Vector, Vector, Vector]} */
  _axes() {
    const [yaw, pitch] = [(this.yaw * Math.PI) / 180, (this.pitch * Math.PI) / 180];
    const [rightX, rightZ] = [Math.cos(yaw), -Math.sin(yaw)];
    const [x, y, z] = [Math.sin(yaw) * Math.cos(pitch), Math.sin(pitch), Math.cos(yaw) * Math.cos(pitch)];
    return [
      [rightX, 0, rightZ],
      [y * rightZ, z * rightX - x * rightZ, -y * rightX],
      [x, y, z],
    ];
  }
}

/** @param {number} value @param {number} low @param {number} high */
export function clamped(value, low, high) {
  return Math.min(Math.max(value, low), high);
}
