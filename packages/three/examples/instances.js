// A million knots, each with 20,000 triangles, in one scene. A picture of it is traced ray by ray, with shadows, on one thread.
import * as THREE from "three";
import { load } from "bth";
import { CompilerWorker } from "bth/compile";
import { cameraRays, counted, done, picture, random, report } from "./common.js";

const bth = await load(), SIDE = 1000, COUNT = SIDE * SIDE;
const knot = new THREE.TorusKnotGeometry(0.34, 0.12, 250, 40), worker = new CompilerWorker();
report(`compiling ${counted(knot.index.count / 3)} triangles`);
const one = bth.open(await worker.compile(knot.attributes.position.array, knot.index.array));
worker.close();

const next = random(4), matrices = new Float32Array(16 * COUNT), matrix = new THREE.Matrix4();
const position = new THREE.Vector3(), turn = new THREE.Quaternion(), euler = new THREE.Euler(), size = new THREE.Vector3();
const hues = new Float32Array(COUNT);
for (let i = 0; i < COUNT; i++) {
    const x = (i % SIDE) - SIDE / 2, z = Math.floor(i / SIDE) - SIDE / 2;
    const hill = 3 * Math.sin(0.045 * x) * Math.cos(0.06 * z) + 1.6 * Math.sin(0.13 * (x + z));
    position.set(x + 0.5 * next(), hill + 0.3 * next(), z + 0.5 * next());
    turn.setFromEuler(euler.set(6.3 * next(), 6.3 * next(), 6.3 * next()));
    matrix.compose(position, turn, size.setScalar(0.8 + 0.7 * next())).toArray(matrices, 16 * i);
    hues[i] = 0.06 + 0.035 * hill + 0.05 * next();
}
let start = performance.now();
const scene = bth.instances(one, matrices);
const building = performance.now() - start;

const sun = new THREE.Vector3(0.55, 0.6, -0.35).normalize(), color = new THREE.Color(), { redraw } = picture(draw);
/** Traces a picture: what each pixel sees, and if that sees the sun. */
function draw(data, width, height) {
    const { rays, pixelOf } = cameraRays([-9, 10.5, 34], [6, -1, -10], width, height), begin = performance.now();
    const hits = scene.nearest(rays), { normal } = scene.surface(hits);
    const towards = new Float32Array(3 * hits.count).map((_, i) => sun.getComponent(i % 3));
    const dark = scene.anyStarts(hits, towards), milliseconds = performance.now() - begin;
    for (let i = 0; i < hits.count; i++) {
        const [dx, dy, dz] = rays.subarray(8 * i + 4, 8 * i + 7), sky = 0.5 + 0.5 * Math.min(1, 1.6 * dy + 0.35);
        let [r, g, b] = [0.62 + 0.1 * (1 - sky), 0.74, 0.88];
        if (hits.t[i] < Infinity) {
            let [x, y, z] = normal.subarray(3 * i, 3 * i + 3);
            if (x * dx + y * dy + z * dz > 0) [x, y, z] = [-x, -y, -z];
            const light = dark[i] ? 0 : Math.max(0, x * sun.x + y * sun.y + z * sun.z);
            color.setHSL(hues[hits.instance[i]], 0.78, 0.47);
            // Far away the air takes over.
            const air = 1 - Math.exp(-hits.t[i] / 330), mix = (c, a, air0) => (c * (1.15 * light + 0.26 + 0.14 * y)) * (1 - air) + air0 * air * a;
            [r, g, b] = [mix(color.r, 1, r), mix(color.g, 1, g), mix(color.b, 1, b)];
        }
        const gamma = (c) => 255 * Math.min(1, c) ** (1 / 2.2);
        data.set([gamma(r), gamma(g), gamma(b), 255], 4 * pixelOf[i]);
    }
    const found = hits.t.reduce((sum, t) => sum + (t < Infinity ? 1 : 0), 0);
    report(`${counted(COUNT)} instances, ${counted(COUNT * one.triangles)} triangles, placed in ${(building / 1000).toFixed(1)} s\n` +
        `${counted(hits.count + found)} rays in ${(milliseconds / 1000).toFixed(2)} s`);
    done({ instances: scene.instances, hits: found / hits.count });
}
redraw();
