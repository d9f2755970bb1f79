/**
 * Plays a script of connections to `LiveStream` and prints what it called, a JSON list.
 *
 * node play_live.mjs SCRIPT: a JSON list of steps: {open}, {text}, {bytes: base64}, {close: code}, {later}, {end}.
 */
import { readFileSync } from "node:fs";
import { LiveStream, streamUrl } from "../../player/fba_player/web/page/live.js";

const called = [];
const timers = [];
let socket = null;

class FakeSocket {
  constructor(url) {
    called.push(["socket", url]);
    socket = this;
  }

  close() {
    called.push(["socket closed"]);
  }
}

const name = (call) => (...values) => called.push([call, ...values]);
const stream = new LiveStream(
  streamUrl("http://127.0.0.1:8080/token/?x=1", 3),
  {
    hello: name("hello"), start: name("start"), lost: name("lost"), end: name("end"), state: name("state"),
    frames: (frames) => called.push(["frames", ...frames.map(({ time, face }) => [time, [...face.values]])]),
    error: (error) => called.push(["error", error.name]),
  },
  {
    socket: (url) => new FakeSocket(url),
    later: (call, seconds) => timers.push([call, seconds]),
    forget: () => (timers.length = 0),
    random: () => 1,
  },
);

for (const step of JSON.parse(readFileSync(process.argv[2], "utf8"))) {
  if ("open" in step) socket.onopen();
  if ("text" in step) socket.onmessage({ data: JSON.stringify(step.text) });
  if ("raw" in step) socket.onmessage({ data: step.raw });
  if ("bytes" in step) socket.onmessage({ data: Uint8Array.from(Buffer.from(step.bytes, "base64")).buffer });
  if ("close" in step) socket.onclose({ code: step.close });
  if ("later" in step) timers.shift()[0]();
  if ("end" in step) stream.close();
}
console.log(JSON.stringify(called));
