/** The kinds of errors: of the stream, of what is not supported, of a limit, of an argument. @typedef {"damage" | "unsupported" | "limit" | "option"} Kind */

/** @type {{[kind: string]: string | undefined}} */
const REMEDIES = { damage: "the option salvage reads on", limit: "raise it" };

/** A stream, or an argument, that cannot be used: the message says where, what was found, and what helps. */
export class FbaError extends Error {
  /**
   * @param {Kind} kind
   * @param {string} finding what was found, and what was expected
   * @param {number} [plane] from 0
   * @param {number} [bit] from the start of the stream
   * @param {string} [remedy]
   */
  constructor(kind, finding, plane, bit, remedy = REMEDIES[kind] ?? "") {
    super((plane === undefined ? "" : `plane ${plane}, bit ${bit ?? 0}: `) + finding + (remedy && `; ${remedy}`));
    this.name = "FbaError";
    this.kind = kind;
    this.finding = finding;
    /** Number of the damaged plane, from 0. */
    this.plane = plane;
    /** Position of the damage, from the start of the stream. */
    this.bit = bit;
    this.remedy = remedy;
  }
}
