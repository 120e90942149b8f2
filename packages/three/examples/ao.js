// Bakes ambient occlusion into vertex colours. Rays start exactly at the vertices, so there is no offset to choose.
import * as THREE from "three";
import { TeapotGeometry } from "three/addons/geometries/TeapotGeometry.js";
import { mergeVertices } from "three/addons/utils/BufferGeometryUtils.js";
import { computeBoundsTreeAsync, ready } from "@bth/three";
import { counted, done, random, report, stage } from "./common.js";

await ready();
const ROUNDS = 128, { scene, run } = stage({ eye: [2.8, 2.3, 5.2], target: [0, -0.1, 0], background: 0x8fa3b8 });

// A pot on a plate, as one mesh, with a normal at each vertex.
const pot = new TeapotGeometry(1, 22), plate = new THREE.CylinderGeometry(2.3, 2.4, 0.14, 160, 1).translate(0, -1.07, 0);
const disk = new THREE.RingGeometry(0.001, 2.3, 160, 60).rotateX(-Math.PI / 2).translate(0, -0.999, 0);
const positions = [], indices = [];
for (const part of [pot, plate, disk]) {
    const first = positions.length / 3;
    positions.push(...part.attributes.position.array);
    indices.push(...Array.from(part.index.array, (i) => first + i));
}
let geometry = new THREE.BufferGeometry().setAttribute("position", new THREE.Float32BufferAttribute(positions, 3)).setIndex(indices);
geometry = mergeVertices(geometry, 1e-5);
geometry.computeVertexNormals();
const { position, normal } = geometry.attributes, { count } = position;
const tree = await computeBoundsTreeAsync(geometry);

// Each vertex is a corner of some triangle with an area: weights u and v of 0 or 1 are its exact place.
const starts = { count, instance: new Uint32Array(count), triangle: new Uint32Array(count).fill(0xffffffff), u: new Float32Array(count), v: new Float32Array(count) };
const { array } = geometry.index, face = new THREE.Triangle();
for (let i = 0; i < array.length; i++) {
    const triangle = Math.floor(i / 3);
    if (tree.triangle(triangle, face).getArea() === 0) continue;
    starts.triangle[array[i]] = triangle;
    starts.u[array[i]] = i % 3 === 1 ? 1 : 0;
    starts.v[array[i]] = i % 3 === 2 ? 1 : 0;
}

const next = random(5), directions = new Float32Array(3 * count), open = new Float32Array(count);
const first = Float32Array.from({ length: 2 * count }, next);
const colors = new THREE.BufferAttribute(new Float32Array(3 * count).fill(1), 3), n = new THREE.Vector3(), d = new THREE.Vector3();
geometry.setAttribute("color", colors);
const material = new THREE.MeshBasicMaterial({ vertexColors: true, side: THREE.DoubleSide });
scene.add(new THREE.Mesh(geometry, material));

/** Ray k of each vertex, more often along the normal than aside (cosine). Rays of a vertex spread evenly (the sequence R2). */
function round(k) {
    for (let i = 0; i < count; i++) {
        const z = 2 * ((first[2 * i] + 0.7548776662 * k) % 1) - 1, angle = 2 * Math.PI * (first[2 * i + 1] + 0.569840291 * k), r = Math.sqrt(1 - z * z);
        n.fromBufferAttribute(normal, i);
        d.set(r * Math.cos(angle), r * Math.sin(angle), z).addScaledVector(n, 1.0001).normalize().toArray(directions, 3 * i);
    }
    const dark = tree.scene.anyStarts(starts, directions);
    for (let i = 0; i < count; i++) open[i] += 1 - dark[i];
}

let rounds = 0, milliseconds = 0;
run(() => {
    if (rounds === ROUNDS) return;
    for (let k = 0; k < 32; k++, rounds++) {
        const start = performance.now();
        round(rounds);
        milliseconds += performance.now() - start;
    }
    for (let i = 0; i < count; i++) {
        const light = (open[i] / rounds) ** 2, dark = 1 - light;
        colors.setXYZ(i, 1.1 * light + 0.04 * dark, 0.98 * light + 0.06 * dark, 0.82 * light + 0.16 * dark);
    }
    colors.needsUpdate = true;
    report(`${counted(array.length / 3)} triangles, ${counted(rounds * count)} rays from ${counted(count)} vertices, ` +
        `${((rounds * count) / milliseconds / 1000).toFixed(2)} million a second`);
    if (rounds === ROUNDS) done({ mean: open.reduce((sum, x) => sum + x, 0) / count / rounds });
});
