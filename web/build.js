// Bundles what pages need: the player with three.js, and the figures of studies. Each says which
// sources it was made from.
import { createHash } from "node:crypto";
import { readFileSync } from "node:fs";
import { build } from "esbuild";

const shared = ["theme.js", "unpack.js", "package.json"];
const bundles = { "player.js": ["player.js", "scene.js", "charts.js"], "figures.js": ["figures.js"] };
for (const [name, own] of Object.entries(bundles)) {
  const hash = createHash("sha256");
  for (const source of [...own, ...shared]) hash.update(readFileSync(source));
  await build({
    entryPoints: [name],
    bundle: true,
    minify: true,
    format: "iife",
    target: "es2020",
    legalComments: "inline",
    banner: { js: `/* made by "make player" from web/, sha256 ${hash.digest("hex")} */` },
    outfile: `../src/gaitshift/report/${name}`,
  });
}
