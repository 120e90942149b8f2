// Rays from inside a closed mesh, each aimed exactly at a vertex or at the middle of an edge. Each must hit. A ray that does not has leaked.
import * as THREE from "three";
import { MeshBVH } from "three-mesh-bvh";
import { BoundsTree, ready } from "@bth/three";
import { counted, done, model, random, report, stage } from "./common.js";

await ready({ compiler: true });
const { scene, run } = stage({ eye: [0, 1.2, 6.4], target: [0, 0.25, 0] });
const geometry = new THREE.IcosahedronGeometry(1, 14), positions = geometry.attributes.position, vertex = new THREE.Vector3();
for (let i = 0; i < positions.count; i++) {
    vertex.fromBufferAttribute(positions, i);
    const lump = 1 + 0.09 * Math.sin(7 * vertex.x) * Math.sin(6 * vertex.y + 1) * Math.sin(8 * vertex.z);
    positions.setXYZ(i, ...vertex.multiplyScalar(lump));
}
geometry.computeVertexNormals();
const ours = new BoundsTree(geometry), theirs = new MeshBVH(geometry.clone());

/** The test of Möller and Trumbore in float32, as shaders run it, for all triangles. */
function plain(o, d) {
    const f = Math.fround, p = positions.array;
    const dot = (ax, ay, az, bx, by, bz) => f(f(f(ax * bx) + f(ay * by)) + f(az * bz));
    const minor = (a, b, c, d) => f(f(a * d) - f(b * c));
    for (let i = 0; i < p.length; i += 9) {
        const e1x = f(p[i + 3] - p[i]), e1y = f(p[i + 4] - p[i + 1]), e1z = f(p[i + 5] - p[i + 2]);
        const e2x = f(p[i + 6] - p[i]), e2y = f(p[i + 7] - p[i + 1]), e2z = f(p[i + 8] - p[i + 2]);
        const px = minor(d.y, d.z, e2y, e2z), py = minor(d.z, d.x, e2z, e2x), pz = minor(d.x, d.y, e2x, e2y);
        const inverse = f(1 / dot(e1x, e1y, e1z, px, py, pz));
        const sx = f(o.x - p[i]), sy = f(o.y - p[i + 1]), sz = f(o.z - p[i + 2]), u = f(dot(sx, sy, sz, px, py, pz) * inverse);
        if (!(u >= 0 && u <= 1)) continue;
        const qx = minor(sy, sz, e1y, e1z), qy = minor(sz, sx, e1z, e1x), qz = minor(sx, sy, e1x, e1y);
        const v = f(dot(d.x, d.y, d.z, qx, qy, qz) * inverse);
        if (v >= 0 && f(u + v) <= 1 && dot(e2x, e2y, e2z, qx, qy, qz) * inverse > 0) return true;
    }
    return false;
}

const next = random(1), RAYS = 12_000, ray = new THREE.Ray(), hit = {}, numbers = new Float64Array(8);
const leaks = { ours: [], plain: [] };
let ofOthers = 0;
numbers[7] = Infinity;
for (let i = 0; i < RAYS; i++) {
    const corner = Math.floor(next() * positions.count), other = 3 * Math.floor(corner / 3) + ((corner + 1) % 3);
    vertex.fromBufferAttribute(positions, corner);
    if (i & 1) vertex.add(ray.origin.fromBufferAttribute(positions, other)).multiplyScalar(0.5);
    // All three get the same numbers: floats.
    for (const axis of ["x", "y", "z"]) {
        ray.origin[axis] = Math.fround(0.8 * (next() - 0.5));
        ray.direction[axis] = Math.fround(vertex[axis] - ray.origin[axis]);
    }
    ray.origin.toArray(numbers, 0);
    ray.direction.toArray(numbers, 4);
    if (!ours.scene.nearestOne(numbers, hit)) leaks.ours.push(vertex.clone());
    if (!plain(ray.origin, ray.direction)) leaks.plain.push(vertex.clone());
    if (!theirs.raycastFirst(ray, THREE.DoubleSide)) ofOthers++;
}

// Both side by side, with a red needle where a ray got out.
const needle = new THREE.CylinderGeometry(0.005, 0.005, 0.5, 5).translate(0, 0.25, 0);
const up = new THREE.Vector3(0, 1, 0), turn = new THREE.Quaternion(), matrix = new THREE.Matrix4(), one = new THREE.Vector3(1, 1, 1);
const halves = Object.values(leaks).map((points, side) => {
    const half = new THREE.Group(), needles = new THREE.InstancedMesh(needle, new THREE.MeshBasicMaterial({ color: 0xd11a1a }), points.length);
    points.forEach((point, i) => {
        turn.setFromUnitVectors(up, vertex.copy(point).normalize());
        needles.setMatrixAt(i, matrix.compose(point, turn, one));
    });
    half.add(model(geometry, side === 0 ? 0x4fa36b : 0xb9bfc9), needles);
    half.position.x = side === 0 ? -1.6 : 1.6;
    scene.add(half);
    return half;
});
report(`${counted(RAYS)} rays at vertices and edges of ${counted(positions.count / 3)} triangles, leaks: left bth ${leaks.ours.length},\n` +
    `right Möller-Trumbore in float32 ${counted(leaks.plain.length)}; three-mesh-bvh, in float64, ${ofOthers}`);
run(() => {
    for (const half of halves) half.rotation.y += 0.003;
    done({ ours: leaks.ours.length, plain: leaks.plain.length, share: leaks.plain.length / RAYS });
});
