// Builds the package: bth.wasm from src/, compile.wasm from compile/, and viewer.html, one page with everything in it.
//
//   node build.mjs [FOLDER]    FOLDER is where they go; by default dist/. Needs Rust with the target wasm32-unknown-unknown.
import { execFileSync } from "node:child_process";
import { copyFileSync, mkdirSync, readFileSync, writeFileSync } from "node:fs";
import { homedir } from "node:os";
import { dirname, join, resolve } from "node:path";
import { fileURLToPath } from "node:url";
import { gzipSync } from "node:zlib";

const here = dirname(fileURLToPath(import.meta.url)), root = resolve(here, "../..");
const given = process.argv.slice(2);
if (given.length > 1 || given[0]?.startsWith("-")) {
    console.error("usage: node packages/js/build.mjs [FOLDER]");
    process.exit(2);
}
const out = resolve(given[0] ?? join(here, "dist"));
/** Bytes at most: of the modules as browsers download them, compressed by gzip, and of the page. */
const MOST_WASM = 450_000, MOST_COMPILER = 300_000, MOST_PAGE = 1_400_000;

/** Compiles packages of modules with features; returns the modules. Artifacts with these flags have a folder of their own. */
function compiledModules(packages, features = []) {
    const target = join(process.env.CARGO_TARGET_DIR ?? join(root, "target"), "wasm");
    const arguments_ = ["build", ...packages.flatMap((name) => ["-p", name]), "--profile", "wasm", "--target", "wasm32-unknown-unknown", "--target-dir", target];
    // What kernels need is inlined by force; anything else is smaller as a function of its own.
    const small = "llvm-args=-inline-threshold=5";
    // Calls and addresses as short as they are, in place of five bytes each.
    const short = "link-arg=--compress-relocations";
    // The stack pointer, which index.js sets back after a call that did not end.
    const stack = "link-arg=--export=__stack_pointer";
    // Panics name files of crates: without the folder of whoever builds, so that the same sources give the same module.
    const crates = `--remap-path-prefix=${process.env.CARGO_HOME ?? join(homedir(), ".cargo")}=cargo`;
    const flags = [...(process.env.RUSTFLAGS ?? "").split(" "), "-C", "target-feature=+simd128", "-C", small, "-C", short, "-C", stack, crates];
    const CARGO_ENCODED_RUSTFLAGS = flags.filter((flag) => flag !== "").join("\x1f");
    // BLAKE3 in plain Rust, so that no C compiler for the target is needed.
    execFileSync("cargo", [...arguments_, "--features", ["bth-format/pure", ...features].join()], { cwd: root, stdio: "inherit", env: { ...process.env, CARGO_ENCODED_RUSTFLAGS } });
    const folder = join(target, "wasm32-unknown-unknown/wasm");
    return packages.map((name) => stripped(readFileSync(join(folder, `${name.replaceAll("-", "_")}.wasm`))));
}

/** A module without its custom sections: the names of functions, which are a fifteenth of it, and what compiled it. */
function stripped(module) {
    const parts = [module.subarray(0, 8)];
    for (let at = 8; at < module.length; ) {
        const id = module[at];
        let length = 0, end = at + 1, shift = 0;
        do length += (module[end] & 127) * 2 ** shift, (shift += 7);
        while (module[end++] & 128);
        end += length;
        if (id !== 0) parts.push(module.subarray(at, end));
        at = end;
    }
    return Buffer.concat(parts);
}

/** The modules that a module needs, one after the other, as one script. Names at the top of the modules differ. */
function joined(path, seen = new Set()) {
    if (seen.has(path)) return "";
    seen.add(path);
    const text = readFileSync(path, "utf8");
    const imports = [...text.matchAll(/^import .* from "(\.[^"]+)";\n/gm)];
    const needed = imports.map(([, from]) => joined(resolve(dirname(path), from), seen)).join("");
    const own = text.replace(/^import .* from "\.[^"]+";\n/gm, "").replace(/^export /gm, "");
    // Workers of pages that are opened as files cannot be modules, which alone know their address.
    return needed + own.replaceAll("import.meta.url", "location.href");
}

/** A script as a string in a script of a page. */
const quoted = (script) => JSON.stringify(script).replaceAll("</", "<\\/").replaceAll("<!--", "<\\!--");

/** A module as text of a script. */
const packed = (module) => gzipSync(module, { level: 9 }).toString("base64");

function page(wasm, importer) {
    const worker = joined(join(here, "viewer/worker.js")), main = joined(join(here, "viewer/main.js"));
    const script = `
const WORKER = ${quoted(worker)};
const TRACER = "${packed(wasm)}", IMPORTER = "${packed(importer)}";
let url = null;
function workerUrl() {
    return (url ??= URL.createObjectURL(new Blob([WORKER], { type: "text/javascript" })));
}
const modules = new Map();
function unpackedModule(text) {
    if (!modules.has(text)) modules.set(text, unpacked(text).then((bytes) => WebAssembly.compile(bytes)));
    return modules.get(text);
}
const compiledModule = () => unpackedModule(TRACER), compilerModule = () => unpackedModule(IMPORTER);
function unpacked(text) {
    const packed = new Blob([Uint8Array.from(atob(text), (c) => c.charCodeAt(0))]);
    return new Response(packed.stream().pipeThrough(new DecompressionStream("gzip"))).arrayBuffer();
}
${main.replaceAll("</script", "<\\/script")}`;
    const template = readFileSync(join(here, "viewer/page.html"), "utf8");
    return template.replace("<!-- scripts -->", () => `<script type="module">${script}</script>`);
}

function keep(name, bytes, most, size = bytes.length, how = "") {
    writeFileSync(join(out, name), bytes);
    console.log(`${name}: ${size} bytes of at most ${most}${how}`);
    if (size > most) process.exitCode = 1;
}

mkdirSync(out, { recursive: true });
const [wasm, compiler] = compiledModules(["bth-js", "bth-js-compile"]);
const [importer] = compiledModules(["bth-js-compile"], ["bth-js-compile/models"]);
for (const [name, module, most] of [["bth.wasm", wasm, MOST_WASM], ["compile.wasm", compiler, MOST_COMPILER]]) {
    keep(name, module, most, gzipSync(module, { level: 9 }).length, ` compressed; ${module.length} as they are`);
}
keep("viewer.html", page(wasm, importer), MOST_PAGE);
for (const name of JSON.parse(readFileSync(join(here, "package.json"))).files.filter((name) => /\.(js|d\.ts)$/.test(name))) copyFileSync(join(here, name), join(out, name));
copyFileSync(join(here, "package.json"), join(out, "package.json"));
for (const name of ["LICENSE-MIT", "LICENSE-APACHE"]) copyFileSync(join(root, name), join(out, name));
// The licences of the crates that the module holds, most of which ask to be where it is.
try {
    const notices = execFileSync("bash", [join(root, "tools/package/notices"), "--target", "wasm32-unknown-unknown", "bth-js", "bth-js-compile"]);
    writeFileSync(join(out, "NOTICES"), notices);
} catch (error) {
    console.error(`NOTE: without NOTICES, the licences of crates, which whoever passes the package on has to add: ${error.message}`);
}
