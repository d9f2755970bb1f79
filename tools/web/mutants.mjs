/**
 * Feed mutated streams to the decoder in JavaScript: node tools/web/mutants.mjs [COUNT [SEED [FIRST]]].
 *
 * Each must give frames or an FbaError, with salvage and without, whole and in pieces, in time and memory that the size
 * of the stream bounds. A failure prints the number of its mutant: `mutants.mjs 1 SEED NUMBER` makes it again.
 */
import { readFileSync, readdirSync } from "node:fs";
import { argv, cpuUsage, stderr, stdout } from "node:process";
import { fileURLToPath } from "node:url";
import { Decoder, FbaError, decode } from "../../player/fba_player/web/fba.js";

const VECTORS = new URL("../../conformance/fba_conformance/vectors/", import.meta.url);
const WORDS = [
  [0, 0, 1, 0xba], [0, 0, 1, 0xbb], [0, 0, 1, 0xb1], [0, 0, 1, 0xb0], [0, 0, 1, 0xb2], [0, 0, 1, 0xbb, 0x80], [0, 0, 1], [0x7f],
  [...Buffer.from("\0\0\x01\xb2fba bap_steps=visage;crc32=2;", "latin1")], [...Buffer.from("crc32=9;")],
];
const NUMBERS = [0, 1, 2, 0x7f, 0x80, 0xff, 0x7fff, 0xffff, 0x7fffffff, 0x80000000, 0xfffffffe, 0xffffffff];
const MOST_BYTES = 60_000;
const SMALL = 4000; // bytes of a stream up to which all its mutants are also read in pieces
const MOST_MS = 2000; // processor time of a mutant, with 1 ms more for each of these bytes
const BYTES_A_MS = 20;
const MOST_HEAP = 1 << 30;

/** Return the streams of all vectors, in the order of their names. */
export function vectorStreams() {
  const names = readdirSync(VECTORS, { recursive: true }).map(String).filter((name) => name.endsWith(".fba"));
  return names.sort().map((name) => new Uint8Array(readFileSync(new URL(name, VECTORS))));
}

/** Return a generator of whole numbers below a limit (mulberry32). @param {number} seed */
function randomBelow(seed) {
  let state = seed >>> 0;
  return (/** @type {number} */ limit) => {
    state = (state + 0x6d2b79f5) >>> 0;
    let mixed = Math.imul(state ^ (state >>> 15), state | 1);
    mixed ^= mixed + Math.imul(mixed ^ (mixed >>> 7), mixed | 61);
    return Math.floor((((mixed ^ (mixed >>> 14)) >>> 0) / 2 ** 32) * limit);
  };
}

/** Return a stream with one to four mutations, which the seed and the number determine. */
export function mutant(/** @type {Uint8Array[]} */ streams, /** @type {number} */ seed, /** @type {number} */ number) {
  const below = randomBelow(Math.imul(seed, 0x9e3779b1) + number);
  const pick = (/** @type {any[]} */ choices) => choices[below(choices.length)];
  const [one, other] = [pick(streams), pick(streams)];
  let data = [...(one.length < other.length ? one : other)]; // long ones take their time
  const most = Math.max(MOST_BYTES, data.length);
  const place = () => below(data.length + 1);
  const mutations = [
    () => flip(), () => flip(), () => flip(),
    () => { data[below(data.length)] = pick([0, 255, 127, 128, 1, below(256)]); },
    () => data.splice(place(), 0, ...Array(pick([1, 1, 2, 3, 40])).fill(pick([0, 255, below(256)]))),
    () => data.splice(place(), pick([1, 1, 2, 5, 30])),
    () => {
      const start = place();
      const piece = data.slice(start, start + pick([1, 2, 4, 8, 50]));
      data.splice(place(), 0, ...Array(pick([1, 1, 3, 500])).fill(piece).flat());
    },
    () => { data.length = place(); },
    () => { const other = pick(streams); data = [...data.slice(0, place()), ...other.slice(below(other.length + 1))]; },
    () => word(pick(WORDS)), () => word(pick(WORDS)),
    () => { const value = pick(NUMBERS); data.splice(place(), 4, ...[24, 16, 8, 0].map((shift) => (value >>> shift) & 255)); },
  ];
  function flip() {
    const bit = below(8 * data.length);
    data[bit >> 3] ^= 128 >> (bit & 7);
  }
  function word(/** @type {number[]} */ bytes) {
    data.splice(place(), pick([0, bytes.length]), ...bytes);
  }
  for (let times = pick([1, 1, 1, 2, 2, 3, 4]); times > 0 && data.length; times -= 1) pick(mutations)();
  return Uint8Array.from(data.slice(0, most));
}

/** Return the frames that a stream gives, or null where it throws an FbaError; any other exception goes on. */
function attempt(/** @type {() => number} */ action) {
  try {
    return action();
  } catch (error) {
    if (!(error instanceof FbaError)) throw error;
    return null;
  }
}

/** Decode a stream in all modes; throw where the decoder does what it must not. @param {Uint8Array} stream @param {number} number */
export function check(stream, number) {
  const most = MOST_MS + stream.length / BYTES_A_MS;
  const begin = performance.now();
  decodeAll(stream, number);
  if (performance.now() - begin < most) return;
  const before = cpuUsage(); // once more: the machine may have been busy with something else
  decodeAll(stream, number);
  const { user, system } = cpuUsage(before);
  if (user + system > 1000 * most) throw new Error(`${(user + system) / 1000} ms for ${stream.length} bytes`);
}

/** @param {Uint8Array} stream @param {number} number */
function decodeAll(stream, number) {
  for (const salvage of [false, true]) {
    const whole = attempt(() => {
      const animation = decode(stream, { salvage });
      for (let at = 0; at < animation.length; at += Math.ceil(animation.length / 50)) {
        const frame = animation.frame(at);
        const follows = at === 0 || animation.index[at] > animation.index[at - 1];
        if (!follows || !Number.isFinite(frame.time) || !(frame.face || frame.body)) throw new Error(JSON.stringify(frame));
      }
      return animation.length;
    });
    const size = 1 + (number % 97) * 7;
    if (salvage !== (number % 3 === 0) || stream.length > SMALL * size) continue;
    const pieces = attempt(() => {
      const decoder = new Decoder({ salvage });
      let frames = 0;
      for (let at = 0; at < stream.length; at += size) frames += decoder.push(stream.subarray(at, at + size)).length;
      return frames + decoder.finish().length;
    });
    if (!salvage && whole !== null && pieces !== whole) {
      throw new Error(`${whole} frames whole, ${pieces} in pieces of ${size} bytes`);
    }
  }
}

function main() {
  const [count, seed, first] = [argv[2] ?? 1000, argv[3] ?? 1, argv[4] ?? 0].map(Number);
  const streams = vectorStreams();
  let failures = 0;
  Error.stackTraceLimit = 0; // traces of the many FbaErrors take their time
  for (let number = first; number < first + count; number += 1) {
    try {
      check(mutant(streams, seed, number), number);
    } catch (error) {
      failures += 1;
      stdout.write(`mutant ${number} of seed ${seed}: ${error instanceof Error ? error.stack : error}\n`);
    }
    if (number % 10_000 === 9999) {
      const { heapUsed, arrayBuffers } = process.memoryUsage();
      stderr.write(`${number + 1} mutants, ${failures} failures, ${Math.round((heapUsed + arrayBuffers) / 1e6)} MB\n`);
      if (heapUsed + arrayBuffers > MOST_HEAP) throw new Error("the decoder keeps memory");
    }
  }
  stdout.write(`${count} mutants, ${failures} failures\n`);
  return failures ? 1 : 0;
}

if (argv[1] === fileURLToPath(import.meta.url)) process.exitCode = main();
