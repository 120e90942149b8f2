// A slice through the signed distance field of a mesh: distances by closest points, signs by exact winding numbers.
import * as THREE from "three";
import { computeBoundsTreeAsync, ready } from "@bth/three";
import { counted, done, model, report, stage } from "./common.js";

await ready();
const SIDE = 224, HALF = 2, { scene, run } = stage({ eye: [2.8, 1.4, 6.4] });
const knot = model(new THREE.TorusKnotGeometry(1, 0.33, 400, 48), 0xc9d1da, { transparent: true, opacity: 0.28, depthWrite: false });
knot.castShadow = false;
scene.add(knot);
const tree = await computeBoundsTreeAsync(knot.geometry);

const pixels = new Uint8Array(4 * SIDE * SIDE), texture = new THREE.DataTexture(pixels, SIDE, SIDE);
texture.colorSpace = THREE.SRGBColorSpace;
texture.magFilter = THREE.LinearFilter;
const slice = new THREE.Mesh(new THREE.PlaneGeometry(2 * HALF, 2 * HALF), new THREE.MeshBasicMaterial({ map: texture, side: THREE.DoubleSide, toneMapped: false }));
scene.add(slice);

/** Colours the slice at a depth: blue outside, orange inside, with a line at each twentieth. */
function draw(z) {
    const points = new Float64Array(3 * SIDE * SIDE), start = performance.now();
    for (let i = 0; i < SIDE * SIDE; i++) {
        points.set([((i % SIDE) + 0.5) / SIDE * 2 * HALF - HALF, (Math.floor(i / SIDE) + 0.5) / SIDE * 2 * HALF - HALF, z], 3 * i);
    }
    const { distance } = tree.scene.closest(points), winding = tree.scene.winding(points);
    const milliseconds = performance.now() - start;
    let deepest = 0, inside = 0;
    for (let i = 0; i < SIDE * SIDE; i++) {
        const isInside = winding[i] !== 0, d = distance[i], [r, g, b] = isInside ? [245, 146, 52] : [70, 140, 215];
        // Dark at the surface, and at whole twentieths.
        const line = Math.min(1, Math.abs(((20 * d + 0.5) % 1) - 0.5) * (isInside ? 5 : 4) + 0.25), fade = isInside ? 1 - 0.9 * d : 1 / (1 + 0.45 * d);
        const light = line * fade * Math.min(1, 40 * d + 0.1);
        pixels.set([r * light, g * light, b * light, 255], 4 * i);
        if (isInside) [deepest, inside] = [Math.max(deepest, d), inside + 1];
    }
    texture.needsUpdate = true;
    slice.position.z = z;
    report(`${counted(SIDE * SIDE)} signed distances to ${counted(knot.geometry.index.count / 3)} triangles in ${milliseconds.toFixed(0)} ms\n` +
        `deepest point of this slice: ${deepest.toFixed(3)} below the surface`);
    return { deepest, share: inside / SIDE / SIDE };
}

const controls = document.createElement("label"), slider = document.createElement("input");
controls.className = "controls";
Object.assign(slider, { type: "range", min: -0.85, max: 0.85, step: 0.01, value: 0 });
controls.append("slice ", slider);
document.body.append(controls);
slider.addEventListener("input", () => draw(Number(slider.value)));
const result = draw(0);
run(() => done(result));
