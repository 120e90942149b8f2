// Runs tests of three-mesh-bvh against this package: only what they import is replaced.
//
//   OUT=FOLDER npx vitest run --config packages/three/tests/foreign.config.mjs --root CLONE test/RandomRaycasts.test.js ...
//
// OUT is what build.mjs assembled, CLONE a clone of three-mesh-bvh in which vitest is installed.
import { dirname, join, resolve } from "node:path";
import { fileURLToPath } from "node:url";

const here = dirname(fileURLToPath(import.meta.url)), lib = join(resolve(process.env.OUT), "lib");
const alias = [
    [/^three-mesh-bvh$/, join(here, "foreign.mjs")],
    [/^@bth\/three$/, join(lib, "@bth/three/index.js")],
    [/^bth$/, join(lib, "bth/index.js")],
    [/^bth\/compile$/, join(lib, "bth/compile.js")],
    [/^three$/, join(lib, "three/build/three.module.js")],
    [/^three\/examples\/jsm\/(.*)$/, join(lib, "three/examples/jsm/$1")],
];
export default {
    test: { globals: true, testTimeout: 60_000, hookTimeout: 120_000 },
    resolve: { preserveSymlinks: true, alias: alias.map(([find, replacement]) => ({ find, replacement })) },
};
