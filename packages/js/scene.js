// What can be asked of an open file.

import { BthError, HIT_NAMES, POINT, RAY, checkHits, checkIndex, copied, countOf, countOfStarts, kindOf, numbersOf, sizedKindOf, startsCopied } from "./checks.js";
import { Closest, Hits, Steps, Surface } from "./results.js";

/** Rays that are copied to the module at a time: they stay in the caches. */
export const CHUNK = 4096;
/** Columns of hits for `bth_surface`, and words of a surface. */
const HIT_COLUMNS = 5, SURFACE_WORDS = 23;
/** Words of memory that a chunk needs at most: hits and their surfaces. */
export const WORDS = CHUNK * (HIT_COLUMNS + SURFACE_WORDS);

/** What stands for no texture, no triangle and no vertices. */
const NONE = 0xffffffff;
/** How texture coordinates beyond 0 and 1 find texels. */
const WRAPS = ["repeat", "mirror", "clamp"];

/** Words that a material or a texture has at most. */
const ROW_WORDS = 19;

/** Children of a node at most, and bytes of their boxes and codes. */
const NODE_WIDTH = 16, NODE_BYTES = NODE_WIDTH * (8 * 6 + 4);

/** An index, or null for none. */
const orNull = (index) => (index === NONE ? null : index);
/** The sides that a ray hits, by their number in the module. */
const SIDES = { both: 0, front: 1, back: 2 };
/** Numbers of an instance in the module: the rows of its transform, and its object. */
const INSTANCE = 13;

/** An open file, or instances that a program places. */
export class Scene {
    #wasm;
    #memory;
    #scene;
    #error;
    /** What holds the scene, if a program places its instances; else 0. */
    #builder;
    /** Whether memory ended while the time was set, so that instances may be at different times. */
    #torn = false;

    constructor(wasm, memory, scene, error, builder = 0) {
        this.#builder = builder;
        this.#wasm = wasm;
        this.#memory = memory;
        this.#scene = scene;
        this.#error = error;
        const numbers = this.#describe();
        this.objects = numbers[0];
        this.triangles = numbers[2];
        this.frames = numbers[9] === 1 ? { first: numbers[10], last: numbers[11], rate: numbers[12] } : null;
    }

    get instances() {
        return this.#describe()[1];
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
        if (!this.frames) throw new BthError("seconds: this file is a model without frames, which has no time; compile a scene or an animation");
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

    nearestOne(ray, hit, side) {
        const scene = this.#open(), memory = this.#memory;
        this.#copyRay(ray);
        const triangle = this.#wasm.bth_nearest_one(scene, memory.rays, sideOf(side), memory.results) >>> 0;
        if (triangle === NONE) return false;
        const { numbers, indices } = this.#views();
        hit.t = numbers[0];
        hit.u = numbers[1];
        hit.v = numbers[2];
        hit.instance = indices[6];
        hit.triangle = triangle;
        return true;
    }

    anyOne(ray, side) {
        this.#copyRay(ray);
        return this.#wasm.bth_any_one(this.#open(), this.#memory.rays, sideOf(side)) === 1;
    }

    eachHit(ray, visit, side) {
        const scene = this.#open();
        this.#copyRay(ray);
        const count = this.#wasm.bth_all_hits(scene, this.#memory.rays, sideOf(side));
        if (count === 0) return 0;
        const { floats, words } = this.#views(), first = this.#wasm.bth_hits() >>> 3;
        for (let i = 0, at = first; i < count; i++, at += 4) visit(floats[at], floats[at + 1], floats[at + 2], words[2 * at + 6], words[2 * at + 7]);
        return count;
    }

    allHits(ray, side) {
        const rows = [];
        this.eachHit(ray, (...numbers) => rows.push(numbers), side);
        const hits = new Hits(rows.length, Float64Array);
        HIT_NAMES.forEach((name, k) => hits[name].set(rows.map((row) => row[k])));
        return hits;
    }

    /** Views of the module's memory: one ray, its hit, and all of it. They are made again when it has grown, which detaches them. */
    #views() {
        const memory = this.#memory;
        if (memory.views === null || memory.views.ray.length === 0) {
            const { buffer } = this.#wasm.memory;
            memory.views = {
                ray: new Float64Array(buffer, memory.rays, RAY),
                numbers: new Float64Array(buffer, memory.results, 3),
                indices: new Uint32Array(buffer, memory.results, 8),
                floats: new Float64Array(buffer, 0, buffer.byteLength >>> 3),
                words: new Uint32Array(buffer),
            };
        }
        return memory.views;
    }

    /** Copies the numbers of a ray to the module. */
    #copyRay(ray) {
        if (ray?.length !== RAY) throw new TypeError(`ray: expected eight numbers (origin, tmin, direction, tmax); found ${sizedKindOf(ray)}`);
        const to = this.#views().ray;
        for (let k = 0; k < RAY; k++) to[k] = ray[k];
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

    overlapsBox(lower, upper) {
        return this.#wasm.bth_overlaps_box(this.#open(), this.#vectors(lower, upper)) === 1;
    }

    overlapsSphere(center, radius) {
        return this.#wasm.bth_overlaps_sphere(this.#open(), this.#vectors(center), radius) === 1;
    }

    trianglesInBox(lower, upper) {
        return this.#triangles(this.#wasm.bth_triangles_in_box(this.#open(), this.#vectors(lower, upper)));
    }

    trianglesInSphere(center, radius) {
        return this.#triangles(this.#wasm.bth_triangles_in_sphere(this.#open(), this.#vectors(center), radius));
    }

    /** Copies vectors to the module; their address. */
    #vectors(...vectors) {
        const to = new Float64Array(this.#wasm.memory.buffer, this.#memory.numbers, POINT * vectors.length);
        vectors.forEach((vector, i) => to.set(vector, POINT * i));
        return this.#memory.numbers;
    }

    /** The last list of triangles. */
    #triangles(count) {
        const pairs = new Uint32Array(this.#wasm.memory.buffer, this.#wasm.bth_triangles(), 2 * count);
        const column = (k) => Uint32Array.from({ length: count }, (_, i) => pairs[2 * i + k]);
        return { count, instance: column(0), triangle: column(1) };
    }

    shapecast({ bounds, triangle, order }, object = 0) {
        const scene = this.#open();
        checkIndex("object", object, this.objects);
        const root = this.#wasm.bth_root(scene, object);
        if (root === NONE) return false;
        /** Visits what a code leads to. Callbacks may query the scene, so what is found is copied. */
        const visit = (code, depth, isContained) => {
            const room = this.#wasm.bth_room(NODE_BYTES);
            const found = this.#wasm.bth_node(scene, object, code, room) >>> 0;
            if (found === NONE) throw new BthError("shapecast: the file has tetrahedra (hint: compile it with --structure bvh)");
            const { buffer } = this.#wasm.memory, count = found & 0xff;
            const ids = new Uint32Array(buffer, room + 8 * 6 * NODE_WIDTH, count).slice();
            if (found > 0xff) {
                for (const id of ids) if (triangle(id, isContained, depth)) return true;
                return false;
            }
            const boxes = new Float64Array(buffer, room, 6 * count).slice();
            const children = Array.from(ids, (code, k) => {
                const box = boxes.subarray(6 * k, 6 * k + 6);
                return { code, box, score: order && !isContained ? order(box) : undefined };
            });
            if (order && !isContained) children.sort((one, other) => one.score - other.score);
            for (const { code, box, score } of children) {
                // The highest bit is set in the codes of leaves.
                const answer = isContained ? 2 : Number(bounds(box, code >>> 31 === 1, score, depth + 1, code));
                if (answer !== 0 && visit(code, depth + 1, answer === 2)) return true;
            }
            return false;
        };
        return visit(root, 0, false);
    }

    vertices(object = 0) {
        checkIndex("object", object, this.objects);
        const count = this.#wasm.bth_vertex_count(this.#open(), object) >>> 0;
        return count === NONE ? null : count;
    }

    setPositions(positions, object = 0) {
        const scene = this.#open(), count = countOf({ positions }, POINT, "Float32Array");
        checkIndex("object", object, this.objects);
        const room = this.#wasm.bth_room(positions.byteLength);
        new Float32Array(this.#wasm.memory.buffer, room, positions.length).set(positions);
        if (this.#wasm.bth_set_positions(scene, object, count) === 0) throw this.#error();
    }

    setTransforms(transforms, first = 0) {
        if (this.#builder === 0) throw new BthError("setTransforms: only instances of bth.instances(...) can be moved");
        this.#place(transforms, first, null);
    }

    /** Places instances from `first` on; those that are new are of the objects that a function names. */
    #place(transforms, first, objectOf) {
        this.#open();
        const count = countOf({ transforms }, 16, "Float32Array", "Float64Array"), there = this.instances;
        if (!objectOf && first + count > there) checkIndex("first + number of transforms - 1", first + count - 1, there);
        const room = this.#wasm.bth_room(8 * INSTANCE * count);
        const to = new Float64Array(this.#wasm.memory.buffer, room, INSTANCE * count);
        for (let i = 0; i < count; i++) {
            for (let row = 0; row < 3; row++) {
                for (let column = 0; column < 4; column++) to[INSTANCE * i + 4 * row + column] = transforms[16 * i + 4 * column + row];
            }
            to[INSTANCE * i + 12] = objectOf?.(i) ?? 0;
        }
        if (this.#wasm.bth_builder_place(this.#builder, first, count) === 0) throw this.#error();
    }

    static placed(wasm, memory, error, scenes, transforms, which) {
        const count = countOf({ transforms }, 16, "Float32Array", "Float64Array");
        if (which && which.length !== count) throw new TypeError(`which: expected ${count} indices of scenes, one a transform; found ${which.length}`);
        for (let i = 0; i < count; i++) checkIndex(`which[${i}]`, which?.[i] ?? 0, scenes.length);
        const addresses = scenes.map((scene) => scene.#open());
        const builder = wasm.bth_builder_new();
        const firsts = addresses.map((address) => wasm.bth_builder_add(builder, address));
        const placed = new Scene(wasm, memory, wasm.bth_builder_scene(builder), error, builder);
        try {
            placed.#place(transforms, 0, (i) => firsts[which?.[i] ?? 0]);
        } catch (error) {
            placed.close();
            throw error;
        }
        return placed;
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
            baseColorTexture: orNull(words[10]),
            emissive: [...floats.subarray(4, 7)],
            emissiveTexture: orNull(words[11]),
            alpha: ["opaque", "mask", "blend"][words[8]],
            alphaCutoff: floats[7],
            doubleSided: (words[9] & 1) !== 0,
            unlit: (words[9] & 2) !== 0,
            gloss: (words[9] & 4) === 0 ? null : {
                metallic: floats[12],
                roughness: floats[13],
                metallicRoughnessTexture: orNull(words[16]),
                normalTexture: orNull(words[17]),
                normalScale: floats[14],
                occlusionTexture: orNull(words[18]),
                occlusionStrength: floats[15],
            },
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
            const words = new Uint32Array(this.#wasm.memory.buffer, this.#memory.numbers, ROW_WORDS);
            rows.push(read(words, new Float32Array(words.buffer, words.byteOffset, ROW_WORDS)));
        }
        return rows;
    }

    close() {
        const scene = this.#scene;
        this.#scene = 0;
        if (scene === 0) return;
        if (this.#builder !== 0) this.#wasm.bth_builder_close(this.#builder);
        else this.#wasm.bth_close(scene);
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

/** A scene of instances of other scenes. */
export const placed = Scene.placed;

/** The number of a side. */
function sideOf(side) {
    if (side === undefined) return 0;
    const found = SIDES[side];
    if (found === undefined) throw new TypeError(`side: expected "both", "front" or "back"; found ${String(side)}`);
    return found;
}

/** Element k of the vector of hit i is element i of column k. */
function interleave(columns, to, from) {
    const width = columns.length;
    columns.forEach((column, k) => {
        for (let i = 0; i < column.length; i++) to[(from + i) * width + k] = column[i];
    });
}
