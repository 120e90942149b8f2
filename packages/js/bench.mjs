// Rays per second of the package under node, in batches and one ray a call, compared with its module without vector instructions and
// with three-mesh-bvh, on identical rays: camera rays in blocks of 8 by 8, and bounces from what they hit.
//
//   BTHC=PROGRAM node bench.mjs MODEL...    models that bthc reads, seen from outside
//
// DIST is the built package (dist/); PLAIN a bth_js.wasm that is built without `-C target-feature=+simd128`; MODULES a folder
// node_modules with three and three-mesh-bvh. What is absent is left out. Times are CPU times of the process, medians of rounds that take turns.
// In brackets: how many times as fast as the last.
import { execFileSync } from "node:child_process";
import { mkdtempSync, readFileSync, rmSync } from "node:fs";
import { tmpdir } from "node:os";
import { join, resolve } from "node:path";
import { pathToFileURL } from "node:url";
import { cameraOf, directionThrough, firstView } from "./viewer/camera.js";
import { add, cosineDirection, dot, mix, samplePoint, scale } from "./viewer/vectors.js";

const SIZE = 256, ROUNDS = 5;
const { BTHC = "bthc", DIST = "dist", PLAIN, MODULES } = process.env;
const { load } = await import(pathToFileURL(join(resolve(DIST), "index.js")));

/** Camera rays to all of a scene, in blocks of 8 by 8 pixels. */
function cameraRays(scene) {
    const camera = cameraOf(firstView(scene.bounds, "y", 1), 1), rays = new Float32Array(8 * SIZE * SIZE);
    for (let i = 0; i < SIZE * SIZE; i++) {
        const block = i >> 6, x = (block % (SIZE / 8)) * 8 + (i & 7), y = Math.floor(block / (SIZE / 8)) * 8 + ((i >> 3) & 7);
        rays.set([...camera.eye, 0, ...directionThrough(camera, (2 * x) / SIZE - 1, 1 - (2 * y) / SIZE), Infinity], 8 * i);
    }
    return rays;
}

/** A bounce from each hit. */
function bounces(scene, rays) {
    const hits = scene.nearest(rays), { position, geometricNormal } = scene.surface(hits), out = [];
    const { lower, upper } = scene.bounds, offset = 2e-5 * Math.hypot(...add(upper, lower, -1));
    for (let i = 0; i < hits.count; i++) {
        if (hits.t[i] === Infinity) continue;
        const at = [...position.subarray(3 * i, 3 * i + 3)], direction = rays.subarray(8 * i + 4, 8 * i + 7);
        let normal = [...geometricNormal.subarray(3 * i, 3 * i + 3)];
        if (dot(normal, direction) > 0) normal = scale(normal, -1);
        out.push(...add(at, normal, offset), 0, ...cosineDirection(normal, samplePoint(mix(i), 0, 0)), Infinity);
    }
    return Float32Array.from(out);
}

/** A function from rays to the t of their nearest hits by three-mesh-bvh. */
async function threeMeshBvh(model, folder) {
    const from = (name, file) => import(pathToFileURL(join(resolve(MODULES), name, file)));
    const { BufferAttribute, BufferGeometry, DoubleSide, Ray } = await from("three", "build/three.module.js");
    const { MeshBVH, SAH } = await from("three-mesh-bvh", "build/index.module.js");
    const triangles = join(folder, "triangles");
    execFileSync(BTHC, ["marks", model, "--tris", triangles], { stdio: "ignore" });
    const bytes = readFileSync(triangles);
    const positions = new Float32Array(bytes.buffer.slice(bytes.byteOffset + 16, bytes.byteOffset + bytes.length));
    const geometry = new BufferGeometry();
    geometry.setAttribute("position", new BufferAttribute(positions, 3));
    const bvh = new MeshBVH(geometry, { strategy: SAH }), ray = new Ray();
    return (rays) => {
        const t = new Float32Array(rays.length / 8);
        for (let i = 0; i < t.length; i++) {
            ray.origin.fromArray(rays, 8 * i);
            ray.direction.fromArray(rays, 8 * i + 4);
            t[i] = bvh.raycastFirst(ray, DoubleSide)?.distance ?? Infinity;
        }
        return t;
    };
}

/** The same by calls of one ray, with a ray and a hit that are used again. */
function oneByOne(scene) {
    const ray = new Float64Array(8), hit = {};
    return (rays) => {
        const t = new Float32Array(rays.length / 8);
        for (let i = 0; i < t.length; i++) {
            for (let k = 0; k < 8; k++) ray[k] = rays[8 * i + k];
            t[i] = scene.nearestOne(ray, hit) ? hit.t : Infinity;
        }
        return t;
    };
}

/** Millions of rays per CPU second of each tracer. */
function measure(tracers, rays) {
    const times = Object.fromEntries(Object.keys(tracers).map((name) => [name, []]));
    for (let round = 0; round <= ROUNDS; round++) {
        for (const [name, trace] of Object.entries(tracers)) {
            const start = process.cpuUsage();
            trace(rays);
            const { user, system } = process.cpuUsage(start);
            // The first round warms up.
            if (round > 0) times[name].push(user + system);
        }
    }
    return Object.entries(times).map(([name, all]) => [name, rays.length / 8 / all.sort((a, b) => a - b)[ROUNDS >> 1]]);
}

const folder = mkdtempSync(join(tmpdir(), "bth-bench-"));
for (const model of process.argv.slice(2)) {
    const file = join(folder, "model.bth");
    execFileSync(BTHC, ["compile", model, "-o", file, "--quiet"]);
    const scene = (await load()).open(readFileSync(file));
    const tracers = { batch: (rays) => scene.nearest(rays).t, one: oneByOne(scene) };
    if (PLAIN) {
        const plain = (await load(readFileSync(PLAIN))).open(readFileSync(file));
        tracers.plain = (rays) => plain.nearest(rays).t;
    }
    if (MODULES) tracers["three-mesh-bvh"] = await threeMeshBvh(model, folder);
    const camera = cameraRays(scene);
    for (const [set, rays] of [["camera", camera], ["bounces", bounces(scene, camera)]]) {
        const speeds = measure(tracers, rays);
        const [ours, theirs] = [tracers.one, tracers["three-mesh-bvh"] ?? tracers.batch].map((trace) => trace(rays));
        const differ = ours.filter((t, i) => t !== theirs[i] && !(Math.abs(t - theirs[i]) <= 1e-4 * t)).length;
        const other = speeds.at(-1)[1];
        const columns = speeds.map(([name, speed]) => `${name} ${speed.toFixed(2)} M/s (${(speed / other).toFixed(1)})`);
        console.log(`${model.split("/").pop()} ${set}: ${columns.join(", ")}${differ ? `; ${differ} of ${ours.length} rays differ` : ""}`);
    }
    scene.close();
}
rmSync(folder, { recursive: true });
