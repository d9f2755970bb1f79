/** Print the processor time, in seconds, that decoding a stream takes: node measure.mjs FILE iso|visage ROUNDS; the median. */
import { readFileSync } from "node:fs";
import { argv, cpuUsage, stdout } from "node:process";
import { decode } from "../../player/fba_player/web/fba.js";

const data = new Uint8Array(readFileSync(argv[2]));
const times = Array.from({ length: Number(argv[4]) + 2 }, () => {
  const begin = cpuUsage();
  decode(data, { bapSteps: /** @type {"iso" | "visage"} */ (argv[3]) });
  const { user, system } = cpuUsage(begin);
  return (user + system) / 1e6;
});
const warm = times.slice(2).sort((one, other) => one - other);
stdout.write(`${warm[warm.length >> 1]}\n`);
