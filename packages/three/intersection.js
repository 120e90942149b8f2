// Intersections as three.js makes them, of triangles that a tree has found.

import { BackSide, FrontSide, Triangle, Vector2, Vector3 } from "three";
import { cornersOf, vertexOf } from "./geometry.js";

const a = new Vector3(), b = new Vector3(), c = new Vector3();
const local = new Vector3(), world = new Vector3();
const corners = [0, 0, 0];

/** The side of a material as queries name it. */
export function sideOf(side) {
    return side === FrontSide ? "front" : side === BackSide ? "back" : "both";
}

/**
 * The intersection of a ray with triangle `face`, whose hit the tree has decided; null if its
 * distance is not from `near` to `far`. The point is computed as three.js does, with the same bits;
 * where its rounding misses the triangle, it is the point with the weights u and v.
 *
 * @param {{geometry, mesh}} tree What was hit; `mesh` if it is posed.
 * @param ray The ray in the space of the geometry.
 * @param {{u: number, v: number}} hit
 * @param {{origin, matrixWorld, near, far}} world Where distances are measured; null matrix: here.
 */
export function intersectionOf(tree, face, side, ray, hit, { origin, matrixWorld, near, far }) {
    const { geometry, mesh } = tree, { position, uv, uv1, normal } = geometry.attributes;
    const [i, j, k] = cornersOf(geometry, face, corners);
    vertexOf(i, position, mesh, a);
    vertexOf(j, position, mesh, b);
    vertexOf(k, position, mesh, c);
    const [p, r] = side === BackSide ? [c, a] : [a, c];
    const isOneSided = side === BackSide || side === FrontSide;
    if (ray.intersectTriangle(p, b, r, isOneSided, local) === null) {
        local.copy(a).multiplyScalar(1 - hit.u - hit.v).addScaledVector(b, hit.u).addScaledVector(c, hit.v);
    }
    world.copy(local);
    if (matrixWorld) world.applyMatrix4(matrixWorld);
    const distance = origin.distanceTo(world);
    if (distance < near || distance > far) return null;
    const barycoord = new Vector3();
    Triangle.getBarycoord(local, a, b, c, barycoord);
    const found = { distance, point: world.clone(), object: null };
    if (uv) found.uv = Triangle.getInterpolatedAttribute(uv, i, j, k, barycoord, new Vector2());
    if (uv1) found.uv1 = Triangle.getInterpolatedAttribute(uv1, i, j, k, barycoord, new Vector2());
    if (normal) {
        found.normal = Triangle.getInterpolatedAttribute(normal, i, j, k, barycoord, new Vector3());
        if (found.normal.dot(ray.direction) > 0) found.normal.negate();
    }
    found.face = { a: i, b: j, c: k, normal: Triangle.getNormal(a, b, c, new Vector3()), materialIndex: 0 };
    found.barycoord = barycoord;
    found.faceIndex = face;
    return found;
}
