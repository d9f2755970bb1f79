/** The borders of a stream's objects, the bytes around them, and their marks. */
import { END, SEQUENCE, USER_DATA, readMark } from "./marks.js";

/** @typedef {import("./slots.js").BapSteps} BapSteps */

export class ObjectBorders {
  /**
   * @param {BapSteps | null} bapSteps the table of all objects; null: the one that a mark names
   * @param {{table: BapSteps, begin: number, end: number}[]} marks behind the objects of the whole stream, where known
   */
  constructor(bapSteps, marks) {
    this._bapSteps = bapSteps;
    this._marks = marks;
    this._inUserData = false; // whether user data stand at `end`
    this._inHeaders = false; // whether headers of a sequence have begun, and no object in it
    /** @type {BapSteps | null} */
    this._before = null; // the table that user data in those headers name
    this.count = 0;
    /** Of the last object. @type {BapSteps} */
    this.table = bapSteps ?? "iso";
    this.hasBody = false;
    /** Last byte of the start code that ended the last object. @type {number | null} */
    this.endCode = null;
    this.begin = 0;
    /** Byte behind that code, or behind user data that follow it. */
    this.end = 0;
    /** The table that its marks name. @type {BapSteps | null} */
    this.mark = null;
    /** What the mark behind it lists. @type {Uint32Array | null} */
    this.checks = null;
  }

  /** Whether an end code closed the last object. */
  get ended() {
    return this.endCode === END;
  }

  get size() {
    return Math.max(this.end - this.begin, 0);
  }

  /** @param {number} byte of the stream */
  beginObject(byte) {
    const marked = this._marks.find((mark) => mark.begin <= byte && byte < mark.end)?.table;
    this.table = this._bapSteps ?? this._before ?? marked ?? "iso";
    this.count += 1;
    this.hasBody = false;
    this.endCode = null;
    this.begin = byte;
    this.mark = this._before;
    this._before = null;
    this.checks = null;
    this._inHeaders = false;
  }

  /** End the object at a start code; return warnings. @param {number} code @param {number} byte behind it */
  endObject(code, byte) {
    this.endCode = code;
    this.end = byte;
    this._inUserData = false;
    this._inHeaders = code === SEQUENCE;
    return this._difference("before its planes");
  }

  /**
   * Take a start code outside of an object, and read the mark if it begins one; return warnings.
   * @param {number} code @param {number} byte of the stream, at which the start code stands @param {Uint8Array} content behind it
   */
  readUserData(code, byte, content) {
    const directly = byte === this.end && this.count > 0;
    if (this._inUserData) this.end = byte;
    this._inUserData = code === USER_DATA && this.count > 0 && byte === this.end;
    if (code === SEQUENCE) {
      this._inHeaders = true;
      this._before = null;
    }
    if (code !== USER_DATA || !(directly || this._inHeaders)) return [];
    const mark = readMark(content);
    if (!mark) return [];
    const { table, checks, problems } = mark;
    if (!directly) {
      if (this._before === null || table === null || table === this._before) {
        this._before ??= table;
        return problems;
      }
      return [...problems, `the headers before the object name the BAP steps ${this._before}, and then ${table}`];
    }
    if (!this.ended) return ["a mark stands behind the object, but the end code before it is damaged; it was not used"];
    const before = this.mark;
    this.checks = checks;
    if (table === null || table === before) return problems;
    this.mark = table;
    return [...problems, ...this._difference("behind its end")];
  }

  /** @param {string} where */
  _difference(where) {
    if (this.mark === null || this.mark === this.table || !this.hasBody) return [];
    return [`the stream says ${where} that it was made with the BAP steps ${this.mark}; it was decoded with ${this.table}`];
  }

  /** Return how many bytes behind the last object are no user data. @param {number} length of the stream */
  unread(length) {
    return this._inUserData ? 0 : Math.max(length - this.end, 0);
  }
}
