// Runs a WebAssembly program (wasm32-wasip1) with node: tools/check/targets names this as cargo's runner.
import { readFile } from "node:fs/promises";
import { resolve } from "node:path";
import { WASI } from "node:wasi";

const [, , program, ...args] = process.argv;
// Tests read files of the repository.
const root = resolve(new URL(".", import.meta.url).pathname, "../..");
const wasi = new WASI({ version: "preview1", args: [program, ...args], env: {}, preopens: { [root]: root }, returnOnExit: true });
const module = await WebAssembly.compile(await readFile(program));
process.exit(wasi.start(await WebAssembly.instantiate(module, wasi.getImportObject())));
