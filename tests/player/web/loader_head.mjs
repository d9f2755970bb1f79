/**
 * Print how `FBAMixer` moves a head with FBA_face: node loader_head.mjs HEAD.glb < rows of 68 FAPs > for each row, for each node the
 * influences of its morph targets and its matrix. Objects are as GLTFLoader of three.js makes them.
 */
import { readFileSync } from "node:fs";
import { FBAMixer } from "../../../player/fba_player/web/fba-loader.js";

const bytes = readFileSync(process.argv[2]);
const json = JSON.parse(bytes.subarray(20, 20 + bytes.readUInt32LE(12)).toString());
const objects = json.nodes.map(({ mesh }) => {
  const names = json.meshes[mesh]?.extras?.targetNames ?? [];
  const object = { isObject3D: true, entries: [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1] };
  object.matrix = {
    fromArray: (entries) => ((object.entries = [...entries]), object.matrix),
    decompose: () => {},
  };
  if (names.length) Object.assign(object, { morphTargetDictionary: Object.fromEntries(names.map((name, at) => [name, at])), morphTargetInfluences: names.map(() => 0) });
  return object;
});
const parser = { json, associations: new Map(objects.map((object, nodes) => [object, { nodes }])) };
const rows = JSON.parse(readFileSync(0, "utf8"));
let row = 0;
const mixer = new FBAMixer({ scene: {}, parser }, { duration: 1, faps: () => Float32Array.from(rows[row]) });
const result = [];
for (; row < rows.length; row += 1) {
  mixer.setTime(0);
  result.push(objects.map(({ morphTargetInfluences: influences = [], entries }) => [[...influences], entries]));
}
process.stdout.write(JSON.stringify(result));
