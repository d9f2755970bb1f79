/** The borders of a stream's objects, the bytes around them, and their marks. */
import { END, SEQUENCE, USER_DATA } from "./bits.js";
import { readMark } from "./marks.js";

/** @typedef {import("./parameters.js").BapSteps} BapSteps */

export class ObjectBorders {
  /** @param {BapSteps | undefined} bapSteps the table of all objects; without, the one that a mark names */
  constructor(bapSteps) {
    this._bapSteps = bapSteps;
    /** Marks behind the objects of the whole stream, where they are known. @type {ReturnType<typeof import("./marks.js").findMarks>} */
    this._marks = [];
    this._inUserData = false; // whether user data stand at `_end`
    this._inHeaders = false; // whether headers of a sequence have begun, and no object in it
    /** @type {BapSteps | null} */
    this._before = null; // the table that user data in those headers name
    this._count = 0;
    /** Of the last object. @type {BapSteps} */
    this._table = "iso";
    this._hasBody = false;
    /** Last byte of the start code that ended the last object. @type {number | null} */
    this._endCode = null;
    this._begin = 0;
    /** Byte behind that code, or behind user data that follow it. */
    this._end = 0;
    /** The table that its marks name. @type {BapSteps | null} */
    this._mark = null;
    /** What the mark behind it lists. @type {Uint32Array | null} */
    this._checks = null;
  }

  /** @param {number} byte of the stream */
  _beginObject(byte) {
    const behind = this._marks.find((mark) => mark.begin <= byte && byte < mark.end)?.table;
    this._table = this._bapSteps ?? this._before ?? behind ?? "iso";
    this._count += 1;
    this._hasBody = this._inHeaders = false;
    this._begin = byte;
    this._mark = this._before;
    this._endCode = this._before = this._checks = null;
  }

  /** End the object at a start code; return warnings. @param {number} code @param {number} byte behind it */
  _endObject(code, byte) {
    this._endCode = code;
    this._end = byte;
    this._inUserData = false;
    this._inHeaders = code === SEQUENCE;
    return this._difference();
  }

  /**
   * Take a start code outside of an object, and read the mark if it begins one; return warnings.
   * @param {number} code @param {number} byte of the stream, at which the start code stands @param {Uint8Array} content behind it
   * @returns {string[]}
   */
  _takeCode(code, byte, content) {
    const directly = byte === this._end && this._count > 0;
    if (this._inUserData) this._end = byte;
    this._inUserData = code === USER_DATA && this._count > 0 && byte === this._end;
    if (code === SEQUENCE) {
      this._inHeaders = true;
      this._before = null;
    }
    const mark = code === USER_DATA && (directly || this._inHeaders) ? readMark(content) : null;
    if (!mark) return [];
    const { table, checks, problems } = mark;
    if (!directly) {
      if (this._before && table && table !== this._before) {
        problems.push(`the mark names other BAP steps, ${table}, than one before it, ${this._before}`);
      }
      this._before ??= table;
      return problems;
    }
    if (this._endCode !== END) return ["the end code before the mark is damaged: mark not used"];
    this._checks = checks;
    if (!table || table === this._mark) return problems;
    this._mark = table;
    return [...problems, ...this._difference()];
  }

  /** Return a warning where the object was decoded with another table than that of its mark. */
  _difference() {
    if (!this._mark || this._mark === this._table || !this._hasBody) return [];
    return [`the mark names the BAP steps ${this._mark}; decoded with ${this._table}`];
  }
}
