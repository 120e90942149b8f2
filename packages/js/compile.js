// Compiles meshes in browsers and in node: the quality `fast`, a BVH without free directions. The module of WebAssembly that does the
// work is compile.wasm; its functions are those of compile/. It is loaded when it is first needed.

import { BthError, classOf, sizedKindOf } from "./checks.js";
import { guarded, moduleOf } from "./module.js";

/** Loads the compiler; see compile.d.ts. */
export async function loadCompiler(source = new URL("./compile.wasm", import.meta.url)) {
    const module = await moduleOf(source);
    if (!WebAssembly.Module.exports(module).some(({ name }) => name === "bth_compile")) {
        throw new TypeError("source: expected compile.wasm; found another module of WebAssembly");
    }
    return new Compiler(module);
}

/** Compiles meshes on the thread that calls it. */
export class Compiler {
    constructor(module) {
        /** The compiled module, which workers can be sent. */
        this.module = module;
    }

    compile(positions, indices, { deformable = false, onWarning = (text) => console.warn(text) } = {}) {
        check(positions, indices);
        // Each mesh has an instance of its own, whose memory ends with it.
        const wasm = guarded(new WebAssembly.Instance(this.module, {}).exports), { memory } = wasm;
        const isWide = classOf(positions) === "Float64Array", count = positions.length / 3;
        const corners = indices ? indices.length : count;
        const at = wasm.bth_words((isWide ? 2 : 1) * positions.length), triangles = wasm.bth_words(corners);
        new (isWide ? Float64Array : Float32Array)(memory.buffer, at, positions.length).set(positions);
        const words = new Uint32Array(memory.buffer, triangles, corners);
        if (indices) words.set(indices);
        else for (let i = 0; i < corners; i++) words[i] = i;
        return made(wasm, wasm.bth_compile(at, count, isWide ? 1 : 0, triangles, corners / 3, deformable ? 1 : 0), onWarning);
    }
}

/** What a call of the module has made: a negative length is of the text of an error. */
export function made(wasm, length, onWarning) {
    const { buffer } = wasm.memory;
    const bytes = new Uint8Array(buffer, wasm.bth_bytes() >>> 0, Math.abs(length));
    if (length < 0) throw new BthError(new TextDecoder().decode(bytes));
    const warnings = new Uint8Array(buffer, wasm.bth_warnings() >>> 0, wasm.bth_warnings_length());
    for (const line of new TextDecoder().decode(warnings).split("\n").filter(Boolean)) onWarning(line);
    return bytes.slice();
}

/** Refuses arrays that are no mesh. Indices beyond the positions are the compiler's error. */
function check(positions, indices) {
    const rows = indices ? 3 : 9, what = indices ? "three numbers a vertex" : "nine numbers a triangle";
    if (!/^Float(32|64)Array$/.test(classOf(positions)) || positions.length % rows !== 0) {
        throw new TypeError(`positions: expected a Float32Array or Float64Array of ${what}; found ${sizedKindOf(positions)}`);
    }
    if (!indices) return;
    if (!/^Uint(8|16|32)Array$/.test(classOf(indices)) || indices.length % 3 !== 0) {
        throw new TypeError(`indices: expected a Uint32Array or Uint16Array of three indices a triangle; found ${sizedKindOf(indices)}`);
    }
}

/** Compiles meshes in a worker, one after the other, which does not hold up the page. */
export class CompilerWorker {
    #worker;
    #waiting = new Map();
    #next = 0;

    constructor(source = new URL("./compile.wasm", import.meta.url), worker) {
        this.#worker = worker ?? new Worker(new URL("./compile-worker.js", import.meta.url), { type: "module" });
        this.#worker.onmessage = ({ data: { id, bytes, warnings, error } }) => {
            const { resolve, reject, onWarning } = this.#waiting.get(id);
            this.#waiting.delete(id);
            if (error !== undefined) return reject(new BthError(error));
            warnings.forEach(onWarning);
            resolve(bytes);
        };
        this.#worker.onerror = (event) => {
            event.preventDefault?.();
            this.#fail(new BthError(`the worker that compiles meshes has failed: ${event.message || "it cannot be loaded"}`));
        };
        this.#worker.postMessage({ source: source?.href ?? source });
    }

    compile(positions, indices, { deformable = false, onWarning = (text) => console.warn(text) } = {}) {
        check(positions, indices);
        const id = this.#next++;
        return new Promise((resolve, reject) => {
            this.#waiting.set(id, { resolve, reject, onWarning });
            this.#worker.postMessage({ id, positions, indices, deformable });
        });
    }

    close() {
        this.#worker.terminate();
        this.#fail(new BthError("the worker that compiles meshes was closed"));
    }

    #fail(error) {
        for (const { reject } of this.#waiting.values()) reject(error);
        this.#waiting.clear();
    }
}
