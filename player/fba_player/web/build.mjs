/** Build the bundles: node build.mjs [FOLDER], by default into dist. `./dev web` calls it. */
import { build } from "esbuild";
import { join } from "node:path";
import { fileURLToPath } from "node:url";

const HERE = fileURLToPath(new URL(".", import.meta.url));
const LICENCE = "MIT licence, Copyright (c) 2026 The fba developers";

/** A bundle of each: the module it begins with, its file, its first line, and which names of properties are shortened. */
const BUNDLES = [
  { entry: "fba.js", file: "fba.min.js", banner: `/*! A decoder of MPEG-4 FBA streams. ${LICENCE} */`, mangleProps: /^_/ },
  { entry: "fba-player.js", file: "fba-player.min.js", banner: `/*! A player of MPEG-4 FBA streams. ${LICENCE} */` },
  { entry: "fba-loader.js", file: "fba-loader.min.js", banner: `/*! MPEG-4 FBA streams for three.js. ${LICENCE} */` },
];

const folder = process.argv[2] ?? join(HERE, "dist");
for (const { entry, file, banner, mangleProps } of BUNDLES) {
  await build({
    entryPoints: [join(HERE, entry)],
    outfile: join(folder, file),
    bundle: true,
    minify: true,
    format: "esm",
    loader: { ".frag": "text", ".vert": "text", ".glsl": "text", ".css": "text" },
    target: "es2022",
    legalComments: "none",
    banner: { js: banner },
    mangleProps,
  });
}
