/** Reads the planes of an object, an I plane or a run of P planes at a time, and keeps the state between them. */
import { Models, OK, OUT_OF_DATA, SLOTS, readBit } from "./coder.js";
import { BitReader, FAULTS, Fault, NO_START_CODE, OutOfData, UNDECIDED, findStartCode, readIntraHeader, readPart, readSkip } from "./header.js";
import { BODY, FACE, FLAGS, Layout, amountLimit, bounds, defaultLimits, label, scaleOf, slotsOf, stepOf, takeRanges, undefinedBap } from "./slots.js";

const RUN = 512; // P planes that are decoded at once, at most
const INTRA = 4; // why a run of P planes ended, besides the faults
const MISSING_PART = 5;
const START_CODE = 6;
const BAD_MASK = 7;
const OUT_OF_RANGE = 9;

/**
 * An I plane, or P planes behind it. rows: count rows with the values of the slots `columns`. parts: fba_object_mask of
 * each. borders: first bit of each, and the bit behind the last. doubtful: they depend on ranges that may have been
 * replaced in a lost plane. complete: false where the plane behind them needs more data.
 * @typedef {{
 *   intra: boolean, header: import("./header.js").Header | null, face: import("./header.js").Part | null,
 *   body: import("./header.js").Part | null, columns: Int32Array, rows: Int32Array, parts: Uint8Array,
 *   skips: Float64Array, borders: Float64Array, doubtful: boolean, complete: boolean,
 * }} Planes
 */

export class PlaneReader {
  constructor() {
    this._models = new Models();
    this._models.makeRoom(FLAGS);
    this._minimum = [new Int32Array(SLOTS), new Int32Array(SLOTS)]; // smallest levels in P planes, in I planes
    this._step = new Int32Array(SLOTS).fill(1);
    this._last = new Int32Array(SLOTS);
    this._lowest = new Int32Array(SLOTS);
    this._highest = new Int32Array(SLOTS);
    for (let slot = 0; slot < SLOTS; slot += 1) [this._lowest[slot], this._highest[slot]] = bounds(slot);
    this._symbols = new Int32Array(SLOTS);
    this._values = new Int32Array(SLOTS);
    this._flags = new Int32Array(3);
    /** Bit or slot of the last fault. */
    this._place = 0;
    /** @type {import("./slots.js").BapSteps} */
    this._table = "iso";
    this._limits = defaultLimits();
    this._doubtfulRanges = 0; // parts whose ranges may have been replaced in a lost plane
    /** @type {Record<number, import("./header.js").Part>} */
    this._settings = {};
    /** @type {ReturnType<typeof prepareRun> | null} */
    this._run = null;
  }

  /** Reset all state. @param {import("./slots.js").BapSteps} table of the BAP steps in this object */
  beginObject(table) {
    this._table = table;
    this._limits = defaultLimits();
    this.forgetValues();
    this._doubtfulRanges = 0;
  }

  /** Reset settings behind damage: P planes are errors up to the next I plane. Ranges stay, as the best guess. */
  forgetValues() {
    this._settings = {};
    this._run = null;
    this._doubtfulRanges = FACE | BODY;
  }

  /**
   * Return the plane at a bit and the P planes that follow it. Throws OutOfData and Fault.
   * @param {Uint8Array} data @param {number} bit @param {number} end @param {boolean} afterCode whether a start code ends here
   * @returns {Planes}
   */
  read(data, bit, end, afterCode) {
    if (bit >= end) throw new OutOfData();
    return readBit(data, bit) ? this._readIntra(data, bit, end) : this._readPredicted(data, bit, end, afterCode);
  }

  /** @param {Uint8Array} data @param {number} start @param {number} end @returns {Planes} */
  _readIntra(data, start, end) {
    const reader = new BitReader(data, start + 1, end);
    const header = readIntraHeader(reader);
    const flags = [0, 0, 0];
    /** @type {Record<number, import("./header.js").Part>} */
    const settings = {};
    /** @type {number[]} */
    const columns = [];
    /** @type {number[]} */
    const row = [];
    for (const part of [FACE, BODY]) {
      if (!(header.mask & part)) continue;
      settings[part] = this._readPart(reader, part);
      const { mask } = settings[part];
      const layout = part === FACE ? new Layout(mask, null) : new Layout(null, mask);
      const status = this._decodeValues(data, reader.bit, end, layout, false);
      this._check(status, reader.bit);
      reader.bit = this._place;
      columns.push(...layout.order);
      row.push(...this._values.subarray(0, layout.order.length));
      if (part === FACE) flags.splice(0, 3, ...this._flags);
    }
    columns.forEach((slot, position) => (this._last[slot] = row[position]));
    if (settings[FACE]?.mask[0] || settings[FACE]?.mask[1]) {
      columns.push(FLAGS, FLAGS + 1, FLAGS + 2);
      row.push(...flags);
    }
    Object.assign(this._settings, settings);
    this._run = null;
    return {
      intra: true, header, face: settings[FACE] ?? null, body: settings[BODY] ?? null,
      columns: Int32Array.from(columns), rows: Int32Array.from(row), parts: Uint8Array.of(header.mask),
      skips: Float64Array.of(header.skip), borders: Float64Array.of(start, reader.bit),
      doubtful: (header.mask & this._doubtfulRanges) !== 0, complete: true,
    };
  }

  /** Read the header of a part of an I plane, and apply it. @param {BitReader} reader @param {number} part */
  _readPart(reader, part) {
    const settings = readPart(reader, part);
    if (settings.ranges.every((codes) => codes)) this._doubtfulRanges &= ~part;
    takeRanges(this._limits, part, settings);
    const [first, stop] = slotsOf(part);
    const scale = scaleOf(part, settings.quant);
    this._models.makeRoom(stop);
    for (let slot = first; slot < stop; slot += 1) {
      let [iMax, iMin, pMax, pMin] = this._limits.map((list) => Math.floor(Math.max(list[slot], 0) / scale));
      if (slot < 7) {
        iMax = pMax = pMin = amountLimit(slot, settings.quant);
        iMin = 0;
      }
      this._minimum[0][slot] = -pMin;
      this._minimum[1][slot] = -iMin;
      this._step[slot] = stepOf(slot, settings.quant, this._table);
      this._models.begin(slot, iMax + iMin + 1, pMax + pMin + 1, pMin);
    }
    const bap = part === BODY ? undefinedBap(this._limits, settings.mask) : 0;
    if (bap) throw new Fault(`BAP ${bap} is sent, but no range for it: extension BAPs have no default`, reader.bit);
    return settings;
  }

  /**
   * Decode the segments of a plane into `_symbols`, `_values` and `_flags`; return the status. Models do not change.
   * @param {Uint8Array} data @param {number} bit @param {number} end @param {Layout} layout @param {boolean} adaptive
   */
  _decodeValues(data, bit, end, layout, adaptive) {
    const { order, segments } = layout;
    const minimum = this._minimum[adaptive ? 0 : 1];
    this._flags.fill(0);
    for (const [first, stop, flags] of segments) {
      const status = this._models.decodeSegment(data, bit, end, order, first, stop, adaptive, this._symbols);
      bit = this._models.place;
      this._place = bit;
      if (status !== OK) return status;
      if (bit + flags > end) return OUT_OF_DATA;
      for (let flag = 0; flag < flags; flag += 1) this._flags[flags - 1 + flag] = readBit(data, bit + flag);
      bit += flags;
    }
    for (let position = 0; position < order.length; position += 1) {
      const slot = order[position];
      const value = (this._symbols[position] + minimum[slot]) * this._step[slot] + (adaptive ? this._last[slot] : 0);
      if (value < this._lowest[slot] || value > this._highest[slot]) {
        this._place = slot;
        return OUT_OF_RANGE;
      }
      this._values[position] = value;
    }
    this._place = bit;
    return OK;
  }

  /** @param {Uint8Array} data @param {number} bit @param {number} end @param {boolean} afterCode @returns {Planes} */
  _readPredicted(data, bit, end, afterCode) {
    const [faceSettings, bodySettings] = [this._settings[FACE] ?? null, this._settings[BODY] ?? null];
    this._run ??= prepareRun(faceSettings?.mask ?? null, bodySettings?.mask ?? null);
    const { face, body, both, columns, rows } = this._run;
    const available = (faceSettings ? FACE : 0) | (bodySettings ? BODY : 0);
    const [parts, skips, borders] = [new Uint8Array(RUN), new Float64Array(RUN), new Float64Array(RUN + 1)];
    const width = both.order.length;
    let [count, carried, status, mask] = [0, 0, OK, 0];
    borders[0] = bit;
    for (; count < RUN; count += 1) {
      const start = borders[count];
      const [code] = findStartCode(data, start, end, afterCode && count === 0);
      let skip = 0;
      [status, mask, skip] = code === NO_START_CODE
        ? this._readHeader(data, start, end, available)
        : [code === UNDECIDED ? OUT_OF_DATA : START_CODE, 0, 0];
      if (status !== OK) break;
      const layout = mask === FACE ? face : mask === BODY ? body : both;
      status = this._decodeValues(data, this._place, end, layout, true);
      if (status !== OK) break;
      const { order } = layout;
      this._models.learn(order, 0, order.length, this._symbols);
      const row = count * columns.length;
      if (order.length < width) rows.fill(0, row, row + columns.length);
      const first = row + (mask === BODY ? face.order.length : 0);
      for (let position = 0; position < order.length; position += 1) {
        this._last[order[position]] = rows[first + position] = this._values[position];
      }
      for (let flag = width; flag < columns.length; flag += 1) rows[row + flag] = this._flags[flag - width];
      parts[count] = mask;
      skips[count] = skip;
      carried |= mask;
      borders[count + 1] = this._place;
    }
    if (!count) {
      if (status === MISSING_PART) {
        const name = mask & ~available & FACE ? "FAPs" : "BAPs";
        throw new Fault(`a P plane carries ${name}, but no I plane with ${name} came before it in this object`, bit);
      }
      this._check(status, bit);
    }
    return {
      intra: false, header: null, face: carried & FACE ? faceSettings : null, body: carried & BODY ? bodySettings : null,
      columns, rows: rows.slice(0, count * columns.length), parts: parts.slice(0, count), skips: skips.slice(0, count),
      borders: borders.slice(0, count + 1), doubtful: (carried & this._doubtfulRanges) !== 0,
      complete: status !== OUT_OF_DATA,
    };
  }

  /**
   * Read the header of a P plane; return [status, fba_object_mask, skip], and leave the bit behind it in `_place`.
   * @param {Uint8Array} data @param {number} bit @param {number} end @param {number} available
   */
  _readHeader(data, bit, end, available) {
    this._place = bit;
    if (bit + 3 > end) return [OUT_OF_DATA, 0, 0];
    if (readBit(data, bit)) return [INTRA, 0, 0];
    const mask = 2 * readBit(data, bit + 1) + readBit(data, bit + 2);
    this._place = bit + 1;
    if (!mask) return [BAD_MASK, 0, 0];
    if ((mask & available) !== mask) return [MISSING_PART, mask, 0];
    if (bit + 4 > end) return [OUT_OF_DATA, mask, 0];
    this._place = bit + 4;
    if (!readBit(data, bit + 3)) return [OK, mask, 0];
    const [status, skip, place] = readSkip(data, bit + 4, end);
    this._place = place;
    return [status, mask, skip];
  }

  /** Throw for a status. @param {number} status @param {number} start bit of the segments or of the plane */
  _check(status, start) {
    if (status === OUT_OF_DATA) throw new OutOfData();
    if (status === OUT_OF_RANGE) {
      const [low, high] = [this._lowest[this._place], this._highest[this._place]];
      const finding = `${label(this._place)} gets a value outside ${low}..${high}; the stream is damaged here or before`;
      throw new Fault(finding, start);
    }
    if (status in FAULTS) throw new Fault(FAULTS[status], this._place);
  }
}

/** Return layouts and rows of P planes with these masks. @param {Uint8Array | null} face @param {Uint8Array | null} body */
function prepareRun(face, body) {
  const both = new Layout(face, body);
  const columns = [...both.order];
  if (face?.[0] || face?.[1]) columns.push(FLAGS, FLAGS + 1, FLAGS + 2);
  return {
    face: new Layout(face, null), body: new Layout(null, body), both,
    columns: Int32Array.from(columns), rows: new Int32Array(RUN * columns.length),
  };
}
