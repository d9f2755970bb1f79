/** Print the influences of morph targets for the frames of a stream, and the turn of a head: node loader_weights.mjs STREAM RATE. */
import { readFileSync } from "node:fs";
import { FBALoader, FBAMixer } from "../../../player/fba_player/web/fba-loader.js";
import { SHAPES } from "../../../player/fba_player/web/loader/shapes.js";

/** As much of THREE.Quaternion as a mixer needs. */
class Quaternion {
  constructor(x = 0, y = 0, z = 0, w = 1) {
    Object.assign(this, { x, y, z, w });
  }
  clone() {
    return new Quaternion(this.x, this.y, this.z, this.w);
  }
  set(x, y, z, w) {
    return Object.assign(this, { x, y, z, w });
  }
  copy(other) {
    return Object.assign(this, other);
  }
  multiply({ x, y, z, w }) {
    const { x: a, y: b, z: c, w: d } = this;
    return this.set(a * w + d * x + b * z - c * y, b * w + d * y + c * x - a * z, c * w + d * z + a * y - b * x, d * w - a * x - b * y - c * z);
  }
}

const [stream, rate] = process.argv.slice(2);
const clip = new FBALoader().parse(readFileSync(stream));
const names = Object.keys(SHAPES);
const face = { morphTargetDictionary: Object.fromEntries(names.map((name, at) => [`head.${name}`, at])), morphTargetInfluences: names.map(() => 0) };
const head = { quaternion: new Quaternion() };
const mixer = new FBAMixer({ traverse: (visit) => [{}, face].forEach(visit) }, clip, { head });
const rows = [];
for (let frame = 0; frame / Number(rate) < clip.duration - 1e-9; frame += 1) {
  mixer.setTime(frame / Number(rate) + 1e-9);
  rows.push([...face.morphTargetInfluences, head.quaternion.x, head.quaternion.y, head.quaternion.z, head.quaternion.w]);
}
process.stdout.write(JSON.stringify({ names, rows }));
