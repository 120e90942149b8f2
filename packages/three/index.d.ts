import type {
    BatchedMesh, Box3, BufferGeometry, InstancedMesh, Intersection, Material, Matrix4, Mesh, Object3D, Ray, Raycaster, Side, Sphere,
    Triangle, Vector3,
} from "three";
import type { ModuleSource, Scene } from "bth";

/**
 * Loads bth.wasm, and with `compiler` compile.wasm on this thread, too. Functions that do not wait
 * need it.
 */
export function ready(options?: {
    /** True to load what `computeBoundsTree` and `new BoundsTree` need. */
    compiler?: boolean;
    /** bth.wasm, as `load` of the package bth takes it. */
    wasm?: ModuleSource | Promise<ModuleSource>;
    /** compile.wasm: its URL, or a module that is compiled. */
    compilerWasm?: string | object;
}): Promise<void>;

/** How a tree is made. */
export interface TreeOptions {
    /** True to follow new positions by `refit`. Trees of meshes always do. */
    deformable?: boolean;
    /** The part of the index that is taken; by default the geometry's draw range. */
    range?: { start: number; count: number };
    /** Called with each warning; by default they go to the console. */
    onWarning?: (text: string) => void;
}

/** What `intersectsBounds` of `shapecast` says of a box. */
export const NOT_INTERSECTED: 0, INTERSECTED: 1, CONTAINED: 2;

/** The closest point of a surface. */
export interface ClosestPoint {
    point: Vector3;
    distance: number;
    faceIndex: number;
}

/** A tree of a geometry, or of a mesh whose skin or morph targets pose it. */
export class BoundsTree {
    /**
     * Compiles on this thread (`await ready({ compiler: true })` first), or opens a file.
     * @param source A mesh is taken in its present pose.
     * @param options `file`: the bytes of a .bth file of exactly these triangles.
     * @throws Error if the modules are not loaded, or the file has another number of triangles.
     */
    constructor(source: BufferGeometry | Mesh, options?: TreeOptions & { file?: ArrayBufferLike | ArrayBufferView });
    readonly geometry: BufferGeometry;
    /** The mesh that poses the vertices, if there is one. */
    readonly mesh: Mesh | null;
    /** The open file, for queries of many rays and points in the space of the geometry. */
    readonly scene: Scene;
    /** Adds the intersections of an object, as `Mesh.raycast` does. */
    raycastObject3D(object: Object3D, raycaster: Raycaster, intersects?: Intersection[]): Intersection[];
    /** All intersections in the space of the geometry, by ascending face. */
    raycast(ray: Ray, materialOrSide?: Side | Material | Material[], near?: number, far?: number): Intersection[];
    /** The nearest intersection in the space of the geometry. */
    raycastFirst(ray: Ray, materialOrSide?: Side | Material | Material[], near?: number, far?: number): Intersection | null;
    /** The closest point; null if none is within `maxThreshold`. `minThreshold` has no effect. */
    closestPointToPoint(point: Vector3, target?: Partial<ClosestPoint>, minThreshold?: number, maxThreshold?: number): ClosestPoint | null;
    /** True if a point is inside of a closed surface, decided exactly. */
    contains(point: Vector3): boolean;
    /** True if a triangle overlaps a box: exactly, unless `boxToTree` turns it. */
    intersectsBox(box: Box3, boxToTree?: Matrix4): boolean;
    /** True if a triangle overlaps a ball, decided exactly. */
    intersectsSphere(sphere: Sphere): boolean;
    /** The faces that overlap a box or a ball, ascending. */
    facesInBox(box: Box3): number[];
    facesInSphere(sphere: Sphere): number[];
    /**
     * Walks through the tree as `shapecast` of three-mesh-bvh does, in the space of the geometry. Nodes have up to 16 children. There is no
     * `intersectsRange`: the triangles of a leaf are not neighbours in the index.
     * @returns True if `intersectsTriangle` has returned true, which ends the walk.
     */
    shapecast(calls: {
        /** NOT_INTERSECTED or false, INTERSECTED or true, or CONTAINED, which takes all below without asking again. */
        intersectsBounds(box: Box3, isLeaf: boolean, score: number | undefined, depth: number, nodeIndex: number): boolean | 0 | 1 | 2;
        /** True ends the walk. The triangle is valid during the call. */
        intersectsTriangle?(triangle: Triangle, triangleIndex: number, contained: boolean, depth: number): boolean | void;
        /** Children are visited in ascending order of it. */
        boundsTraverseOrder?(box: Box3): number;
    }): boolean;
    /** The triangle of a face. */
    triangle(face: number, target?: Triangle): Triangle;
    /**
     * Follows new positions of the geometry, or a new pose of the mesh. A tree that was not made as
     * `deformable` is compiled again the first time.
     */
    refit(): void;
    /** The box around all triangles. */
    getBoundingBox(target?: Box3): Box3;
    /** Frees the memory of the tree at once. Otherwise it is freed when nobody holds the tree. */
    dispose(): void;
}

/** A tree over the instances of an InstancedMesh. It has the positions for which the geometry's tree was compiled. */
export class InstancedTree {
    /** @param tree The tree of the mesh's geometry. */
    constructor(mesh: InstancedMesh, tree: BoundsTree);
    /** The instances, in the space of the mesh. */
    readonly scene: Scene;
    /** Follows the matrices of `count` instances from `first` on; by default all. */
    update(first?: number, count?: number): void;
    raycastObject3D(mesh: InstancedMesh, raycaster: Raycaster, intersects?: Intersection[]): Intersection[];
    dispose(): void;
}

/**
 * Stands in for `raycast` of Mesh, SkinnedMesh, InstancedMesh and BatchedMesh. Where there is no
 * tree, it calls the function of three.js. With `raycaster.firstHitOnly` it finds the nearest only.
 */
export function acceleratedRaycast(this: Mesh, raycaster: Raycaster, intersects: Intersection[]): void;
/** For `BufferGeometry.prototype`: compiles now, on this thread. */
export function computeBoundsTree(this: BufferGeometry, options?: TreeOptions): BoundsTree;
/** Compiles in a worker, and sets `boundsTree` of the geometry, or of the mesh in its pose. */
export function computeBoundsTreeAsync(source: BufferGeometry | Mesh, options?: TreeOptions): Promise<BoundsTree>;
/** For `BufferGeometry.prototype` and `Mesh.prototype`: frees the tree. */
export function disposeBoundsTree(this: BufferGeometry | Mesh): void;
/** For `InstancedMesh.prototype`: a tree over all instances. */
export function computeInstancedBoundsTree(this: InstancedMesh, options?: TreeOptions): InstancedTree;
/** For `BatchedMesh.prototype`: a tree for one geometry, or for all with -1. */
export function computeBatchedBoundsTree(this: BatchedMesh, index?: number, options?: TreeOptions): BoundsTree | BoundsTree[] | null;
/** For `BatchedMesh.prototype`: frees the tree of one geometry, or all with -1. */
export function disposeBatchedBoundsTree(this: BatchedMesh, index?: number): void;

declare module "three" {
    interface BufferGeometry {
        boundsTree?: BoundsTree | null;
        computeBoundsTree: typeof computeBoundsTree;
        disposeBoundsTree: typeof disposeBoundsTree;
    }
    interface Mesh {
        boundsTree?: BoundsTree | InstancedTree | null;
    }
    interface BatchedMesh {
        boundsTrees?: (BoundsTree | null)[];
    }
    interface Raycaster {
        firstHitOnly?: boolean;
    }
}
