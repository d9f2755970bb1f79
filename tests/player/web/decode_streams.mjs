/**
 * Print what the decoder finds in each stream of a file, a line of JSON each:
 * node decode_streams.mjs FILE LONGEST_BYTEWISE [MODULE].
 */
import { createHash } from "node:crypto";
import { readFileSync } from "node:fs";

const { Decoder, FbaError, decode } = await import(process.argv[4] ?? "../../../player/fba_player/web/fba.js");
const all = readFileSync(process.argv[2]);
for (let at = 0; at < all.length; ) {
  const size = all.readUInt32BE(at);
  const stream = new Uint8Array(all.subarray(at + 4, at + 4 + size));
  at += 4 + size;
  const found = { strict: outcome(stream, false), salvaged: outcome(stream, true), bytewise: bytewise(stream) };
  process.stdout.write(`${JSON.stringify(found)}\n`);
}

function outcome(stream, salvage) {
  try {
    const animation = decode(stream, { salvage });
    const frames = Array.from({ length: animation.length }, (_, frame) => animation.frame(frame));
    return {
      rate: String(animation.rate),
      index: [...animation.index],
      values: digest(frames),
      mark: animation.mark,
      damage: animation.damage.map(({ error, start, stop, framesLost, uncertainty, doubtful }) => [
        start, stop, framesLost, uncertainty, doubtful, place(error),
      ]),
    };
  } catch (error) {
    if (!(error instanceof FbaError)) throw error;
    return { error: place(error) };
  }
}

/** Frames of a stream that comes byte by byte, and the error that ends it. */
function bytewise(stream) {
  if (stream.length > Number(process.argv[3])) return null;
  const decoder = new Decoder();
  const frames = [];
  try {
    for (let at = 0; at < stream.length; at += 1) frames.push(...decoder.push(stream.subarray(at, at + 1)));
    frames.push(...decoder.finish());
  } catch (error) {
    if (!(error instanceof FbaError)) throw error;
    return { frames: frames.length, values: digest(frames), error: place(error) };
  }
  return { frames: frames.length, values: digest(frames), error: null };
}

function place({ plane, bit, finding }) {
  return finding ? [plane ?? null, bit ?? null] : "no finding";
}

function digest(frames) {
  const hash = createHash("sha256");
  for (const { face, body } of frames) {
    const numbers = new Int32Array(3 * 68 + 10 + 2 * 296);
    if (face) {
      for (const [place, part] of [[0, face.values], [68, face.mask], [136, face.interpolated], [204, face.viseme], [208, face.expression]]) {
        numbers.set(part, place);
      }
    }
    if (body) {
      numbers.set(body.values, 214);
      numbers.set(body.mask, 510);
    }
    hash.update(new Uint8Array(numbers.buffer));
  }
  return hash.digest("hex");
}
