// The names of three-mesh-bvh over this package, for its own tests; see foreign.config.mjs.
import { Vector3 } from "three";
import { BoundsTree, computeBatchedBoundsTree as computeBatched, ready } from "@bth/three";

export { acceleratedRaycast, disposeBatchedBoundsTree, disposeBoundsTree } from "@bth/three";
export const [CENTER, AVERAGE, SAH] = [0, 1, 2], [NOT_INTERSECTED, INTERSECTED, CONTAINED] = [0, 1, 2];

// There, functions that do not wait need no preparation.
await ready({ compiler: true });

/** Of its options the range has a counterpart; the others are about its builder. */
export class MeshBVH extends BoundsTree {
    constructor(geometry, { range } = {}) {
        super(geometry, { range });
    }
}
export const SkinnedMeshBVH = MeshBVH;
export function computeBoundsTree(options) {
    return (this.boundsTree = new MeshBVH(this, options));
}
export function computeBatchedBoundsTree(index) {
    return computeBatched.call(this, index);
}

/** There: if boxes of nodes contain their triangles. Here: if all vertices, as floats, lie on the surface of the tree. */
export function validateBounds(bvh) {
    const { geometry, mesh } = bvh, { position } = geometry.attributes, vertex = new Vector3();
    for (let i = 0; i < position.count; i++) {
        if (mesh) mesh.getVertexPosition(i, vertex);
        else vertex.fromBufferAttribute(position, i);
        if (bvh.closestPointToPoint(vertex.set(...Float32Array.of(...vertex)))?.distance !== 0) return false;
    }
    return true;
}
export const getBVHExtremes = () => [{ depth: { max: 0 } }];
