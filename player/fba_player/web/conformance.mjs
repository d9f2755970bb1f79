/** Decode a stream to the text of values that `fba conformance` compares: node conformance.mjs IN OUT [iso|visage]. */
import { readFileSync, writeFileSync } from "node:fs";
import { Decoder, FbaError, decode } from "./fba.js";

const [input, output, named] = process.argv.slice(2);
const data = readFileSync(input);
const lines = ["fba-values 1"];
const bapSteps = /** @type {"iso" | "visage" | undefined} */ (named) ?? marked();
const decoder = new Decoder({ bapSteps });
let status = 0;
try {
  for (const frame of decoder.push(data)) addPlane(frame);
  for (const frame of decoder.finish()) addPlane(frame);
} catch (error) {
  if (!(error instanceof FbaError)) throw error;
  lines.push(`error ${error.message}`);
  process.stderr.write(`${error.message}\n`);
  status = 1;
}
writeFileSync(output, [...lines, "end", ""].join("\n"));
process.exitCode = status;

/** Return the table of BAP steps that the stream names, which may stand behind its end. */
function marked() {
  try {
    return decode(data, { salvage: true }).mark ?? undefined;
  } catch {
    return undefined;
  }
}

/** @param {import("./decoder/frames.js").StreamFrame} frame */
function addPlane({ time, face, body }) {
  lines.push("plane", `time ${time.toFixed(9)}`);
  if (face?.mask[0]) lines.push(`viseme ${face.viseme.join(" ")}`);
  if (face?.mask[1]) lines.push(`expression ${face.expression.join(" ")}`);
  face?.values.forEach((value, fap) => {
    if (fap > 1 && face.mask[fap]) lines.push(`fap ${fap + 1} ${value}`);
  });
  body?.values.forEach((value, bap) => {
    if (body.mask[bap]) lines.push(`bap ${bap + 1} ${value}`);
  });
}
