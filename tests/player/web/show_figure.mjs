/**
 * Write what figures show: node show_figure.mjs REQUEST. A request names a figure's file and streams, each with frames and a
 * file for the results: for each frame 68 FAPs, the positions without the neck's bend of a head (of a person: the matrices of
 * its joints), then the positions and normals of all parts, and the light on them, as 64-bit numbers. Or it names a figure's file and holds faces:
 * the result is the FAPs that are shown. Or it names damaged figures: the result is their messages, "" for those that can
 * be shown.
 */
import { readFileSync, writeFileSync } from "node:fs";
import { FbaError, decode } from "../../../player/fba_player/web/fba.js";
import { Figure } from "../../../player/fba_player/web/figure/figure.js";
import { isGlb } from "../../../player/fba_player/web/figure/glb.js";
import { readHead } from "../../../player/fba_player/web/figure/glb_face.js";
import { Resolver } from "../../../player/fba_player/web/figure/resolve.js";
import { Timeline, framesOf } from "../../../player/fba_player/web/page/timeline.js";

const request = JSON.parse(readFileSync(process.argv[2], "utf8"));
if (request.damaged) {
  writeFileSync(request.result, JSON.stringify(await Promise.all(request.damaged.map(message))));
} else {
  const figure = await read(request.figure);
  if (request.faces) {
    const resolver = new Resolver(figure.rules);
    const rows = request.faces.map((face) => {
      const arrays = { values: Int32Array.from(face.values), mask: Uint8Array.from(face.mask), interpolated: Uint8Array.from(face.interpolated) };
      const row = new Float32Array(68);
      resolver.push({ ...face, ...arrays }, row);
      return row;
    });
    write(request.result, rows);
  }
  for (const { stream, frames, result } of request.streams ?? []) write(result, shown(figure, decode(readFileSync(stream)), frames));
}

function shown(figure, animation, frames) {
  const timeline = new Timeline(framesOf(animation), new Resolver(figure.rules));
  const faps = new Float32Array(68);
  const baps = new Float64Array(296);
  return frames.flatMap((frame) => {
    const time = animation.time(frame);
    timeline.at(time, faps, baps);
    figure.show(faps, figure.body ? baps : undefined);
    const parts = ["positions", "normals"].flatMap((what) => figure.parts.map((part) => part[what].slice()));
    return [faps.slice(), figure.body ? figure.body.joints.slice() : rigid(figure.face), ...parts, ...figure.meshes.map(({ light }) => light.slice())];
  });
}

/** The positions of a face if all of it turns with the head. */
function rigid(face) {
  const positions = new Float32Array(face.positions.length);
  face.place(positions, new Float32Array(positions.length), { bend: false });
  return positions;
}

function write(file, arrays) {
  const joined = new Float64Array(arrays.reduce((sum, { length }) => sum + length, 0));
  let at = 0;
  for (const each of arrays) {
    joined.set(each, at);
    at += each.length;
  }
  writeFileSync(file, joined);
}

/** A packed figure, or a head as .glb. */
async function read(file) {
  const bytes = new Uint8Array(readFileSync(file));
  return new Figure(isGlb(bytes) ? await readHead(bytes) : bytes);
}

async function message(file) {
  try {
    const figure = await read(file);
    figure.show(new Float64Array(68).fill(100), new Float64Array(296).fill(1000));
    return "";
  } catch (error) {
    if (!(error instanceof FbaError)) throw error;
    return error.message;
  }
}
