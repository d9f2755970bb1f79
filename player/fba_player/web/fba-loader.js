/**
 * For three.js: moves the user's own head by a stream. Needs no particular version of three.js, and imports none.
 *
 *     const clip = await new FBALoader().loadAsync("hello.fba");
 *     const mixer = new FBAMixer(gltf.scene, clip);       // a head with morph targets named as ARKit's shapes
 *     renderer.setAnimationLoop((time) => { mixer.setTime(time / 1000); renderer.render(scene, camera); });
 */
import { decode } from "./fba.js";
import { ShapeWeights } from "./loader/weights.js";
import { Resolver, Rules } from "./figure/resolve.js";
import { DEFINITIONS } from "./loader/definitions.js";
import { Timeline, framesOf } from "./page/timeline.js";

/** Radians in a unit of a FAP that is an angle. */
const RADIAN = 1e-5;
const [PITCH, YAW, ROLL] = [47, 48, 49]; // columns of the FAPs of the head

/** A decoded stream: FAPs at any time. */
export class FBAClip {
  /** @param {import("./decoder/animation.js").Animation} animation */
  constructor(animation) {
    this._timeline = new Timeline(framesOf(animation), new Resolver(new Rules({ definitions: DEFINITIONS, fit: [] })));
    this.start = this._timeline.start;
    /** Seconds. */
    this.duration = this._timeline.end - this._timeline.start;
    this._faps = new Float32Array(68);
    this._baps = new Float64Array(296);
  }

  /** Return FAPs 1 to 68 as a face shows them, in the standard's units. @param {number} time seconds from the first frame */
  faps(time) {
    this._timeline.at(time + this.start, this._faps, this._baps);
    return this._faps;
  }
}

/** Loads streams. */
export class FBALoader {
  /** Return the clip in the bytes of a stream. Throws FbaError. @param {Uint8Array | ArrayBuffer} data @param {import("./decoder/stream.js").Options} [options] */
  parse(data, options) {
    return new FBAClip(decode(data, options));
  }

  /** @param {string} url @param {import("./decoder/stream.js").Options} [options] */
  async loadAsync(url, options) {
    const answer = await fetch(url);
    if (!answer.ok) throw new Error(`${url}: ${answer.status} ${answer.statusText}`);
    return this.parse(await answer.arrayBuffer(), options);
  }
}

/**
 * A mesh of three.js that has morph targets, or an object with such below it.
 * @typedef {{
 *   traverse(visit: (object: any) => void): void, getObjectByName?(name: string): any,
 * }} Object3D
 */

/** Moves the morph targets of an object, and its head where it is told which object that is. */
export class FBAMixer {
  /** @param {Object3D} root @param {FBAClip} clip @param {{head?: any}} [options] head: an object of three.js that nods */
  constructor(root, clip, { head = null } = {}) {
    this.clip = clip;
    this.loop = true;
    /** @type {{influences: number[], places: number[]}[]} */
    this._targets = [];
    /** @type {Set<string>} */
    const names = new Set();
    /** @type {any[]} */
    const meshes = [];
    root.traverse((object) => {
      if (!object.morphTargetDictionary || !object.morphTargetInfluences) return;
      meshes.push(object);
      for (const name of Object.keys(object.morphTargetDictionary)) names.add(bare(name));
    });
    this._weights = new ShapeWeights([...names]);
    if (!this._weights.names.length) throw new Error("the object has no morph targets named as ARKit's shapes, such as jawOpen");
    for (const { morphTargetDictionary, morphTargetInfluences } of meshes) {
      const place = Object.fromEntries(Object.entries(morphTargetDictionary).map(([name, at]) => [bare(name), at]));
      this._targets.push({ influences: morphTargetInfluences, places: this._weights.names.map((name) => place[name] ?? -1) });
    }
    this._head = head;
    this._rest = head?.quaternion.clone();
  }

  /** Show a time. @param {number} seconds from the first frame */
  setTime(seconds) {
    const { duration } = this.clip;
    const faps = this.clip.faps(this.loop && duration > 0 ? seconds % duration : Math.min(seconds, duration));
    const weights = this._weights.of(faps);
    for (const { influences, places } of this._targets) {
      places.forEach((place, k) => {
        if (place >= 0) influences[place] = weights[k];
      });
    }
    if (!this._head) return;
    const turn = this._rest.clone();
    for (const [fap, x, y, z] of [[YAW, 0, 1, 0], [ROLL, 0, 0, 1], [PITCH, 1, 0, 0]]) {
      const half = (faps[fap] * RADIAN) / 2;
      const sine = Math.sin(half);
      turn.multiply(turn.clone().set(x * sine, y * sine, z * sine, Math.cos(half)));
    }
    this._head.quaternion.copy(turn);
  }
}

/** Return the name of a shape without what programs put before it, as in "blendShape1.jawOpen". @param {string} name */
function bare(name) {
  return name.slice(name.lastIndexOf(".") + 1).replace(/_([LR])$/, (_, side) => (side === "L" ? "Left" : "Right"));
}
