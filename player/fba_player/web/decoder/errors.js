/** Which kind of fault an {@link FbaError} reports. @typedef {"damage" | "unsupported" | "limit" | "option"} Kind */

/** A stream, or an argument, that cannot be used: the message says where, what was found, and what helps. */
export class FbaError extends Error {
  /**
   * @param {Kind} kind
   * @param {string} finding what was found, and what was expected
   * @param {{plane?: number, bit?: number, remedy?: string}} [place] plane: from 0. bit: from the start of the stream
   */
  constructor(kind, finding, place = {}) {
    const where = [];
    if (place.plane !== undefined) where.push(`plane ${place.plane}`);
    if (place.bit !== undefined) where.push(`bit ${place.bit} (byte ${Math.floor(place.bit / 8)})`);
    const located = where.length ? `${where.join(", ")}: ${finding}` : finding;
    super(place.remedy ? `${located}; ${place.remedy}` : located);
    this.name = "FbaError";
    this.kind = kind;
    this.finding = finding;
    /** Number of the damaged plane, from 0. @type {number | undefined} */
    this.plane = place.plane;
    /** Position of the damage, from the start of the stream. @type {number | undefined} */
    this.bit = place.bit;
    this.remedy = place.remedy ?? "";
  }
}
