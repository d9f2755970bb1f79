/** Build the bundles: node build.mjs [FOLDER], by default into dist. `./dev web` calls it. */
import { build, transform } from "esbuild";
import { readFile, writeFile } from "node:fs/promises";
import { join } from "node:path";
import { fileURLToPath } from "node:url";
import { minify } from "terser";

const HERE = fileURLToPath(new URL(".", import.meta.url));
const LICENCE = "MIT licence, Copyright (c) 2026 The fba developers";

/** A bundle of each: the module it begins with, its file, its first line. */
const BUNDLES = [
  { entry: "fba.js", file: "fba.min.js", banner: `/*! ${LICENCE} */` },
  { entry: "fba-player.js", file: "fba-player.min.js", banner: `/*! A player of MPEG-4 FBA streams. ${LICENCE} */` },
  { entry: "fba-loader.js", file: "fba-loader.min.js", banner: `/*! MPEG-4 FBA streams for three.js. ${LICENCE} */` },
];

/** Takes shaders without comments and indentation, and styles as short as they can be, as texts. */
const TEXTS = {
  name: "texts",
  setup(/** @type {import("esbuild").PluginBuild} */ plugin) {
    plugin.onLoad({ filter: /\.(frag|vert|glsl)$/ }, async ({ path }) => {
      const text = await readFile(path, "utf8");
      return { contents: text.replace(/^\s*\/\/(?!include).*\n|\s*\/\/(?!include).*$/gm, "").replace(/^\s+/gm, ""), loader: "text" };
    });
    plugin.onLoad({ filter: /\.css$/ }, async ({ path }) => {
      const { code } = await transform(await readFile(path, "utf8"), { loader: "css", minify: true });
      return { contents: code, loader: "text" };
    });
  },
};

const folder = process.argv[2] ?? join(HERE, "dist");
for (const { entry, file, banner } of BUNDLES) {
  const outfile = join(folder, file);
  await build({
    entryPoints: [join(HERE, entry)],
    outfile,
    bundle: true,
    minify: true,
    mangleProps: /^_/,
    format: "esm",
    plugins: [TEXTS],
    target: "es2022",
    legalComments: "none",
    banner: { js: banner },
  });
  if (entry === "fba.js") await shorten(outfile);
}

/** Shorten the decoder further: on a page of somebody else every byte counts. @param {string} file */
async function shorten(file) {
  const { code } = await minify(await readFile(file, "utf8"), {
    module: true,
    compress: { passes: 3, ecma: 2020, unsafe_arrows: true },
    format: { comments: /^!/ },
  });
  await writeFile(file, `${code}\n`);
}
