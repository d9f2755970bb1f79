/**
 * For three.js: moves the user's own head by a stream. Needs no particular version of three.js, and imports none.
 *
 *     const clip = await new FBALoader().loadAsync("hello.fba");
 *     const mixer = new FBAMixer(gltf.scene, clip);       // a head with morph targets named as ARKit's shapes
 *     renderer.setAnimationLoop((time) => { mixer.setTime(time / 1000); renderer.render(scene, camera); });
 */
import { decode } from "./fba.js";
import { ShapeWeights, arkitNames } from "./loader/weights.js";
import { Resolver, Rules } from "./figure/resolve.js";
import { composeTurns } from "./figure/face.js";
import { measure, pointsOf, turnsOf } from "./figure/fba_face.js";
import { DEFINITIONS } from "./loader/definitions.js";
import { FAP_NAMES } from "./page/names.js";
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
 *
 * What GLTFLoader returns. @typedef {{scene: Object3D, parser: {json: any, associations: Map<any, {nodes?: number}>}}} Gltf
 */

/**
 * Moves the morph targets of a head. Give it what GLTFLoader returned, or an object of a scene: its heads with this project's
 * FBA_face move as that says, others by shapes named as ARKit's.
 */
export class FBAMixer {
  /** @param {Gltf | Object3D} root @param {FBAClip} clip @param {{head?: any}} [options] head: an object of three.js that nods, if the file does not say */
  constructor(root, clip, { head = null } = {}) {
    this.clip = clip;
    this.loop = true;
    const gltf = "scene" in root ? root : null;
    const described = gltf?.parser.json.extensions?.FBA_face;
    this._mover = described ? new DescribedHead(gltf, described) : new ShapedHead(gltf?.scene ?? /** @type {Object3D} */ (root), head);
  }

  /** Show a time. @param {number} seconds from the first frame */
  setTime(seconds) {
    const { duration } = this.clip;
    this._mover.show(this.clip.faps(this.loop && duration > 0 ? seconds % duration : Math.min(seconds, duration)));
  }
}

/** A head with shapes named as ARKit's, and perhaps an object that turns. */
class ShapedHead {
  /** @param {Object3D} root @param {any} head */
  constructor(root, head) {
    /** @type {any[]} */
    const meshes = [];
    root.traverse((object) => object.morphTargetDictionary && object.morphTargetInfluences && meshes.push(object));
    const named = meshes.map(({ morphTargetDictionary }) => arkitNames(Object.keys(morphTargetDictionary)));
    this._weights = new ShapeWeights([...new Set(named.flat().map(String))]);
    if (!this._weights.names.length) throw new Error("the object has no morph targets named as ARKit's shapes, such as jawOpen, and no FBA_face");
    this._targets = meshes.map(({ morphTargetDictionary, morphTargetInfluences }, k) => {
      const places = Object.values(morphTargetDictionary);
      return { influences: morphTargetInfluences, places: this._weights.names.map((name) => places[named[k].indexOf(name)] ?? -1) };
    });
    this._head = head;
    this._rest = head?.quaternion.clone();
  }

  /** @param {Float32Array} faps */
  show(faps) {
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

/**
 * A head with FBA_face: its morph targets are FAPs, each as it is at one value, so motion between is straight; parts that FAPs
 * turn, such as eyeballs, turn, and so does the whole.
 */
class DescribedHead {
  /** @param {Gltf} gltf @param {Record<string, any>} face */
  constructor({ parser }, face) {
    const { json, associations } = parser;
    const units = measure(pointsOf(face));
    const turns = turnsOf(face, units, 1);
    const objectOf = new Map([...associations].flatMap(([object, { nodes }]) => (nodes === undefined || !object.isObject3D ? [] : [[nodes, object]])));
    const parts = face.parts.map((/** @type {any} */ { node }) => objectOf.get(node));
    const top = objectOf.get(json.nodes.findIndex((/** @type {any} */ { children = [] }) => children.includes(face.parts[0].node)));
    /** Objects that turn, and by what. */
    this._turned = [...parts, top].map((object, part) => ({ object, turns: turns.filter((turn) => (turn.part ?? parts.length) === part) })).filter(({ object, turns }) => object && turns.length);
    this._targets = parts.flatMap((/** @type {any} */ object, /** @type {number} */ part) => {
      if (!object?.morphTargetInfluences) return [];
      const places = Object.entries(object.morphTargetDictionary).flatMap(([name, place]) => {
        const column = FAP_NAMES.indexOf(name);
        const moves = face.tables?.some((/** @type {any} */ { fap, meshes = [] }) => fap === name && meshes.some((/** @type {any} */ mesh) => mesh.part === part));
        return moves && face.morphValues?.[name] ? [{ place, column, value: face.morphValues[name] }] : [];
      });
      return [{ influences: object.morphTargetInfluences, places }];
    });
    this._matrix = new Float64Array(16);
  }

  /** @param {Float32Array} faps */
  show(faps) {
    for (const { influences, places } of this._targets) for (const { place, column, value } of places) influences[place] = faps[column] / value;
    for (const { object, turns } of this._turned) {
      composeTurns(turns, faps, this._matrix);
      object.matrix.fromArray(this._matrix).decompose(object.position, object.quaternion, object.scale);
    }
  }
}
