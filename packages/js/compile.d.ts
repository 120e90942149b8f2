import type { CompiledModule, ModuleSource } from "./index.js";

/** How a mesh is compiled. */
export interface CompileOptions {
    /** True to keep what new positions at run time need (`scene.setPositions`). */
    deformable?: boolean;
    /** Called with each warning; by default they go to the console. */
    onWarning?: (text: string) => void;
}

/**
 * Loads the compiler.
 * @param source compile.wasm, as `load` takes bth.wasm; by default the file next to compile.js.
 */
export function loadCompiler(source?: ModuleSource | Promise<ModuleSource>): Promise<Compiler>;

/** Compiles meshes on the thread that calls it. */
export class Compiler {
    private constructor();
    /** The compiled module. Send it to workers, and `loadCompiler` it there. */
    readonly module: CompiledModule;
    /**
     * Compiles a mesh: the bytes of a file, as `bth-compile` makes it with the quality `fast`, a BVH
     * only, and no free directions. The index of a triangle here is its id in hits.
     * @param positions Three numbers a vertex. Equal positions are merged.
     * @param indices Three indices a triangle, counter-clockwise seen from the front; without them
     * each three vertices are a triangle.
     * @throws TypeError for other arrays.
     * @throws BthError with BTH-I004 for a position that is not finite, BTH-I005 for an index of no
     * position, BTH-O001 where the memory is too small.
     */
    compile(positions: Float32Array | Float64Array, indices?: Uint8Array | Uint16Array | Uint32Array | null, options?: CompileOptions): Uint8Array;
}

/** Compiles meshes in a worker, one after the other. */
export class CompilerWorker {
    /**
     * @param source compile.wasm: its URL, or a module that is already compiled.
     * @param worker A worker that runs compile-worker.js; by default a new one.
     */
    constructor(source?: string | { readonly href: string } | CompiledModule, worker?: object);
    /** As `Compiler.compile`. Positions and indices are copied. */
    compile(positions: Float32Array | Float64Array, indices?: Uint8Array | Uint16Array | Uint32Array | null, options?: CompileOptions): Promise<Uint8Array>;
    /** Ends the worker. */
    close(): void;
}
