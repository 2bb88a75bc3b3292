// Runs the tests: bundled, since Node 18 reads no TypeScript.
import { mkdtemp, readdir, rm } from "node:fs/promises";
import { spawnSync } from "node:child_process";
import { dirname, join } from "node:path";
import { fileURLToPath } from "node:url";
import { build } from "esbuild";

const here = dirname(fileURLToPath(import.meta.url));
const out = await mkdtemp(join(here, "node_modules", ".tests-"));
const files = (await readdir(join(here, "test"))).filter((name) => name.endsWith(".test.ts"));
await build({
  absWorkingDir: here, entryPoints: files.map((name) => `test/${name}`), outdir: out, outExtension: { ".js": ".mjs" }, bundle: true,
  platform: "node", format: "esm", target: ["node18"], logLevel: "warning",
});
const made = (await readdir(out)).map((name) => join(out, name));
const { status } = spawnSync(process.execPath, ["--test", ...made], { stdio: "inherit" });
await rm(out, { recursive: true });
process.exit(status ?? 1);
