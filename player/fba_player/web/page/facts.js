/** Facts about a stream: its planes, its rate, its size. */
import { Decoder, FbaError } from "../fba.js";
import { clockText } from "./controls.js";

const PIECE = 1 << 16;

/** Return the planes of a stream, without damaged ones. @param {import("./element.js").Source} source @returns {import("./lanes.js").Planes} */
export function planesOf({ bytes, bapSteps }) {
  const decoder = new Decoder(bapSteps ? { bapSteps, salvage: true } : { salvage: true });
  /** @type {[number, number, number][]} */
  const planes = [];
  const add = (/** @type {import("../decoder/frames.js").StreamFrame[]} */ frames) => {
    for (const { time, bits, intra } of frames) planes.push([time, bits, Number(intra)]);
  };
  try {
    for (let start = 0; start < bytes.length; start += PIECE) add(decoder.push(bytes.subarray(start, start + PIECE)));
    add(decoder.finish());
  } catch (error) {
    if (!(error instanceof FbaError)) throw error; // the planes before it are shown
  }
  return {
    times: Float64Array.from(planes, ([time]) => time),
    bits: Float64Array.from(planes, ([, bits]) => bits),
    intra: Uint8Array.from(planes, ([, , intra]) => intra),
  };
}

/** Return a heading and a list of facts. @param {import("./element.js").Source} source @param {import("./timeline.js").Timeline} timeline @param {import("./lanes.js").Planes} planes */
export function factsOf(source, timeline, planes) {
  const { frames } = timeline;
  const seconds = timeline.end - timeline.start;
  const intra = planes.intra.reduce((sum, one) => sum + one, 0);
  const parts = [frames.hasFace ? "face" : "", frames.hasBody ? "body" : ""].filter(Boolean).join(" and ");
  const rows = [
    ["shows", parts],
    ["frames", `${frames.length}, ${round(frames.framesPerSecond)} a second`],
    ["lasts", clockText(seconds)],
    ["size", `${source.bytes.length.toLocaleString("en")} bytes`],
    ["rate", `${round((8 * source.bytes.length) / Math.max(seconds, 1e-9) / 1000)} kbit/s`],
    ["planes", `${planes.bits.length}, of which ${intra} I planes`],
  ];
  const heading = Object.assign(document.createElement("h2"), { textContent: source.name });
  const list = document.createElement("dl");
  for (const [term, text] of rows) {
    list.append(Object.assign(document.createElement("dt"), { textContent: term }), Object.assign(document.createElement("dd"), { textContent: text }));
  }
  const link = document.createElement("a");
  link.textContent = "save the stream";
  link.download = source.name;
  link.href = URL.createObjectURL(new Blob([/** @type {BlobPart} */ (source.bytes)], { type: "application/octet-stream" }));
  return [heading, list, link];
}

/** @param {number} value */
function round(value) {
  return String(Math.round(value * 100) / 100);
}
