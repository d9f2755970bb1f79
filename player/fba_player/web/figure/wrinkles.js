/** Wrinkles of the skin: where they lie, and how strong FAPs make them, as `wrinkles.py` of the desktop player says. */
import { checkedList, checkedNumber, checkedNumbers, refuse } from "./container.js";

const KINDS = 4;
const BEGINNING = 0.5; // share of the motion at which a wrinkle begins: half a frown shows none

export class Wrinkles {
  /** @param {import("./container.js").Arrays} container @param {Record<string, any>} header @param {number} count of vertices */
  constructor(container, header, count) {
    /** Where vertices lie in the map, (count, 2), x positive on the left. */
    this.places = container.fractions(header.places, "places of wrinkles", count, 2);
    /** From places to coordinates of the map: two factors and two offsets. */
    this.window = [...checkedNumbers(header.window, "the window of wrinkles", 4)];
    /** Strength of each kind on the left, then on the right, 0..1. */
    this.strengths = new Float32Array(2 * KINDS);
    this._width = checkedNumber(header.width, "the width of the map of wrinkles", 1 << 12);
    this._pixels = () => container.indices(header.map, "the map of wrinkles", 256, undefined, KINDS);
    /** Kind, columns of the FAPs on the left and on the right, and the value that brings the wrinkle out fully. */
    this._table = checkedList(header.table, "wrinkles").map((row) => {
      const [kind, left, right, full] = checkedNumbers(row, "a wrinkle", 4);
      return { kind: checkedNumber(kind, "a wrinkle", KINDS), columns: [left, right].map((column) => checkedNumber(column, "a FAP", 68)), full };
    });
  }

  /** The map: a channel for each kind. It is read when it is first needed. @returns {{width: number, height: number, data: Uint8Array}} */
  get map() {
    const pixels = Uint8Array.from(this._pixels());
    if (!this._width || pixels.length % (KINDS * this._width)) refuse("has a map of wrinkles that is no rectangle");
    return { width: this._width, height: pixels.length / KINDS / this._width, data: pixels };
  }

  /** Set the strengths for FAPs, 68. @param {ArrayLike<number>} faps */
  show(faps) {
    this.strengths.fill(0);
    for (const { kind, columns, full } of this._table) columns.forEach((column, side) => (this.strengths[KINDS * side + kind] += Math.max(faps[column] / full, 0)));
    this.strengths.forEach((sum, at) => {
      const share = Math.min(Math.max((sum - BEGINNING) / (1 - BEGINNING), 0), 1);
      this.strengths[at] = share * share * (3 - 2 * share);
    });
  }
}
