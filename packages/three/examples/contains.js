// Which of many points are inside a closed mesh: exact, so that the share of points inside tells the volume.
import * as THREE from "three";
import { computeBoundsTreeAsync, ready } from "@bth/three";
import { counted, done, model, random, report, stage } from "./common.js";

await ready();
const COUNT = 30_000, { scene, run } = stage({ eye: [0.6, 1.2, 6.2], target: [0, 0.1, 0], background: 0x1b2430 });
const knot = model(new THREE.TorusKnotGeometry(1, 0.36, 500, 60));
const tree = await computeBoundsTreeAsync(knot.geometry), box = tree.getBoundingBox(), size = box.getSize(new THREE.Vector3());

const next = random(3), points = new Float64Array(3 * COUNT);
for (let i = 0; i < points.length; i++) points[i] = box.min.getComponent(i % 3) + next() * size.getComponent(i % 3);
const start = performance.now(), winding = tree.scene.winding(points), milliseconds = performance.now() - start;

// Points inside are balls, coloured by where they are; others are dust.
const inside = winding.reduce((sum, w) => sum + (w !== 0 ? 1 : 0), 0);
const balls = new THREE.InstancedMesh(new THREE.IcosahedronGeometry(0.03, 0), new THREE.MeshStandardMaterial({ roughness: 0.5 }), inside);
const dust = new THREE.BufferGeometry(), outside = [], matrix = new THREE.Matrix4(), color = new THREE.Color();
for (let i = 0, k = 0; i < COUNT; i++) {
    const [x, y, z] = points.subarray(3 * i, 3 * i + 3);
    if (winding[i] === 0) {
        if (i % 3 === 0) outside.push(x, y, z);
        continue;
    }
    balls.setMatrixAt(k, matrix.makeTranslation(x, y, z));
    balls.setColorAt(k++, color.setHSL(0.01 + 0.13 * (y - box.min.y) / size.y, 0.95, 0.5));
}
dust.setAttribute("position", new THREE.Float32BufferAttribute(outside, 3));
scene.add(balls, new THREE.Points(dust, new THREE.PointsMaterial({ size: 0.014, color: 0x6f8499 })));

/** The volume by the divergence theorem: exact up to roundings. */
function volume(geometry) {
    const triangle = new THREE.Triangle(), cross = new THREE.Vector3();
    let sum = 0;
    for (let face = 0; face < geometry.index.count / 3; face++) {
        const { a, b, c } = tree.triangle(face, triangle);
        sum += a.dot(cross.crossVectors(b, c)) / 6;
    }
    return Math.abs(sum);
}
const found = (inside / COUNT) * size.x * size.y * size.z, expected = volume(knot.geometry);
report(`${counted(inside)} of ${counted(COUNT)} points are inside, in ${milliseconds.toFixed(0)} ms\n` +
    `volume by counting ${found.toFixed(3)}, by integration ${expected.toFixed(3)}`);
run(() => {
    scene.rotation.y += 0.002;
    done({ found, expected });
});
