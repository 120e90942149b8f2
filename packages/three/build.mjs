// Assembles the page of examples: a folder that any server of static files can serve.
//
//   DIST=FOLDER MODULES=FOLDER node build.mjs OUT
//   node build.mjs --package OUT      only the package @bth/three, for npm pack
//
// DIST is the built package bth (packages/js/dist); MODULES a folder node_modules with three and
// three-mesh-bvh (npm install three three-mesh-bvh).
import { cpSync, existsSync, mkdirSync, readFileSync, readdirSync, writeFileSync } from "node:fs";
import { dirname, join, resolve } from "node:path";
import { fileURLToPath } from "node:url";

const here = dirname(fileURLToPath(import.meta.url)), root = resolve(here, "../..");
const { DIST = join(here, "../js/dist"), MODULES = "node_modules" } = process.env;
const isPackage = process.argv[2] === "--package", [given, ...others] = process.argv.slice(isPackage ? 3 : 2);
if (!given || others.length > 0 || given.startsWith("-")) {
    console.error("usage: DIST=FOLDER MODULES=FOLDER node packages/three/build.mjs [--package] OUT");
    process.exit(2);
}
const out = resolve(given), lib = join(out, "lib");

/** Copies files of a package into a folder. */
function take(to, from, files) {
    for (const file of files) cpSync(join(from, file), join(to, file), { recursive: true });
}

const { files } = JSON.parse(readFileSync(join(here, "package.json")));
const licences = files.filter((file) => file.startsWith("LICENSE"));
const own = isPackage ? out : join(lib, "@bth/three");
take(own, here, [...files.filter((file) => !licences.includes(file)), "package.json"]);
take(own, root, licences);
if (isPackage) process.exit();
const bth = JSON.parse(readFileSync(join(DIST, "package.json"))).files.filter((file) => file !== "viewer.html");
take(join(lib, "bth"), resolve(DIST), [...bth.filter((file) => existsSync(join(DIST, file))), "package.json"]);
const jsm = ["controls/OrbitControls.js", "geometries/TeapotGeometry.js", "utils", ...["GLTF", "OBJ", "PLY", "STL"].map((kind) => `loaders/${kind}Loader.js`)];
take(join(lib, "three"), join(resolve(MODULES), "three"), ["build/three.module.js", "build/three.core.js", "LICENSE", "package.json", ...jsm.map((file) => `examples/jsm/${file}`)]);
take(join(lib, "three-mesh-bvh"), join(resolve(MODULES), "three-mesh-bvh"), ["build/index.module.js", "LICENSE", "package.json"]);

mkdirSync(out, { recursive: true });
const pages = join(here, "examples");
for (const file of readdirSync(pages)) cpSync(join(pages, file), join(out, file), { recursive: true });

/** Each example has a page, which is the same but for its name and its text. */
const template = readFileSync(join(pages, "page.html"), "utf8");
for (const { name, title, text } of JSON.parse(readFileSync(join(pages, "examples.json")))) {
    const page = template.replaceAll("{name}", name).replaceAll("{title}", title).replaceAll("{text}", text);
    writeFileSync(join(out, `${name}.html`), page);
}
console.log(`${out}: serve this folder, for example with: npx serve ${given}`);
