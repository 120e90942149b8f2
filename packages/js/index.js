// Traces rays through compiled BTH files. The module of WebAssembly that does the work is bth.wasm; its functions are those of src/.

/** Rays that are copied to the module at a time: they stay in the caches. */
const CHUNK = 4096;
/** Numbers of a ray: origin, tmin, direction, tmax. In double they take two words each. */
const RAY = 8;
/** Columns of hits: the first three are numbers, the others indices. */
const HIT_NAMES = ["t", "u", "v", "instance", "triangle"];
/** Numbers of a point. */
const POINT = 3;
/** Columns of hits for `bth_surface`, and words of a surface. */
const HIT_COLUMNS = 5, SURFACE_WORDS = 23;
/** Bytes of a file at most: the module holds it in one piece, at a multiple of 64. */
const MOST_FILE = 2 ** 31 - 64;
/** Words of memory that a chunk needs at most: hits and their surfaces. */
const WORDS = CHUNK * (HIT_COLUMNS + SURFACE_WORDS);

/** What stands for no texture. */
const NONE = 0xffffffff;
/** How texture coordinates beyond 0 and 1 find texels. */
const WRAPS = ["repeat", "mirror", "clamp"];

/** What the library refuses: `code` is that of the error, such as "BTH-F001", or "" where it has none. */
export class BthError extends Error {
    constructor(message, options) {
        super(message, options);
        this.name = "BthError";
        this.code = /BTH-[A-Z]\d+/.exec(message)?.[0] ?? "";
    }
}

/** Loads the module; see index.d.ts. */
export async function load(source = new URL("./bth.wasm", import.meta.url)) {
    const found = await source;
    const module = classOf(found) === "WebAssembly.Module" ? found : await compile(found);
    const { exports } = await WebAssembly.instantiate(module, {});
    if (!exports.bth_has_vectors) throw new TypeError("source: expected bth.wasm; found another module of WebAssembly");
    return new Bth(guarded(exports), module);
}

/** What is said where the module has too little memory for something. */
function noMemory(what, memory, options) {
    return new BthError(`BTH-O001: not enough memory for ${what} (the module has ${Math.round(memory.buffer.byteLength / 2 ** 20)} MiB)`, options);
}

/**
 * What the module exports, with functions that throw a BthError where the module cannot get memory: it then executes "unreachable". Its
 * stack stays as deep as it was at such a trap, and where the caller's own recursion ends a call, so that the stack pointer is set back,
 * else some of these would leave no stack. A panic, which would be a defect of the library, ends as a trap does; it is the error's cause.
 */
function guarded(exports) {
    const { memory, __stack_pointer: stack } = exports;
    const guard = (call) => (...numbers) => {
        const top = stack.value;
        try {
            return call(...numbers);
        } catch (error) {
            stack.value = top;
            const isTrap = error instanceof WebAssembly.RuntimeError && /unreachable/i.test(error.message);
            throw isTrap ? noMemory("this call", memory, { cause: error }) : error;
        }
    };
    const calls = Object.entries(exports).filter(([, call]) => typeof call === "function");
    return { memory, ...Object.fromEntries(calls.map(([name, call]) => [name, guard(call)])) };
}

async function compile(source) {
    // Node does not compile a DataView.
    if (ArrayBuffer.isView(source)) return WebAssembly.compile(new Uint8Array(source.buffer, source.byteOffset, source.byteLength));
    if (classOf(source) === "ArrayBuffer") return WebAssembly.compile(source);
    if (classOf(source) === "Response") return WebAssembly.compileStreaming(source);
    if (typeof source !== "string" && typeof source?.href !== "string") {
        throw new TypeError(`source: expected bth.wasm as its URL, a response, its bytes or a compiled module; found ${kindOf(source)}`);
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

/** A loaded module. */
export class Bth {
    #wasm;

    constructor(wasm, module) {
        this.#wasm = wasm;
        /** The compiled module, which workers can be sent. */
        this.module = module;
        this.simd = wasm.bth_has_vectors() === 1;
        // Rays, results and room for 14 numbers of 8 bytes.
        this.memory = { rays: wasm.bth_words(2 * CHUNK * RAY), results: wasm.bth_words(WORDS), numbers: wasm.bth_words(28) };
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

    #error() {
        const at = this.#wasm.bth_error() >>> 0;
        const bytes = new Uint8Array(this.#wasm.memory.buffer, at, this.#wasm.bth_error_length());
        return new BthError(new TextDecoder().decode(bytes));
    }
}

/** An open file. */
class Scene {
    #wasm;
    #memory;
    #scene;
    #error;
    /** Whether memory ended while the time was set, so that instances may be at different times. */
    #torn = false;

    constructor(wasm, memory, scene, error) {
        this.#wasm = wasm;
        this.#memory = memory;
        this.#scene = scene;
        this.#error = error;
        const numbers = this.#describe();
        this.objects = numbers[0];
        this.instances = numbers[1];
        this.triangles = numbers[2];
        this.frames = numbers[9] === 1 ? { first: numbers[10], last: numbers[11], rate: numbers[12] } : null;
    }

    get bounds() {
        const numbers = this.#describe();
        if (Number.isNaN(numbers[3])) return null;
        return { lower: [...numbers.subarray(3, 6)], upper: [...numbers.subarray(6, 9)] };
    }

    get seconds() {
        return this.#describe()[13];
    }

    set seconds(seconds) {
        if (!Number.isFinite(seconds)) {
            // The text of a string can look like a number.
            throw new TypeError(`seconds: expected a finite number, found ${typeof seconds === "number" ? seconds : kindOf(seconds)}`);
        }
        const scene = this.#open();
        this.#torn = true;
        const set = this.#wasm.bth_set_seconds(scene, seconds);
        this.#torn = false;
        if (set === 0) throw this.#error();
    }

    nearest(rays) {
        const count = countOf({ rays }, RAY, "Float32Array", "Float64Array"), numbers = numbersOf(rays);
        return this.#nearest(numbers === Float64Array ? this.#wasm.bth_nearest_f64 : this.#wasm.bth_nearest, count, copied(rays), numbers);
    }

    any(rays) {
        const count = countOf({ rays }, RAY, "Float32Array", "Float64Array"), numbers = numbersOf(rays);
        return this.#any(numbers === Float64Array ? this.#wasm.bth_any_f64 : this.#wasm.bth_any, count, copied(rays), numbers);
    }

    nearestStarts(starts, directions, tmax = Infinity) {
        return this.#nearest(this.#wasm.bth_nearest_starts, countOfStarts(starts, directions, tmax), startsCopied(starts, directions, tmax));
    }

    anyStarts(starts, directions, tmax = Infinity) {
        return this.#any(this.#wasm.bth_any_starts, countOfStarts(starts, directions, tmax), startsCopied(starts, directions, tmax));
    }

    /** The nearest hits of rays that `copy` copies, by one of the module's functions, with numbers of a class of arrays. */
    #nearest(trace, count, copy, numbers = Float32Array) {
        const hits = new Hits(count, numbers);
        const columns = HIT_NAMES.map((name) => hits[name]);
        this.#inChunks(count, numbers, copy, (from, n) => {
            trace(this.#scene, this.#memory.rays, n, this.#memory.results);
            this.#columns(columns, this.#memory.results, from, n);
        });
        return hits;
    }

    #any(trace, count, copy, numbers = Float32Array) {
        const found = new Uint8Array(count);
        this.#inChunks(count, numbers, copy, (from, n) => {
            trace(this.#scene, this.#memory.rays, n, this.#memory.results);
            found.set(new Uint8Array(this.#wasm.memory.buffer, this.#memory.results, n), from);
        });
        return found;
    }

    closest(points, radius = Infinity) {
        const count = countOf({ points }, POINT, "Float32Array", "Float64Array");
        if (typeof radius !== "number") throw new TypeError(`radius: expected a number; found ${kindOf(radius)}`);
        const closest = new Closest(count), { rays, results } = this.#memory;
        const { point, distance, u, v, instance, triangle, feature } = closest;
        this.#inChunks(count, Float64Array, copied(points, POINT), (from, n) => {
            this.#wasm.bth_closest(this.#scene, rays, n, radius, results);
            interleave([0, 1, 2].map((k) => new Float64Array(this.#wasm.memory.buffer, results + 8 * n * k, n)), point, from);
            this.#columns([distance, u, v, instance, triangle, feature], results + 24 * n, from, n);
        }, POINT);
        return closest;
    }

    winding(points) {
        const winding = new Int32Array(countOf({ points }, POINT, "Float32Array", "Float64Array"));
        this.#inChunks(winding.length, Float64Array, copied(points, POINT), (from, n) => {
            this.#wasm.bth_winding(this.#scene, this.#memory.rays, n, this.#memory.results);
            this.#columns([winding], this.#memory.results, from, n);
        }, POINT);
        return winding;
    }

    steps(rays) {
        const count = countOf({ rays }, RAY, "Float32Array");
        const steps = new Steps(count);
        const columns = [steps.nodes, steps.leaves, steps.triangles, steps.tets];
        this.#inChunks(count, Float32Array, copied(rays), (from, n) => {
            this.#wasm.bth_steps(this.#scene, this.#memory.rays, n, this.#memory.results);
            this.#columns(columns, this.#memory.results, from, n);
        });
        return steps;
    }

    surface(hits) {
        const scene = this.#open();
        checkHits(hits);
        const surface = new Surface(hits.count, numbersOf(hits.t));
        const { results } = this.#memory;
        const surfaces = results + 4 * CHUNK * HIT_COLUMNS;
        const columns = HIT_NAMES.map((name) => hits[name]);
        for (let from = 0; from < hits.count; from += CHUNK) {
            const n = Math.min(CHUNK, hits.count - from);
            columns.forEach((column, k) => {
                const of = k < 3 ? Float32Array : Uint32Array;
                new of(this.#wasm.memory.buffer, results + 4 * n * k, n).set(column.subarray(from, from + n));
            });
            this.#wasm.bth_surface(scene, results, n, surfaces);
            const { buffer } = this.#wasm.memory, others = surfaces + 24 * n;
            const words = (k) => new Float32Array(buffer, others + 4 * n * k, n);
            const { position, normal, geometricNormal, uv, color } = surface;
            interleave([0, 1, 2].map((k) => new Float64Array(buffer, surfaces + 8 * n * k, n)), position, from);
            interleave([0, 1, 2].map(words), normal, from);
            interleave([3, 4, 5].map(words), geometricNormal, from);
            interleave([6, 7].map(words), uv, from);
            interleave([8, 9, 10, 11].map(words), color, from);
            interleave([12, 13].map(words), surface.secondUv, from);
            this.#columns([surface.object, surface.group, surface.material], others + 4 * n * 14, from, n);
        }
        return surface;
    }

    materials(object) {
        return this.#rows("bth_material", object, (words, floats) => ({
            baseColor: [...floats.subarray(0, 4)],
            baseColorTexture: words[10] === NONE ? null : words[10],
            emissive: [...floats.subarray(4, 7)],
            emissiveTexture: words[11] === NONE ? null : words[11],
            alpha: ["opaque", "mask", "blend"][words[8]],
            alphaCutoff: floats[7],
            doubleSided: (words[9] & 1) !== 0,
            unlit: (words[9] & 2) !== 0,
        }));
    }

    textures(object) {
        return this.#rows("bth_texture", object, (words, floats) => ({
            image: words[2],
            wrap: [WRAPS[words[3]], WRAPS[words[4]]],
            filter: words[5] === 1 ? "nearest" : "linear",
            uvSet: words[6],
            transform: [...floats.subarray(7, 13)],
        }));
    }

    image(object, texture) {
        const scene = this.#open();
        checkIndex("object", object, this.objects);
        const words = this.#memory.numbers;
        if (!Number.isInteger(texture) || texture < 0 || texture >= NONE || this.#wasm.bth_texture(scene, object, texture, words) === 0) {
            throw new RangeError(`texture: expected the index of a texture of object ${object}; found ${String(texture)}`);
        }
        const [address, length] = new Uint32Array(this.#wasm.memory.buffer, words, 2);
        return new Uint8Array(this.#wasm.memory.buffer, address, length).slice();
    }

    /** What one of the module's functions writes about the parts of an object, until there are no more. */
    #rows(name, object, read) {
        const scene = this.#open();
        checkIndex("object", object, this.objects);
        const rows = [];
        while (this.#wasm[name](scene, object, rows.length, this.#memory.numbers) !== 0) {
            const words = new Uint32Array(this.#wasm.memory.buffer, this.#memory.numbers, 13);
            rows.push(read(words, new Float32Array(words.buffer, words.byteOffset, 13)));
        }
        return rows;
    }

    close() {
        const scene = this.#scene;
        this.#scene = 0;
        if (scene !== 0) this.#wasm.bth_close(scene);
    }

    /** The address of the scene. */
    #open() {
        if (this.#scene === 0) throw new BthError("the scene is closed");
        if (this.#torn) throw new BthError("memory ended while the time of the scene was set: it can only be closed");
        return this.#scene;
    }

    #describe() {
        this.#wasm.bth_describe(this.#open(), this.#memory.numbers);
        return new Float64Array(this.#wasm.memory.buffer.slice(this.#memory.numbers, this.#memory.numbers + 112));
    }

    /**
     * Copies a chunk of rays, or of points, after the other to the module, and calls `trace` with the index of its first one and its
     * length.
     */
    #inChunks(count, numbers, copy, trace, width = RAY) {
        this.#open();
        for (let from = 0; from < count; from += CHUNK) {
            const n = Math.min(CHUNK, count - from);
            copy(new numbers(this.#wasm.memory.buffer, this.#memory.rays, n * width), from, n);
            trace(from, n);
        }
    }

    /** Copies columns of `n` elements from the module to arrays of their kinds, from an index on. */
    #columns(arrays, address, from, n) {
        for (const array of arrays) {
            array.set(new array.constructor(this.#wasm.memory.buffer, address, n), from);
            address += n * array.BYTES_PER_ELEMENT;
        }
    }
}

/** What an argument is, for errors. */
function kindOf(value) {
    return value?.constructor?.name ?? String(value);
}

/** What an argument is, with its length where it is an array. */
function sizedKindOf(value) {
    if (classOf(value) === "DataView") return `DataView of ${value.byteLength} bytes`;
    return ArrayBuffer.isView(value) || Array.isArray(value) ? `${kindOf(value)} of ${value.length}` : kindOf(value);
}

/** The built-in class of a value, such as "Float32Array". Objects of other windows are instances of other classes of this name. */
function classOf(value) {
    return Object.prototype.toString.call(value).slice(8, -1);
}

/** The bytes of a file, which come as a buffer or as a view of one. */
function bytesOf(file) {
    const isView = ArrayBuffer.isView(file);
    if (!isView && !/^(Shared)?ArrayBuffer$/.test(classOf(file))) {
        const hint = typeof file?.then === "function" ? ": await it" : typeof file?.arrayBuffer === "function" ? ": await its arrayBuffer()" : "";
        throw new TypeError(`file: expected an ArrayBuffer or a view of one, with the bytes of a file; found ${kindOf(file)}${hint}`);
    }
    if (file.byteLength > MOST_FILE) {
        throw new BthError(`BTH-O001: expected a file of less than 2 GiB, which a module can hold in one piece; found ${file.byteLength} bytes`);
    }
    return isView ? new Uint8Array(file.buffer, file.byteOffset, file.byteLength) : new Uint8Array(file);
}

/** Refuses what is no index below a number. */
function checkIndex(name, index, count) {
    if (Number.isInteger(index) && index >= 0 && index < count) return;
    throw new RangeError(`${name}: expected an index below ${count}; found ${typeof index === "number" ? index : kindOf(index)}`);
}

/** The class of the numbers of rays or hits: Float64Array where the caller has that, else Float32Array. */
function numbersOf(array) {
    return classOf(array) === "Float64Array" ? Float64Array : Float32Array;
}

/** Number of rays or points of so many numbers in an array, which is of one of these classes. */
function countOf(given, width, ...classes) {
    const [[name, array]] = Object.entries(given);
    if (!classes.includes(classOf(array)) || array.length % width !== 0) {
        const numbers = width === RAY ? "eight numbers a ray (origin, tmin, direction, tmax)" : "three numbers a point";
        throw new TypeError(`${name}: expected a ${classes.join(" or ")} of ${numbers}; found ${sizedKindOf(array)}`);
    }
    if (array.length === 0 && isDetached(array.buffer)) throw new TypeError(`${name}: their buffer is detached; it was transferred`);
    return array.length / width;
}

/** A function that copies `n` rays, or points, from an index on to the module. */
function copied(rays, width = RAY) {
    return (to, from, n) => to.set(rays.subarray(from * width, (from + n) * width));
}

/** The same for rays that start on surfaces: instance, triangle, u, v, direction, tmax. */
function startsCopied({ instance, triangle, u, v }, directions, tmax) {
    return (to, from, n) => {
        const indices = new Uint32Array(to.buffer, to.byteOffset, to.length);
        for (let i = 0; i < n; i++) {
            const at = RAY * i, ray = from + i;
            indices[at] = instance[ray];
            indices[at + 1] = triangle[ray];
            to[at + 2] = u[ray];
            to[at + 3] = v[ray];
            for (let k = 0; k < 3; k++) to[at + 4 + k] = directions[3 * ray + k];
            to[at + 7] = typeof tmax === "number" ? tmax : tmax[ray];
        }
    };
}

/** Number of rays that start on surfaces. */
function countOfStarts(starts, directions, tmax) {
    const count = starts?.count;
    if (count === undefined) throw new TypeError(`starts: expected hits, or their columns instance, triangle, u, v and count; found ${kindOf(starts)}`);
    for (const name of ["u", "v", "instance", "triangle"]) {
        const of = name.length === 1 ? numbersOf(starts.u).name : "Uint32Array";
        checkColumn(`starts.${name}`, starts[name], of, count);
    }
    checkColumn("directions", directions, "Float32Array", 3 * count, "three numbers a ray");
    if (typeof tmax !== "number") checkColumn("tmax", tmax, "Float32Array", count, "or a number for all rays");
    return count;
}

/** Refuses what is no typed array of this class and length. */
function checkColumn(name, column, of, length, what = "as many as there are rays") {
    if (classOf(column) === of && column.length === length) return;
    throw new TypeError(`${name}: expected a ${of} of ${length} elements, ${what}; found ${sizedKindOf(column)}`);
}

/** Whether a buffer was transferred, for example to a worker. `detached` is younger than some of the supported programs. */
function isDetached(buffer) {
    try {
        new Uint8Array(buffer);
        return false;
    } catch {
        return true;
    }
}

/** Refuses hits whose columns are not those of their number of rays. */
function checkHits(hits) {
    if (hits?.count === undefined) throw new TypeError(`hits: expected the answer of nearest; found ${kindOf(hits)}`);
    HIT_NAMES.forEach((name, k) => checkColumn(`hits.${name}`, hits[name], k < 3 ? numbersOf(hits.t).name : "Uint32Array", hits.count));
}

/** Element k of the vector of hit i is element i of column k. */
function interleave(columns, to, from) {
    const width = columns.length;
    columns.forEach((column, k) => {
        for (let i = 0; i < column.length; i++) to[(from + i) * width + k] = column[i];
    });
}

/** Hits, an array for each of their numbers. */
export class Hits {
    constructor(count, numbers = Float32Array) {
        this.count = count;
        this.t = new numbers(count);
        this.u = new numbers(count);
        this.v = new numbers(count);
        this.instance = new Uint32Array(count);
        this.triangle = new Uint32Array(count);
    }
}

class Closest {
    constructor(count) {
        this.count = count;
        this.distance = new Float64Array(count);
        this.point = new Float64Array(POINT * count);
        this.u = new Float64Array(count);
        this.v = new Float64Array(count);
        this.instance = new Uint32Array(count);
        this.triangle = new Uint32Array(count);
        this.feature = new Uint32Array(count);
    }
}

class Steps {
    constructor(count) {
        this.count = count;
        this.nodes = new Uint32Array(count);
        this.leaves = new Uint32Array(count);
        this.triangles = new Uint32Array(count);
        this.tets = new Uint32Array(count);
    }
}

class Surface {
    constructor(count, numbers) {
        this.count = count;
        this.position = new numbers(3 * count);
        this.normal = new Float32Array(3 * count);
        this.geometricNormal = new Float32Array(3 * count);
        this.uv = new Float32Array(2 * count);
        this.color = new Float32Array(4 * count);
        this.secondUv = new Float32Array(2 * count);
        this.object = new Uint32Array(count);
        this.group = new Uint32Array(count);
        this.material = new Uint32Array(count);
    }
}
