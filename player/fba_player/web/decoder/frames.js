/** What users get of a plane. */
import { FIRST_BAP, FIRST_FAP, FLAGS, SLOTS } from "./parameters.js";
import { timeIn } from "./clock.js";
import { value } from "./fraction.js";

/**
 * The FAPs of a frame. values: FAPs 3 to 68 at 2 to 67, in the standard's units. mask: which of the 68 are sent.
 * interpolated: which unsent ones a face is to interpolate (mask type 2). viseme: select1, select2, blend, viseme_def.
 * expression: select1, intensity1, select2, intensity2, init_face, expression_def.
 * @typedef {{values: Int32Array, mask: Uint8Array, interpolated: Uint8Array, viseme: number[], expression: number[]}} FaceFrame
 *
 * The BAPs of a frame: values and mask of BAPs 1 to 296.
 * @typedef {{values: Int32Array, mask: Uint8Array}} BodyFrame
 *
 * A frame, shown at `time` seconds, which is index / rate. face, body: null where the plane carries none.
 * @typedef {{index: number, time: number, face: FaceFrame | null, body: BodyFrame | null}} Frame
 *
 * plane: number of the frame's plane in the stream. bit, bits: its place and length. intra: whether it is an I plane.
 * doubtful: its values may be wrong, as ranges may have been replaced in a lost plane. rate: frames per second here.
 * @typedef {Frame & {plane: number, bit: number, bits: number, intra: boolean, doubtful: boolean, rate: number}} StreamFrame
 */

/** Return the face and the body of a plane. @param {import("./planes.js").Plane} plane */
export function partsOf({ _face: face, _body: body, _row: row }) {
  const values = new Int32Array(body ? SLOTS : FIRST_BAP);
  let at = 0;
  for (const part of [face, body]) for (const slot of part?._slots ?? []) values[slot] = row[at++];
  const [select1, select2, blend, ...expression] = values.subarray(0, FIRST_FAP);
  const [visemeDef, ...expressionFlags] = row.subarray(at);
  return {
    face: face ? {
      values: values.subarray(FIRST_FAP - 2, FLAGS).fill(0, 0, 2),
      mask: face.mask,
      interpolated: face.interpolated,
      viseme: [select1, select2, blend, visemeDef],
      expression: [...expression, ...expressionFlags],
    } : null,
    body: body ? { values: values.subarray(FIRST_BAP), mask: body.mask } : null,
  };
}

/** @param {import("./stream.js").StreamPlane} plane @returns {StreamFrame} */
export const streamFrame = (plane) => ({
  ...plane._shown,
  time: value(timeIn(plane._span, plane._shown.index)),
  rate: value(plane._span[0]),
  ...partsOf(plane),
});
