// A machine cut open. Rays start at the cutting plane, and what the plane cuts is filled: winding numbers tell what is solid.
import * as THREE from "three";
import { mergeGeometries } from "three/addons/utils/BufferGeometryUtils.js";
import { load } from "bth";
import { CompilerWorker } from "bth/compile";
import { cameraRays, counted, done, picture, report } from "./common.js";

/** Parts, each a closed mesh with a colour: a bearing with balls between two rings on a shaft, in a housing. */
const ring = (inner, outer, half) => new THREE.LatheGeometry(
    [[inner, -half], [outer, -half], [outer, half], [inner, half], [inner, -half]].map(([x, y]) => new THREE.Vector2(x, y)), 120);
const balls = Array.from({ length: 11 }, (_, i) => new THREE.SphereGeometry(0.185, 40, 28).translate(
    0.98 * Math.cos((2 * Math.PI * i) / 11 + 0.2), 0, 0.98 * Math.sin((2 * Math.PI * i) / 11 + 0.2)));
const closed = (geometry) => geometry.toNonIndexed();
const parts = [
    { geometry: closed(new THREE.CylinderGeometry(0.52, 0.52, 2.2, 100)), color: 0x9aa4ae },
    { geometry: closed(ring(0.525, 0.78, 0.34)), color: 0x4d7fb8 },
    { geometry: mergeGeometries(balls.map(closed)), color: 0xe0a030 },
    { geometry: closed(ring(1.18, 1.44, 0.34)), color: 0x4d7fb8 },
    { geometry: closed(ring(1.445, 1.75, 0.62)), color: 0xc2513f },
    { geometry: closed(ring(0.56, 1.44, 0.1).translate(0, 0.5, 0)), color: 0x5d9c59 },
];
const bth = await load(), worker = new CompilerWorker();
for (const part of parts) part.scene = bth.open(await worker.compile(part.geometry.attributes.position.array));
worker.close();
const identity = Float32Array.from(parts.flatMap(() => new THREE.Matrix4().elements)), color = new THREE.Color();
const scene = bth.instances(parts.map((part) => part.scene), identity, parts.map((_, i) => i));
const colors = parts.map((part) => color.set(part.color).toArray());

let cut = 0.12, angle = 0.75;
const eye = () => [5.2 * Math.sin(angle), 3.1, 5.2 * Math.cos(angle)];
// The plane stands upright and looks at the camera's side: its points have n·p = cut.
const n = [0.35, 0, 0.937], sun = new THREE.Vector3(0.5, 0.8, 0.45).normalize(), { canvas, redraw } = picture(draw);

function draw(data, width, height) {
    const from = eye(), { rays, pixelOf } = cameraRays(from, [0, -0.1, 0], width, height, 36), count = pixelOf.length, start = performance.now();
    const dot = (a, i) => n[0] * a[i] + n[1] * a[i + 1] + n[2] * a[i + 2];
    // Where each ray crosses the plane: it sees only what is behind.
    const points = new Float64Array(3 * count), ahead = dot(from, 0) - cut;
    for (let i = 0; i < count; i++) {
        const towards = dot(rays, 8 * i + 4), t = -ahead / towards;
        if (ahead > 0 && towards < 0) rays[8 * i + 3] = t;
        else if (ahead > 0) rays[8 * i + 7] = -1;
        for (let k = 0; k < 3; k++) points[3 * i + k] = from[k] + t * rays[8 * i + 4 + k];
    }
    const hits = scene.nearest(rays), { normal } = scene.surface(hits), solid = parts.map((part) => part.scene.winding(points));
    const milliseconds = performance.now() - start;
    let filled = 0;
    for (let i = 0; i < count; i++) {
        const part = rays[8 * i + 7] < 0 ? -1 : solid.findIndex((winding) => winding[i] !== 0);
        let rgb = [0.82 - 0.1 * (pixelOf[i] / count), 0.86 - 0.1 * (pixelOf[i] / count), 0.9 - 0.08 * (pixelOf[i] / count)];
        if (part >= 0) {
            // Hatched as in drawings, the other way for each part.
            const x = (points[3 * i] * n[2] - points[3 * i + 2] * n[0]) * (part % 2 ? 1 : -1), stripe = (((x + points[3 * i + 1]) * 9) % 1 + 1) % 1;
            rgb = colors[part].map((c) => 1.15 * c * (stripe < 0.16 ? 0.62 : 1) + 0.05);
            filled++;
        } else if (hits.t[i] < Infinity) {
            let [x, y, z] = normal.subarray(3 * i, 3 * i + 3);
            if (x * rays[8 * i + 4] + y * rays[8 * i + 5] + z * rays[8 * i + 6] > 0) [x, y, z] = [-x, -y, -z];
            const light = 0.2 + 0.14 * y + 0.62 * Math.max(0, x * sun.x + y * sun.y + z * sun.z);
            const shine = Math.max(0, x * 0.35 + y * 0.62 + z * 0.7) ** 40;
            rgb = colors[hits.instance[i]].map((c) => c * light + 0.16 * shine);
        }
        data.set([...rgb.map((c) => 255 * Math.min(1, c) ** (1 / 2.2)), 255], 4 * pixelOf[i]);
    }
    report(`${counted(scene.triangles)} triangles in ${parts.length} closed parts, ${counted(count)} rays and ${counted(parts.length * count)} points in ${milliseconds.toFixed(0)} ms\n` +
        `drag to move the cut and to turn`);
    done({ filled: filled / count, parts: new Set(hits.instance.filter((i) => i < parts.length)).size });
}
canvas.addEventListener("pointermove", ({ buttons, movementX, movementY }) => {
    if (buttons === 0) return;
    angle -= 0.006 * movementX;
    cut = Math.max(-1.8, Math.min(1.8, cut - 0.006 * movementY));
    redraw();
});
redraw();
