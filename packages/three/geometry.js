// The triangles of a BufferGeometry, as the compiler takes them.

import { Vector3 } from "three";

const vertex = new Vector3();

/**
 * The positions of a geometry, or of a mesh in its present pose, as three numbers a vertex. The
 * array is the geometry's own where it has that form.
 */
export function positionsOf(geometry, mesh) {
    const { position } = geometry.attributes;
    const { count } = position;
    if (!mesh && position.array instanceof Float32Array && !position.isInterleavedBufferAttribute && position.itemSize === 3) {
        return position.array.length === 3 * count ? position.array : position.array.subarray(0, 3 * count);
    }
    const isWide = !mesh && position.array instanceof Float64Array;
    const positions = new (isWide ? Float64Array : Float32Array)(3 * count);
    for (let i = 0; i < count; i++) vertexOf(i, position, mesh).toArray(positions, 3 * i);
    return positions;
}

/** A vertex of a geometry, or of a mesh in its present pose. */
export function vertexOf(i, position, mesh, to = vertex) {
    return mesh ? mesh.getVertexPosition(i, to) : to.fromBufferAttribute(position, i);
}

/** First and last vertex index that are drawn, of `range` or of the geometry's draw range. */
export function rangeOf(geometry, { start, count } = geometry.drawRange) {
    const all = (geometry.index ?? geometry.attributes.position).count;
    const first = Math.max(0, start), end = Math.min(all, start + count);
    return { first, count: Math.max(0, 3 * Math.floor((end - first) / 3)) };
}

/**
 * The arrays that the compiler takes, of the triangles of a range. All vertices are among them: a
 * tree that follows new positions is told all.
 */
export function sourceOf(geometry, mesh, range) {
    return { positions: positionsOf(geometry, mesh), indices: indicesOf(geometry, range) };
}

/** The corners of the triangles of a range; null where these are all vertices in order. */
export function indicesOf(geometry, { first, count }) {
    const { index } = geometry;
    if (!index) {
        if (first === 0 && count === geometry.attributes.position.count) return null;
        return Uint32Array.from({ length: count }, (_, i) => first + i);
    }
    if (index.isInterleavedBufferAttribute) throw new Error("@bth/three: an interleaved index is not supported");
    const { array } = index;
    const isPlain = array instanceof Uint32Array || array instanceof Uint16Array || array instanceof Uint8Array;
    return isPlain ? array.subarray(first, first + count) : Uint32Array.from(array.subarray(first, first + count));
}

/** The three vertices of a triangle. */
export function cornersOf(geometry, face, to) {
    const { index } = geometry;
    for (let k = 0; k < 3; k++) to[k] = index ? index.getX(3 * face + k) : 3 * face + k;
    return to;
}
