/** A module of WebAssembly with the library, for one thread. */
export class Bth {
    private constructor();
    /** The compiled module. Send it to workers, and `load` it there. */
    readonly module: CompiledModule;
    /** Whether the module has vector instructions (SIMD128). */
    readonly simd: boolean;
    /**
     * Opens a compiled file, of which it keeps a copy. All indices are checked, so that no file can make tracing unsafe.
     * @throws TypeError for anything but bytes, such as a promise of them.
     * @throws BthError with a code of the specification if the file is damaged or too new; with BTH-O001 if the memory is too small, or
     * the file has 2 GiB or more.
     */
    open(file: ArrayBufferLike | ArrayBufferView): Scene;
    /**
     * A scene of instances of other scenes, which share their files. Instance i shows the first
     * object of `scenes[which[i]]`, or of the only scene.
     * @param transforms 16 numbers a matrix, column by column, as three.js and WebGL have them. A
     * matrix whose nine numbers of direction are 0 hides its instance.
     * @throws BthError with BTH-S001 for another matrix that cannot be inverted.
     */
    instances(scenes: Scene | Scene[], transforms: Float32Array | Float64Array, which?: ArrayLike<number>): Scene;
}

/**
 * Loads the library.
 * @param source bth.wasm: its URL (a relative one from index.js on), a response with it of the type application/wasm, its bytes, or a
 * module that is already compiled; or a promise of one of them. By default the file that lies beside index.js.
 * @throws TypeError for anything else. What fetching, reading or compiling it throws is passed on.
 */
export function load(source?: ModuleSource | Promise<ModuleSource>): Promise<Bth>;

/** Where the module comes from. */
export type ModuleSource = string | UrlLike | ResponseLike | ArrayBuffer | ArrayBufferView | CompiledModule;

// These stand for types that only the library "dom" of TypeScript and the types of node have, which a program may do without.

/** A WebAssembly.Module. */
export type CompiledModule = object;

/** A URL. */
export interface UrlLike {
    readonly href: string;
}

/** A Response. */
export interface ResponseLike {
    readonly status: number;
    arrayBuffer(): Promise<ArrayBuffer>;
}

/** What the library refuses. */
export class BthError extends Error {
    /** The stable code of the error, such as "BTH-F001"; empty if it has none. */
    readonly code: string;
}

/**
 * An open file. Rays are a Float32Array of eight numbers each: origin x, y, z, least t, direction x, y, z, greatest t, in world
 * space. Directions need not be normalized; t is in units of their length. Rays in a Float64Array are not rounded, and their hits have
 * t, u and v in a Float64Array, too. About a thousand coherent rays that are adjacent, such as
 * a tile of a picture, are traced fastest. Answers are exact, and the same bits as on every other machine. Queries throw a BthError
 * with BTH-O001 where the memory is too small for them, and can be asked again when other scenes were closed. They throw a TypeError
 * for rays of another kind, or whose buffer was transferred.
 */
export interface Scene {
    /** Number of objects. */
    readonly objects: number;
    /** Number of instances; without scene sections that of objects. */
    readonly instances: number;
    /** Number of triangles of all objects. */
    readonly triangles: number;
    /** First and last frame, and frames per second; null if the file is a model. */
    readonly frames: { first: number; last: number; rate: number } | null;
    /** Box in world space that contains what can be seen at the scene's time; null if that is nothing. */
    readonly bounds: { lower: Vector; upper: Vector } | null;
    /**
     * The scene's time in seconds; at first that of its first frame. It may lie outside of the frames: nothing moves beyond them.
     * @throws TypeError unless it is a finite number.
     * @throws BthError if it is set where `frames` are null: a model has no time.
     * @throws BthError if an instance cannot be placed at that time; the scene is then unchanged. With BTH-O001 if the memory is too
     * small; the scene can then only be closed.
     */
    seconds: number;
    /** The nearest hit of each ray. */
    nearest(rays: Float32Array): Hits;
    /**
     * The nearest hit of each ray in double: the one with the smallest exact t. t has a relative
     * error of at most 2^-40; u and v are off by at most 2^-28. A t beyond the range of a float is
     * not hit.
     */
    nearest(rays: Float64Array): Hits<Float64Array>;
    /** For each ray 1 if it hits anything, else 0. */
    any(rays: Float32Array | Float64Array): Uint8Array;
    /**
     * The nearest hits of rays that start on surfaces: at the exact points of `starts`, such as
     * hits of this scene. Such a ray hits what lies at t > 0: never the surface that it leaves, and
     * it never skips a wall. It needs no offset and no least t. A ray is a miss if its start is not
     * a point of a visible instance; the start of a miss is not. u and v in double are rounded to
     * floats first.
     * @param directions Three numbers a ray, of any length except zero; t is in units of that
     * length.
     * @param tmax The largest t of all rays, or of each; infinite by default.
     * @throws TypeError unless each array has its type and as many elements as there are rays.
     */
    nearestStarts(starts: Starts, directions: Float32Array, tmax?: number | Float32Array): Hits;
    /**
     * The nearest hit of one ray: true if there is one, which is then written to `hit`. The ray is
     * eight numbers, and they are not rounded; t, u and v are as for a Float64Array of rays. Nothing
     * is allocated: use the same ray and hit again.
     * @param side What can be hit; "both" by default. The front is the side from which a triangle's
     * vertices are seen counter-clockwise. It is decided exactly.
     */
    nearestOne(ray: ArrayLike<number>, hit: Partial<Hit>, side?: Side): boolean;
    /** As `nearestOne`: true if the ray hits anything. */
    anyOne(ray: ArrayLike<number>, side?: Side): boolean;
    /**
     * Calls a function with each hit of one ray, in order of t; returns their number. Nothing is
     * allocated. The function must not ask this module for the hits of another ray.
     */
    eachHit(ray: ArrayLike<number>, visit: (t: number, u: number, v: number, instance: number, triangle: number) => void, side?: Side): number;
    /** All hits of one ray, in order of t. */
    allHits(ray: ArrayLike<number>, side?: Side): Hits<Float64Array>;
    /** As `nearestStarts`: for each ray 1 if it hits anything, else 0. */
    anyStarts(starts: Starts, directions: Float32Array, tmax?: number | Float32Array): Uint8Array;
    /**
     * The closest point of the triangles to each point, with a distance of at most `radius`. Points
     * are three numbers each, in world space; floats are taken as they are. The triangle is the one
     * with the smallest exact distance. A distance is off by at most 2^-40 of itself plus the
     * triangle's longest edge, and by at most 2^-28 of itself.
     */
    closest(points: Float32Array | Float64Array, radius?: number): Closest;
    /**
     * How often the closed surfaces of the scene enclose each point, decided exactly: not 0 where it
     * lies inside. 0 for points that are not finite.
     */
    winding(points: Float32Array | Float64Array): Int32Array;
    /** True if a triangle overlaps a closed box, decided exactly. */
    overlapsBox(lower: ArrayLike<number>, upper: ArrayLike<number>): boolean;
    /** True if a triangle overlaps a closed ball, decided exactly. */
    overlapsSphere(center: ArrayLike<number>, radius: number): boolean;
    /** The triangles that overlap a closed box, by ascending instance and triangle. */
    trianglesInBox(lower: ArrayLike<number>, upper: ArrayLike<number>): Triangles;
    /** The triangles that overlap a closed ball, by ascending instance and triangle. */
    trianglesInSphere(center: ArrayLike<number>, radius: number): Triangles;
    /**
     * Walks through the tree of an object, in the space of the object. The calls decide where it goes; boxes are six numbers, the lower and
     * the upper end, and contain all triangles below them.
     * @returns True if `triangle` has returned true, which ends the walk.
     * @throws BthError if the file has tetrahedra.
     */
    shapecast(calls: {
        /** 0 or false passes a box by, 1 or true goes on below it, 2 takes all below it without asking again. */
        bounds(box: Float64Array, isLeaf: boolean, score: number | undefined, depth: number, node: number): boolean | 0 | 1 | 2;
        /** True ends the walk. */
        triangle(triangle: number, isContained: boolean, depth: number): boolean | void;
        /** A number for a box; the children of a node are visited in ascending order of it. */
        order?(box: Float64Array): number;
    }, object?: number): boolean;
    /** The number of vertices that `setPositions` expects; null if the object is not deformable. */
    vertices(object?: number): number | null;
    /**
     * Gives an object that was compiled as deformable new positions, three numbers a vertex, in the
     * order of the source. Boxes are computed again; all queries then answer for them.
     * @throws BthError with BTH-S006 if it is not deformable, BTH-S007 for a wrong number of
     * positions or one that is not finite. The scene is then unchanged.
     */
    setPositions(positions: Float32Array, object?: number): void;
    /**
     * Moves instances of a scene of `bth.instances`, from `first` on.
     * @throws BthError for another scene, and with BTH-S001 for a matrix that cannot be inverted.
     */
    setTransforms(transforms: Float32Array | Float64Array, first?: number): void;
    /** What the search for the nearest hit of each ray visits. */
    steps(rays: Float32Array): Steps;
    /**
     * The surface at hits of this scene at its present time. Any object with the columns of hits will do, such as a copy from a worker.
     * @throws TypeError unless each column has its type and `count` elements.
     */
    surface(hits: Hits): Surface;
    /**
     * The same for hits of rays in double, with positions in double. u and v are rounded to floats
     * first: positions are off by less than 2^-23 of the triangle's longest edge.
     */
    surface(hits: Hits<Float64Array>): Surface<Float64Array>;
    /**
     * How the materials of an object look, by their indices; none if the file was compiled without `--materials`.
     * @throws RangeError unless there is such an object.
     */
    materials(object: number): Material[];
    /**
     * The textures of an object, by their indices.
     * @throws RangeError unless there is such an object.
     */
    textures(object: number): Texture[];
    /**
     * A copy of the image file of a texture: PNG, JPEG or WebP. Red, green and blue of its texels are sRGB, alpha is linear.
     * @throws RangeError unless there is such an object and texture.
     */
    image(object: number, texture: number): Uint8Array;
    /** Frees the scene's memory. All other methods throw from then on. */
    close(): void;
}

/** Which sides of triangles a ray hits. */
export type Side = "both" | "front" | "back";

/** The hit of one ray. */
export interface Hit {
    t: number;
    u: number;
    v: number;
    instance: number;
    triangle: number;
}

/** A list of triangles. */
export interface Triangles {
    readonly count: number;
    readonly instance: Uint32Array;
    readonly triangle: Uint32Array;
}

export type Vector = [x: number, y: number, z: number];

/** Nearest hits, each array with one element for each ray; `Numbers` is the class of the rays. */
export class Hits<Numbers extends Float32Array | Float64Array = Float32Array> {
    /** @param numbers The class of t, u and v; Float32Array by default. */
    constructor(count: number, numbers?: new (count: number) => Numbers);
    /** Number of rays. */
    readonly count: number;
    /** t of the hit; infinite for a miss. */
    readonly t: Numbers;
    /** Barycentric weight of the triangle's second vertex. */
    readonly u: Numbers;
    /** Barycentric weight of the triangle's third vertex. */
    readonly v: Numbers;
    /** Index of the instance; 0xffffffff for a miss. */
    readonly instance: Uint32Array;
    /** Index of the triangle in the source file; 0xffffffff for a miss. */
    readonly triangle: Uint32Array;
}

/**
 * Points of surfaces at which rays start, each array with one element for each ray. Hits are
 * starts. A start is the exact point a + u(b - a) + v(c - a) of the triangle with the vertices a, b
 * and c.
 */
export type Starts = Pick<Hits | Hits<Float64Array>, "count" | "u" | "v" | "instance" | "triangle">;

/**
 * Closest points, in double. Where there is none, the distance is infinite, other numbers are NaN, and indices 0xffffffff: for a point
 * that is not finite, and for a radius that is negative or NaN.
 */
export interface Closest {
    readonly count: number;
    /** Distance in world space. */
    readonly distance: Float64Array;
    /** The closest point in world space, 3 numbers each. */
    readonly point: Float64Array;
    /** Barycentric weight of the triangle's second vertex. */
    readonly u: Float64Array;
    /** Barycentric weight of the triangle's third vertex. */
    readonly v: Float64Array;
    /** Index of the instance. */
    readonly instance: Uint32Array;
    /** Index of the triangle in the source file. */
    readonly triangle: Uint32Array;
    /**
     * Where on the triangle: 0 inside, 1 to 3 on the edge from the first, second or third vertex to
     * the next, 4 to 6 at that vertex.
     */
    readonly feature: Uint32Array;
}

/** Numbers of nodes, leaves, triangles and tetrahedra that each ray visits. */
export interface Steps {
    readonly count: number;
    readonly nodes: Uint32Array;
    readonly leaves: Uint32Array;
    readonly triangles: Uint32Array;
    readonly tets: Uint32Array;
}

/**
 * The surface at each hit. A miss has NaN and 0xffffffff, and so has what the file does not keep: texture coordinates without
 * `--attributes`, materials without `--names` or `--materials`.
 */
export interface Surface<Numbers extends Float32Array | Float64Array = Float32Array> {
    readonly count: number;
    /** Points in world space, 3 numbers a hit. */
    readonly position: Numbers;
    /** Normals of the source, interpolated, in world space; those of the triangles where it has none. Length 1. */
    readonly normal: Float32Array;
    /** Normals of the triangles' planes, in world space. Length 1. */
    readonly geometricNormal: Float32Array;
    /** Texture coordinates, 2 numbers a hit. */
    readonly uv: Float32Array;
    /** Linear red, green, blue and alpha: the material's factor times the colour at the vertices, without textures; else 1. */
    readonly color: Float32Array;
    /** Texture coordinates of the second set, 2 numbers a hit, for textures whose `uvSet` is 1. */
    readonly secondUv: Float32Array;
    /** Index of the object. */
    readonly object: Uint32Array;
    /** Index of the group of triangles; 0 if the file keeps no groups. */
    readonly group: Uint32Array;
    /** Index of the object's material. */
    readonly material: Uint32Array;
}

/** How a material looks. Colours are linear, with the primaries of sRGB. */
export interface Material {
    /** To be multiplied by the texel of the texture and the colour at the vertices; `Surface.color` has the product without the texel. */
    readonly baseColor: [red: number, green: number, blue: number, alpha: number];
    /** Index of the base colour's texture; null without one. */
    readonly baseColorTexture: number | null;
    /** Emitted radiance, to be multiplied by the texel of its texture. */
    readonly emissive: [red: number, green: number, blue: number];
    readonly emissiveTexture: number | null;
    /** What alpha means: nothing; a surface where it is at least `alphaCutoff`; the share of light that the surface stops. */
    readonly alpha: "opaque" | "mask" | "blend";
    readonly alphaCutoff: number;
    /** Whether the back of triangles is seen too. */
    readonly doubleSided: boolean;
    /** Whether the base colour is shown as it is, without light. */
    readonly unlit: boolean;
    /** Null in files without glossy materials. */
    readonly gloss: Gloss | null;
}

/** How glossy a material is, as in glTF 2.0, and the textures that shape its surface. Their texels are linear. */
export interface Gloss {
    /** From 0 to 1, to be multiplied by blue of the texture. */
    readonly metallic: number;
    /** From 0, smooth, to 1; to be multiplied by green of the texture. */
    readonly roughness: number;
    readonly metallicRoughnessTexture: number | null;
    /** Red to the right, green up, blue out of the surface, 0 to 1 for -1 to 1. */
    readonly normalTexture: number | null;
    /** Factor of the first two components of these normals. */
    readonly normalScale: number;
    /** Red is the share of light from all around that reaches the surface. */
    readonly occlusionTexture: number | null;
    /** How much that counts, from 0 to 1. */
    readonly occlusionStrength: number;
}

/** A texture. */
export interface Texture {
    /** Index of its image: equal for textures of the same image, whichever object of a file they belong to. `Scene.image` has its bytes. */
    readonly image: number;
    /** How coordinates beyond 0 and 1 find texels, for u and for v. */
    readonly wrap: ["repeat" | "mirror" | "clamp", "repeat" | "mirror" | "clamp"];
    /** Whether the nearest texel is taken, or four are interpolated after they have been made linear. */
    readonly filter: "nearest" | "linear";
    /** 0 for `Surface.uv`, 1 for `Surface.secondUv`. */
    readonly uvSet: number;
    /**
     * Rows of the transform from (u, v, 1) to coordinates of the image, six numbers. There (0, 0) is the upper left corner, (1, 1) the lower
     * right one, and the middle of texel (i, j) is at ((i + ½) / width, (j + ½) / height).
     */
    readonly transform: number[];
}
