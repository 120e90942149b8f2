// The modules of WebAssembly, which all trees of a page share: the tracer, and the compiler on this
// thread or in a worker.

import { load } from "bth";
import { CompilerWorker, loadCompiler } from "bth/compile";

let tracer = null, compiler = null;
let loading = null, compilerLoading = null, worker = null;
/** Where the modules come from; by default from the package bth. */
const sources = { wasm: undefined, compilerWasm: undefined };

/** Loads what the functions need that do not wait; see index.d.ts. */
export async function ready(options = {}) {
    for (const name of Object.keys(sources)) sources[name] = options[name] ?? sources[name];
    loading ??= load(sources.wasm).then((bth) => (tracer = bth));
    if (options.compiler) {
        compilerLoading ??= loadCompiler(sources.compilerWasm).then((loaded) => (compiler = loaded));
        await compilerLoading;
    }
    await loading;
}

/** The tracer, once it is loaded. */
export function engine() {
    if (tracer) return tracer;
    throw new Error("@bth/three: bth.wasm is not loaded yet; `await ready()` first");
}

/** Compiles a mesh on this thread. */
export function compile({ positions, indices }, options) {
    if (compiler) return compiler.compile(positions, indices, options);
    const hint = "`await ready({ compiler: true })` first, or use computeBoundsTreeAsync";
    throw new Error(`@bth/three: compile.wasm is not loaded yet; ${hint}`);
}

/** Compiles a mesh in a worker, or on this thread where there are no workers. */
export async function compileAsync({ positions, indices }, options) {
    if (typeof Worker !== "function") {
        await ready({ compiler: true });
        return compile({ positions, indices }, options);
    }
    worker ??= new CompilerWorker(sources.compilerWasm);
    const [bytes] = await Promise.all([worker.compile(positions, indices, options), ready()]);
    return bytes;
}
