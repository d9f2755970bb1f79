/** What the extension FBA_face of glTF files says of a face, besides its arrays. */
import { FAP_NAMES, FAP_UNITS } from "../page/names.js";
import { checkedList, checkedNumber, checkedNumbers, refuse } from "./container.js";

/** @typedef {ArrayLike<number>} Point */
/** What turns a part, the head where part is null, for one step of a FAP. @typedef {{part: number | null, kind: string, fap: number, column: number, amount: Float64Array, centre: Float64Array}} Turn */

export const PER_DISTANCE = 1024;
const RADIAN = 1e-5;
const MOST_TURNS = 10_000;
const OUTWARD = ["translation", "rotation", "scale"];
const [PITCH, ROLL] = [48, 50];

/** @param {unknown} name of a low-level FAP */
export function fapNumber(name) {
  const number = FAP_NAMES.indexOf(String(name)) + 1;
  return number > 2 ? number : refuse(`names the FAP ${String(name).slice(0, 60)}, which does not exist`);
}

/** Return the feature points by name. @param {Record<string, any>} face @returns {Map<string, Point>} */
export function pointsOf(face) {
  return new Map(Object.entries(face.featurePoints).map(([name, { position }]) => [name, checkedNumbers(position, "a feature point", 3)]));
}

/** Return the units of FAPs, as `fba.face.Fapu`. @param {Map<string, Point>} points @returns {Record<string, number>} */
export function measure(points) {
  const [x, y] = [0, 1].map((axis) => (/** @type {string} */ name) => points.get(name)?.[axis] ?? NaN);
  const distances = {
    IRISD: (y("3.1") - y("3.3") + y("3.2") - y("3.4")) / 2,
    ES: x("3.5") - x("3.6"),
    ENS: (y("3.5") + y("3.6")) / 2 - y("9.15"),
    MNS: y("9.15") - y("2.2"),
    MW: x("8.3") - x("8.4"),
  };
  for (const [unit, distance] of Object.entries(distances)) if (!(distance > 0)) refuse(`has ${distance} as ${unit}0, expected a distance above 0: its feature points are wrong`);
  return { ...Object.fromEntries(Object.entries(distances).map(([unit, distance]) => [unit, distance / PER_DISTANCE])), AU: RADIAN };
}

/** Return what turns parts and head, the outermost first. @param {Record<string, any>} face @param {Record<string, number>} units @param {number} factor by which the face is scaled @returns {Turn[]} */
export function turnsOf(face, units, factor) {
  const turns = checkedList(face.tables ?? [], "tables").flatMap(({ fap, transforms = [] }) => {
    const number = fapNumber(fap);
    return listOf(transforms, "transforms", MOST_TURNS).map(({ part = null, kind, amount, centre = [0, 0, 0] }) => ({
      part: part === null ? null : checkedNumber(part, "the part of a transform", face.parts.length),
      kind: OUTWARD.includes(kind) ? String(kind) : refuse("has an unknown kind of transform"),
      fap: number,
      column: number - 1,
      amount: checkedNumbers(amount, "a transform", 3).map((step) => step * units[FAP_UNITS[number - 1]] * (kind === "translation" ? factor : 1)),
      centre: checkedNumbers(centre, "a centre", 3).map((place) => factor * place),
    }));
  });
  const rank = (/** @type {Turn} */ { kind, fap }) => 100 * OUTWARD.indexOf(kind) + (fap === PITCH ? ROLL + 0.5 : fap);
  return turns.sort((one, other) => rank(one) - rank(other));
}

/** @param {unknown} values @param {string} what @param {number} most */
export function listOf(values, what, most) {
  const list = checkedList(values, what);
  return list.length <= most ? list : refuse(`has ${list.length} ${what}, expected ${most} at most`);
}
