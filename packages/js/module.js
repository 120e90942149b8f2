// Modules of WebAssembly: where they come from, and how their functions are called.

import { BthError, classOf, kindOf } from "./checks.js";

/** What is said where the module has too little memory for something. */
export function noMemory(what, memory, options) {
    return new BthError(`BTH-O001: not enough memory for ${what} (the module has ${Math.round(memory.buffer.byteLength / 2 ** 20)} MiB)`, options);
}

/**
 * What the module exports, with functions that throw a BthError where the module cannot get memory: it then executes "unreachable". Its
 * stack stays as deep as it was at such a trap, and where the caller's own recursion ends a call, so that the stack pointer is set back,
 * else some of these would leave no stack. A panic, which would be a defect of the library, ends as a trap does; it is the error's cause.
 */
export function guarded(exports) {
    const { memory, __stack_pointer: stack } = exports;
    // No function takes more numbers. A list of arguments would be an array for each call.
    const guard = (call) => (a, b, c, d, e, f) => {
        const top = stack.value;
        try {
            return call(a, b, c, d, e, f);
        } catch (error) {
            stack.value = top;
            const isTrap = error instanceof WebAssembly.RuntimeError && /unreachable/i.test(error.message);
            throw isTrap ? noMemory("this call", memory, { cause: error }) : error;
        }
    };
    const calls = Object.entries(exports).filter(([, call]) => typeof call === "function");
    return { memory, ...Object.fromEntries(calls.map(([name, call]) => [name, guard(call)])) };
}

/** The module of a source: its URL, a response, its bytes or a module that is compiled; or a promise of one. */
export async function moduleOf(given) {
    const source = await given;
    if (classOf(source) === "WebAssembly.Module") return source;
    return compile(source);
}

async function compile(source) {
    // Node does not compile a DataView.
    if (ArrayBuffer.isView(source)) return WebAssembly.compile(new Uint8Array(source.buffer, source.byteOffset, source.byteLength));
    if (classOf(source) === "ArrayBuffer") return WebAssembly.compile(source);
    if (classOf(source) === "Response") return WebAssembly.compileStreaming(source);
    if (typeof source !== "string" && typeof source?.href !== "string") {
        throw new TypeError(`source: expected a module of WebAssembly as its URL, a response, its bytes or a compiled module; found ${kindOf(source)}`);
    }
    // With these comments bundlers leave it as it is: they do not know the address, and browsers have no module of node. That is also why
    // package.json has "browser", which esbuild reads.
    const url = new URL(/* webpackIgnore: true */ source.href ?? source, import.meta.url);
    if (url.protocol === "file:" && typeof process === "object") {
        const { readFile } = await import(/* webpackIgnore: true */ /* @vite-ignore */ "node:fs/promises");
        return WebAssembly.compile(await readFile(url));
    }
    return WebAssembly.compileStreaming(fetch(url));
}
