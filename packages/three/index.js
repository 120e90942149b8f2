// Exact raycasts, closest points and inside tests for three.js; see index.d.ts.

export { ready } from "./engine.js";
export {
    acceleratedRaycast, computeBatchedBoundsTree, computeBoundsTree, computeBoundsTreeAsync, computeInstancedBoundsTree,
    disposeBatchedBoundsTree, disposeBoundsTree,
} from "./raycast.js";
export { BoundsTree, CONTAINED, INTERSECTED, InstancedTree, NOT_INTERSECTED } from "./tree.js";
