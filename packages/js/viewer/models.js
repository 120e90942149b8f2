// Model files: which they are, and how they are compiled.

import { made } from "../compile.js";
import { guarded } from "../module.js";

/** Extensions of files that are compiled before they are shown. */
const MODELS = /\.(glb|gltf|ply|obj|stl|off)$/i;

export const isModel = (name) => MODELS.test(name);

/** Compiles a model file with a module that has importers: the bytes of a compiled file, and warnings. */
export function compiledModel(module, name, file) {
    const wasm = guarded(new WebAssembly.Instance(module, {}).exports), warnings = [];
    const kept = (bytes) => {
        const at = wasm.bth_words(Math.ceil(bytes.length / 4)) >>> 0;
        new Uint8Array(wasm.memory.buffer, at, bytes.length).set(bytes);
        return [at, bytes.length];
    };
    const length = wasm.bth_compile_model(...kept(new TextEncoder().encode(name)), ...kept(new Uint8Array(file)));
    return { bytes: made(wasm, length, (text) => warnings.push(text)).buffer, warnings };
}
