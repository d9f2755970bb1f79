/** The client of `fba serve`: a stream over a WebSocket, with a new connection after each that breaks. */
import { Decoder } from "../fba.js";

/** @typedef {import("../decoder/animation.js").StreamFrame} StreamFrame */

/**
 * The connection. waiting: it opens again in `seconds`. over: the stream has ended for good. closed: by `close`.
 * @typedef {"connecting" | "open" | "waiting" | "over" | "closed"} State
 *
 * What is called. hello: the titles of all streams of the server, and the number of this one. start: decoding begins
 * anew at a time of the stream; frames before it stay valid. frames: decoded, with times of the stream; they are to be
 * shown from now on. lost: planes that were left out, as they were not taken in time. end: the stream has ended, perhaps
 * to start again. state: of the connection; seconds: until the next attempt. error: bytes that cannot be decoded, after
 * which the connection is opened again.
 * @typedef {{
 *   hello?: (titles: string[], stream: number) => void, start?: (time: number, rate: number) => void,
 *   frames?: (frames: StreamFrame[]) => void, lost?: (planes: number) => void, end?: () => void,
 *   state?: (state: State, seconds: number) => void, error?: (error: unknown) => void,
 * }} Calls
 *
 * The parts of a WebSocket that are used.
 * @typedef {{binaryType: string, close: () => void, onopen: any, onmessage: any, onclose: any}} Socket
 *
 * socket: makes a WebSocket. later: calls a function after so many seconds, and returns what `forget` takes. random: 0 to 1.
 * @typedef {{
 *   socket?: (url: string) => Socket, later?: (call: () => void, seconds: number) => any, forget?: (timer: any) => void,
 *   random?: () => number,
 * }} Means
 */

const OVER = 1000; // code of a connection that is not to be opened again
const FIRST_PAUSE = 0.5; // seconds
const LONGEST_PAUSE = 15;

/** A stream of `fba serve`. */
export class LiveStream {
  /**
   * @param {string} url such as "ws://127.0.0.1:8080/stream?n=0"; see `streamUrl`
   * @param {Calls} calls
   * @param {Means} [means] for tests, and for node without a WebSocket
   */
  constructor(url, calls, means = {}) {
    this._url = url;
    this._calls = calls;
    this._makeSocket = means.socket ?? ((address) => new WebSocket(address));
    this._later = means.later ?? ((call, seconds) => setTimeout(call, 1000 * seconds));
    this._forget = means.forget ?? clearTimeout;
    this._random = means.random ?? Math.random;
    this._pause = FIRST_PAUSE;
    /** @type {Decoder | null} */
    this._decoder = null;
    /** @type {number | null} seconds from the decoder's times to those of the stream; null before its first frame */
    this._shift = null;
    this._start = 0;
    /** @type {Socket | null} */
    this._socket = null;
    this._timer = null;
    this._open();
  }

  /** End it for good. */
  close() {
    if (!this._socket && this._timer === null) return;
    this._forget(this._timer);
    this._timer = null;
    this._drop();
    this._say("closed");
  }

  _open() {
    this._timer = null;
    this._say("connecting");
    const socket = this._makeSocket(this._url);
    socket.binaryType = "arraybuffer";
    socket.onopen = () => this._say("open");
    socket.onmessage = (/** @type {{data: string | ArrayBuffer}} */ { data }) => this._take(data);
    socket.onclose = (/** @type {{code: number}} */ { code }) => this._lose(code);
    this._socket = socket;
  }

  /** @param {string | ArrayBuffer} data */
  _take(data) {
    try {
      if (typeof data === "string") this._hear(JSON.parse(data));
      else this._decode(new Uint8Array(data));
    } catch (error) {
      this._calls.error?.(error);
      this._drop();
      this._retry();
    }
  }

  /** @param {any} message */
  _hear(message) {
    const { hello, start, lost, end } = this._calls;
    if (message.event === "hello") hello?.(message.streams, message.stream);
    if (message.event === "lost") lost?.(message.planes);
    if (message.event === "end") end?.();
    if (message.event !== "start") return;
    this._decoder = new Decoder();
    this._start = message.time;
    this._shift = null;
    this._pause = FIRST_PAUSE;
    start?.(message.time, message.rate);
  }

  /** @param {Uint8Array} bytes */
  _decode(bytes) {
    const frames = this._decoder?.push(bytes) ?? [];
    if (!frames.length) return;
    this._shift ??= this._start - frames[0].time;
    for (const frame of frames) frame.time += this._shift;
    this._calls.frames?.(frames);
  }

  /** @param {number} code */
  _lose(code) {
    this._drop();
    if (code === OVER) this._say("over");
    else this._retry();
  }

  /** Forget the connection. */
  _drop() {
    const socket = this._socket;
    if (!socket) return;
    socket.onopen = socket.onmessage = socket.onclose = null;
    socket.close();
    this._socket = this._decoder = null;
  }

  /** Open it again after a pause, which grows, and differs among viewers, so that they do not all come at once. */
  _retry() {
    const seconds = this._pause * (0.5 + 0.5 * this._random());
    this._pause = Math.min(2 * this._pause, LONGEST_PAUSE);
    this._timer = this._later(() => this._open(), seconds);
    this._say("waiting", seconds);
  }

  /** @param {State} state @param {number} [seconds] */
  _say(state, seconds = 0) {
    this._calls.state?.(state, seconds);
  }
}

/** Return the address of a stream of the server that a page came from. @param {string} page @param {number} [stream] */
export function streamUrl(page, stream = 0) {
  const url = new URL(`stream?n=${stream}`, page);
  url.protocol = url.protocol === "https:" ? "wss:" : "ws:";
  return url.href;
}
