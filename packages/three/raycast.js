// Functions that are put into the prototypes of three.js.

import { BatchedMesh, InstancedMesh, Mesh, SkinnedMesh, Sphere } from "three";
import { compileAsync } from "./engine.js";
import { rangeOf, sourceOf } from "./geometry.js";
import { BoundsTree, InstancedTree } from "./tree.js";

/** The functions of three.js, which are called where there is no tree. */
const original = new Map([BatchedMesh, InstancedMesh, SkinnedMesh, Mesh].map((of) => [of, of.prototype.raycast]));
const single = new Mesh();
const found = [];

/** Stands in for `raycast` of Mesh, SkinnedMesh, InstancedMesh and BatchedMesh. */
export function acceleratedRaycast(raycaster, intersects) {
    if (this.isBatchedMesh && this.boundsTrees) return raycastBatch(this, raycaster, intersects);
    const own = this.boundsTree;
    if (own) return void own.raycastObject3D(this, raycaster, intersects);
    const tree = this.geometry.boundsTree;
    const isPosed = this.isSkinnedMesh || this.isInstancedMesh || this.isBatchedMesh || isMorphed(this);
    if (tree && !isPosed && (tree.fits?.() ?? true)) return void tree.raycastObject3D(this, raycaster, intersects);
    const [, plain] = [...original].find(([of]) => this instanceof of) ?? [];
    if (!plain) throw new TypeError(`acceleratedRaycast: expected a Mesh; found ${this.type}`);
    plain.call(this, raycaster, intersects);
}

/** True if morph targets move vertices. */
function isMorphed({ geometry, morphTargetInfluences }) {
    return geometry.morphAttributes.position !== undefined && (morphTargetInfluences?.some((share) => share !== 0) ?? false);
}

/** Each visible instance of a BatchedMesh, by the tree of its geometry where it has one. */
function raycastBatch(mesh, raycaster, intersects) {
    const { geometry, boundsTrees, matrixWorld, material } = mesh;
    const { drawRange, boundingBox, boundingSphere } = geometry;
    single.material = material;
    single.geometry = geometry;
    try {
        for (let id = 0; id < mesh._instanceInfo.length; id++) {
            const { visible, active, geometryIndex } = mesh._instanceInfo[id];
            if (!visible || !active) continue;
            mesh.getMatrixAt(id, single.matrixWorld).premultiply(matrixWorld);
            const tree = boundsTrees[geometryIndex];
            if (tree) {
                tree.raycastObject3D(single, raycaster, found);
            } else {
                const { start, count } = mesh.getGeometryRangeAt(geometryIndex);
                geometry.drawRange = { start, count };
                geometry.boundingBox = null;
                geometry.boundingSphere = mesh.getBoundingSphereAt(geometryIndex, sphere);
                original.get(Mesh).call(single, raycaster, found);
            }
            for (const intersection of found) {
                intersection.object = mesh;
                intersection.batchId = id;
                intersects.push(intersection);
            }
            found.length = 0;
        }
    } finally {
        Object.assign(geometry, { drawRange, boundingBox, boundingSphere });
        single.geometry = single.material = undefined;
        found.length = 0;
    }
}
const sphere = new Sphere();

/** `BufferGeometry.prototype.computeBoundsTree`: compiles now, on this thread. */
export function computeBoundsTree(options) {
    this.boundsTree?.dispose?.();
    return (this.boundsTree = new BoundsTree(this, options));
}

/** Compiles in a worker; sets and returns the tree of a geometry or of a posed mesh. */
export async function computeBoundsTreeAsync(source, { deformable = source.isMesh === true, range, onWarning } = {}) {
    const geometry = source.isMesh ? source.geometry : source;
    const mesh = sourceOf(geometry, source.isMesh ? source : null, rangeOf(geometry, range));
    const file = await compileAsync(mesh, { deformable, ...(onWarning && { onWarning }) });
    source.boundsTree?.dispose?.();
    return (source.boundsTree = new BoundsTree(source, { range, file }));
}

/** `disposeBoundsTree` of geometries and meshes: frees the tree. */
export function disposeBoundsTree() {
    this.boundsTree?.dispose?.();
    this.boundsTree = null;
}

/** `InstancedMesh.prototype.computeBoundsTree`: a tree over all instances. */
export function computeInstancedBoundsTree(options) {
    this.boundsTree?.dispose?.();
    const tree = this.geometry.boundsTree ?? computeBoundsTree.call(this.geometry, options);
    return (this.boundsTree = new InstancedTree(this, tree));
}

/** `BatchedMesh.prototype.computeBoundsTree`: a tree for one geometry, or for all with -1. */
export function computeBatchedBoundsTree(index = -1, options = {}) {
    const trees = (this.boundsTrees ??= []);
    const count = this._geometryInfo.length;
    for (let id = 0; id < count; id++) {
        if ((index >= 0 && id !== index) || this._geometryInfo[id].active === false) continue;
        trees[id]?.dispose();
        const { start, count } = this.getGeometryRangeAt(id);
        trees[id] = new BoundsTree(this.geometry, { ...options, range: { start, count } });
    }
    return index < 0 ? trees : (trees[index] ?? null);
}

/** `BatchedMesh.prototype.disposeBoundsTree`: frees the tree of one geometry, or all with -1. */
export function disposeBatchedBoundsTree(index = -1) {
    this.boundsTrees?.forEach((tree, id) => {
        if (index >= 0 && id !== index) return;
        tree?.dispose();
        this.boundsTrees[id] = null;
    });
}
