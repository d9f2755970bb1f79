/**
 * Write what a figure shows of streams: node show_streams.mjs REQUEST. The request names the figure's file, and for each stream
 * its file, frames, and a file for the results: for each frame 68 FAPs, the positions without the neck's bend of a head (of a
 * person: the joints' matrices), then the positions and normals of all parts, as 64-bit numbers.
 */
import { readFileSync, writeFileSync } from "node:fs";
import { decode } from "../../../player/fba_player/web/fba.js";
import { Figure } from "../../../player/fba_player/web/figure/figure.js";
import { Timeline } from "../../../player/fba_player/web/figure/timeline.js";

const request = JSON.parse(readFileSync(process.argv[2], "utf8"));
const figure = new Figure(readFileSync(request.figure));
const faps = new Float32Array(68);
const baps = new Float64Array(296);
for (const { stream, frames, result } of request.streams) {
  const animation = decode(readFileSync(stream));
  const timeline = new Timeline(animation, figure.rules);
  const numbers = [];
  for (const frame of frames) {
    const time = animation.time(frame);
    timeline.faps(time, faps);
    figure.show(faps, figure.body ? timeline.baps(time, baps) : undefined);
    numbers.push(faps.slice(), figure.body ? figure.body.joints.slice() : rigid());
    for (const what of ["positions", "normals"]) for (const part of figure.parts) numbers.push(part[what].slice());
  }
  const joined = new Float64Array(numbers.reduce((sum, { length }) => sum + length, 0));
  let at = 0;
  for (const each of numbers) {
    joined.set(each, at);
    at += each.length;
  }
  writeFileSync(result, joined);
}

/** The positions of the face if all of it turns with the head. */
function rigid() {
  const positions = new Float32Array(figure.face.positions.length);
  figure.face.place(positions, new Float32Array(positions.length), { bend: false });
  return positions;
}
