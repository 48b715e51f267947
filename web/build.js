// Bundles the player with three.js, and writes down which sources it was made from.
import { createHash } from "node:crypto";
import { readFileSync } from "node:fs";
import { build } from "esbuild";

const sources = ["player.js", "scene.js", "charts.js", "package.json"];
const hash = createHash("sha256");
for (const name of sources) hash.update(readFileSync(name));
await build({
  entryPoints: ["player.js"],
  bundle: true,
  minify: true,
  format: "iife",
  target: "es2020",
  legalComments: "inline",
  banner: { js: `/* made by "make player" from web/, sha256 ${hash.digest("hex")} */` },
  outfile: "../src/gaitshift/report/player.js",
});
