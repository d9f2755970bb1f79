// What mp4box.js, the reader of GPAC in JavaScript, finds in an MP4 file; with a second name, the file in segments.
//
//     node read_mp4box.mjs mp4box.all.mjs FILE [SEGMENTED]
//
// Prints JSON: the tracks, and of each the digests of its samples, their sync flags, times and durations.
import { createHash } from "node:crypto";
import { readFileSync, writeFileSync } from "node:fs";
import { pathToFileURL } from "node:url";

const [library, name, segmented] = process.argv.slice(2);
const { createFile } = await import(pathToFileURL(library));
const file = createFile(true);
const tracks = [];
const segments = [];
file.onError = (error) => {
    throw new Error(error);
};
file.onSegment = (id, user, buffer) => segments.push(Buffer.from(buffer));
file.onReady = (info) => {
    for (const { id, codec, type, timescale, nb_samples: count } of info.tracks) {
        tracks.push({ id, codec, type, timescale, count, samples: [] });
        if (segmented && type === "video") file.setSegmentOptions(id, null, { nbSamples: 20 });
        if (!segmented) file.setExtractionOptions(id, null, { nbSamples: 1000000 });
    }
    if (segmented) segments.push(Buffer.from(file.initializeSegmentation().buffer));
    file.start();
};
file.onSamples = (id, user, samples) => {
    for (const { data, is_sync: sync, dts, duration } of samples) {
        const digest = createHash("sha256").update(data).digest("hex");
        tracks.find((track) => track.id === id).samples.push({ digest, sync, dts, duration });
    }
};
const bytes = readFileSync(name);
const buffer = bytes.buffer.slice(bytes.byteOffset, bytes.byteOffset + bytes.length);
buffer.fileStart = 0;
file.appendBuffer(buffer);
file.flush();
if (segmented) writeFileSync(segmented, Buffer.concat(segments));
console.log(JSON.stringify(tracks));
