// A lidar that turns in a room: 64 beams, a sweep of 1,024 steps in one call.
import * as THREE from "three";
import { mergeGeometries } from "three/addons/utils/BufferGeometryUtils.js";
import { TeapotGeometry } from "three/addons/geometries/TeapotGeometry.js";
import { computeBoundsTreeAsync, ready } from "@bth/three";
import { counted, done, random, report, stage } from "./common.js";

await ready();
const BEAMS = 64, STEPS = 1024, COUNT = BEAMS * STEPS, { scene, run } = stage({ eye: [5.2, 6.4, 8.2], target: [0, 0.4, 0], background: 0x10151c });

// A hall without a ceiling: floor, walls, columns, crates, and a pot in its middle.
const next = random(8), parts = [];
const box = (w, h, d, x, y, z, turn = 0) => parts.push(new THREE.BoxGeometry(w, h, d).rotateY(turn).translate(x, y, z));
box(10, 0.1, 8, 0, -0.05, 0);
for (const side of [-1, 1]) {
    box(10, 2.6, 0.1, 0, 1.3, 4 * side);
    box(0.1, 2.6, 8, 5 * side, 1.3, 0);
    for (let i = -2; i <= 2; i++) parts.push(new THREE.CylinderGeometry(0.16, 0.2, 2.6, 24).translate(1.9 * i, 1.3, 2.6 * side));
}
for (let i = 0; i < 26; i++) {
    const s = 0.25 + 0.35 * next(), angle = 6.3 * next(), r = 1.6 + 1.9 * next();
    box(s, s, s, 1.25 * r * Math.cos(angle), s / 2, r * Math.sin(angle), 3 * next());
}
parts.push(new TeapotGeometry(0.55, 12).translate(1.3, 0.55, 0.2), new THREE.TorusKnotGeometry(0.4, 0.13, 160, 24).translate(-1.5, 0.75, -0.5));
const geometry = mergeGeometries(parts.map((part) => part.toNonIndexed()));
const tree = await computeBoundsTreeAsync(geometry);
scene.add(new THREE.Mesh(geometry, new THREE.MeshStandardMaterial({ color: 0x5c7088, roughness: 1, transparent: true, opacity: 0.16, side: THREE.DoubleSide, depthWrite: false })));

const rays = new Float32Array(8 * COUNT), sensor = new THREE.Vector3();
const cloud = new THREE.BufferGeometry();
const points = new THREE.BufferAttribute(new Float32Array(3 * COUNT), 3), colors = new THREE.BufferAttribute(new Float32Array(3 * COUNT), 3);
cloud.setAttribute("position", points).setAttribute("color", colors);
const shown = new THREE.Points(cloud, new THREE.PointsMaterial({ size: 0.028, vertexColors: true, toneMapped: false }));
shown.frustumCulled = false;
const head = new THREE.Mesh(new THREE.CylinderGeometry(0.09, 0.09, 0.16, 24), new THREE.MeshStandardMaterial({ color: 0xffffff, emissive: 0x55ff99 }));
scene.add(shown, head);
const tone = new THREE.Color();

/** One turn of the lidar at a place; the number of points that it measures. */
function sweep() {
    for (let i = 0; i < COUNT; i++) {
        // Neighbours in the array are neighbours in space: tiles of 8 by 8.
        const tile = i >> 6, beam = 8 * (tile % (BEAMS / 8)) + ((i >> 3) & 7), step = 8 * Math.floor(tile / (BEAMS / 8)) + (i & 7);
        const up = -0.75 + (1.15 * beam) / BEAMS, around = (2 * Math.PI * step) / STEPS, flat = Math.cos(up);
        rays.set([sensor.x, sensor.y, sensor.z, 0.1, flat * Math.cos(around), Math.sin(up), flat * Math.sin(around), 30], 8 * i);
    }
    const start = performance.now(), { t } = tree.scene.nearest(rays), milliseconds = performance.now() - start;
    let hits = 0, nearest = Infinity;
    for (let i = 0; i < COUNT; i++) {
        if (t[i] === Infinity) {
            points.setXYZ(i, 0, -99, 0);
            continue;
        }
        hits++;
        nearest = Math.min(nearest, t[i]);
        for (let k = 0; k < 3; k++) points.array[3 * i + k] = rays[8 * i + k] + t[i] * rays[8 * i + 4 + k];
        tone.setHSL(0.02 + Math.min(0.7, 0.13 * t[i]), 0.95, 0.56).toArray(colors.array, 3 * i);
    }
    points.needsUpdate = colors.needsUpdate = true;
    report(`${counted(hits)} points of ${counted(COUNT)} beams in ${milliseconds.toFixed(1)} ms: ` +
        `${(COUNT / milliseconds / 1000).toFixed(1)} million a second\nnearest obstacle ${nearest.toFixed(2)} m away`);
    return { hits, nearest };
}

run((seconds) => {
    sensor.set(2.4 * Math.cos(0.3 * seconds), 1.05, 1.3 * Math.sin(0.3 * seconds));
    head.position.copy(sensor);
    done(sweep());
});
