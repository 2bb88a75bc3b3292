// Bundles the page into host-tools/assets; with --check it compares what is there with what would be written.
import { readFile, writeFile } from "node:fs/promises";
import { dirname, join } from "node:path";
import { fileURLToPath } from "node:url";
import { build } from "esbuild";

const here = dirname(fileURLToPath(import.meta.url));
const assets = join(here, "..", "assets");
const check = process.argv.includes("--check");

const { outputFiles } = await build({
  absWorkingDir: here,
  entryPoints: { serve: "src/main.tsx" },
  outdir: assets,
  bundle: true,
  minify: true,
  write: false,
  format: "iife",
  target: ["es2021"],
  charset: "utf8",
  legalComments: "none",
  banner: { js: "/* Made from host-tools/web by npm run build. Contains Preact, signals and uPlot, MIT: serve.LICENSE.txt. */" },
});
let behind = 0;
for (const file of outputFiles) {
  if (check) {
    const kept = await readFile(file.path, "utf8").catch(() => "");
    if (kept !== file.text) {
      console.error(`${file.path} is not what its sources make: run npm run build in host-tools/web`);
      behind += 1;
    }
  } else {
    await writeFile(file.path, file.text);
    console.log(`${file.path}: ${file.text.length} characters`);
  }
}
process.exit(behind ? 1 : 0);
