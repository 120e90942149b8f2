// Traces rays through compiled BTH files. The module of WebAssembly that does the work is bth.wasm; its functions are those of src/.

import { BthError, RAY, bytesOf } from "./checks.js";
import { moduleOf, guarded, noMemory } from "./module.js";
import { Hits } from "./results.js";
import { CHUNK, Scene, WORDS, placed } from "./scene.js";

export { BthError, Hits };

/** Loads the module; see index.d.ts. */
export async function load(source = new URL("./bth.wasm", import.meta.url)) {
    const module = await moduleOf(source);
    const { exports } = await WebAssembly.instantiate(module, {});
    if (!exports.bth_has_vectors) throw new TypeError("source: expected bth.wasm; found another module of WebAssembly");
    return new Bth(guarded(exports), module);
}

/** A loaded module. */
export class Bth {
    #wasm;

    constructor(wasm, module) {
        this.#wasm = wasm;
        /** The compiled module, which workers can be sent. */
        this.module = module;
        this.simd = wasm.bth_has_vectors() === 1;
        // Rays, results and room for 14 numbers of 8 bytes.
        this.memory = { rays: wasm.bth_words(2 * CHUNK * RAY), results: wasm.bth_words(WORDS), numbers: wasm.bth_words(28), views: null };
    }

    open(file) {
        const bytes = bytesOf(file);
        const memory = this.#wasm.bth_file_new(bytes.length);
        if (memory === 0) throw noMemory(`a file of ${bytes.length} bytes`, this.#wasm.memory);
        new Uint8Array(this.#wasm.memory.buffer, this.#wasm.bth_file_bytes(memory) >>> 0, bytes.length).set(bytes);
        const scene = this.#wasm.bth_open(memory);
        if (scene === 0) throw this.#error();
        return new Scene(this.#wasm, this.memory, scene, () => this.#error());
    }

    instances(scenes, transforms, which) {
        return placed(this.#wasm, this.memory, () => this.#error(), [scenes].flat(), transforms, which);
    }

    #error() {
        const at = this.#wasm.bth_error() >>> 0;
        const bytes = new Uint8Array(this.#wasm.memory.buffer, at, this.#wasm.bth_error_length());
        return new BthError(new TextDecoder().decode(bytes));
    }
}
