// Queries of one ray, box or ball, compiling, new positions and instances.
//
//   DIST=FOLDER BTHC=PROGRAM BTH_SCENES=PROGRAM node --test one.test.mjs
import assert from "node:assert/strict";
import { execFileSync, spawnSync } from "node:child_process";
import { mkdtempSync, readFileSync, rmSync, writeFileSync } from "node:fs";
import { tmpdir } from "node:os";
import { join, resolve } from "node:path";
import { after, before, test } from "node:test";
import { pathToFileURL } from "node:url";

const { BTHC, BTH_SCENES, DIST } = process.env;
const of = (name) => import(pathToFileURL(join(resolve(DIST), name)));
const { load, BthError } = await of("index.js"), { loadCompiler } = await of("compile.js");

let folder, bth, compiler, knot;
before(async () => {
    folder = mkdtempSync(join(tmpdir(), "bth-one-"));
    [bth, compiler] = [await load(), await loadCompiler()];
    execFileSync(BTH_SCENES, ["make", "torus-knot", "-o", join(folder, "knot.ply")]);
    execFileSync(BTHC, ["marks", join(folder, "knot.ply"), "--tris", join(folder, "knot.tris")], { stdio: "ignore" });
    const bytes = readFileSync(join(folder, "knot.tris"));
    knot = new Float32Array(bytes.buffer.slice(bytes.byteOffset + 16, bytes.byteOffset + bytes.length));
});
after(() => rmSync(folder, { recursive: true }));

/** Numbers from -1 to 1 by a linear congruential generator (Numerical Recipes). */
function numbers(seed) {
    let state = seed >>> 0;
    return () => (state = (Math.imul(state, 1664525) + 1013904223) >>> 0) / 2 ** 31 - 1;
}

/** Rays through a box, eight numbers each. */
function raysThrough({ lower, upper }, count) {
    const random = numbers(count), rays = new Float64Array(8 * count);
    for (let i = 0; i < count; i++) {
        const at = (k, size) => (lower[k] + upper[k]) / 2 + size * random() * (upper[k] - lower[k]);
        const from = [0, 1, 2].map((k) => at(k, 1)), to = [0, 1, 2].map((k) => at(k, 0.4));
        rays.set([...from, 0, ...to.map((x, k) => x - from[k]), Infinity], 8 * i);
    }
    return rays;
}

test("a compiled mesh has the bytes that bthc makes, but for the name of its source", () => {
    const file = join(folder, "knot.bth"), ours = join(folder, "ours.bth");
    execFileSync(BTHC, ["compile", join(folder, "knot.ply"), "-o", file, "--quality", "fast", "--structure", "bvh", "--free-directions", "none", "--quiet", "--no-cache"]);
    writeFileSync(ours, compiler.compile(knot));
    const { stdout } = spawnSync(BTHC, ["diff", file, ours], { encoding: "utf8" });
    assert.match(stdout, /^the content is the same; how the files came about differs$/m);
});

test("indices, 16-bit indices and positions alone are the same mesh", () => {
    const square = Float32Array.of(0, 0, 0, 1, 0, 0, 1, 1, 0, 0, 1, 0), corners = [0, 1, 2, 0, 2, 3];
    const alone = Float32Array.from(corners.flatMap((i) => [...square.subarray(3 * i, 3 * i + 3)]));
    const answers = [[square, Uint32Array.from(corners)], [square, Uint16Array.from(corners)], [Float64Array.from(square), Uint8Array.from(corners)], [alone, null]]
        .map(([positions, indices]) => bth.open(compiler.compile(positions, indices)).allHits([0.5, 0.5, 1, 0, 0, 0, -1, 9]));
    for (const hits of answers) assert.deepEqual([...hits.triangle], [0, 1]);
});

test("meshes that cannot be compiled are refused with a code or what was expected", () => {
    const three = new Float32Array(9);
    for (const [code, positions, indices] of [["BTH-I005", three, Uint32Array.of(0, 1, 3)], ["BTH-I004", Float32Array.of(NaN, 0, 0, 1, 0, 0, 0, 1, 0), null]]) {
        assert.throws(() => compiler.compile(positions, indices), (error) => error instanceof BthError && error.code === code);
    }
    assert.throws(() => compiler.compile([0, 0, 0]), /positions: expected a Float32Array .* found Array of 3$/);
    assert.throws(() => compiler.compile(three, Uint32Array.of(0, 1)), /indices: expected .* three indices a triangle; found Uint32Array of 2$/);
    assert.equal(bth.open(compiler.compile(new Float32Array(0))).triangles, 0);
});

test("one ray a call gives the numbers of a batch", () => {
    const scene = bth.open(compiler.compile(knot)), rays = raysThrough(scene.bounds, 2000), hits = scene.nearest(rays), hit = {};
    let found = 0;
    for (let i = 0; i < hits.count; i++) {
        const ray = rays.subarray(8 * i, 8 * i + 8), isHit = scene.nearestOne(ray, hit);
        assert.equal(isHit, hits.t[i] < Infinity);
        assert.equal(scene.anyOne(ray), isHit);
        if (!isHit) continue;
        found++;
        assert.deepEqual(hit, { t: hits.t[i], u: hits.u[i], v: hits.v[i], instance: 0, triangle: hits.triangle[i] });
        const all = scene.allHits(ray), front = scene.allHits(ray, "front"), back = scene.allHits(ray, "back");
        assert.equal(all.t[0], hit.t);
        let k = 0;
        const count = scene.eachHit(ray, (...numbers) => {
            assert.deepEqual(numbers, ["t", "u", "v", "instance", "triangle"].map((name) => all[name][k]));
            k++;
        });
        assert.equal(count, all.count);
        assert.equal(all.count, front.count + back.count);
        assert.equal(scene.nearestOne(ray, hit, "back"), back.count > 0);
        if (back.count > 0) assert.equal(hit.triangle, back.triangle[0]);
    }
    assert.ok(found > 300 && found < 1900, `${found} hits`);
    assert.throws(() => scene.nearestOne([1], hit), /ray: expected eight numbers .* found Array of 1/);
    assert.throws(() => scene.nearestOne(rays.subarray(0, 8), hit, "left"), /side: expected "both", "front" or "back"/);
    scene.close();
    assert.throws(() => scene.nearestOne(rays.subarray(0, 8), hit), /closed/);
});

test("one ray a call goes on after the memory has grown", () => {
    const scene = bth.open(compiler.compile(knot)), [ray] = [raysThrough(scene.bounds, 1)], hit = {};
    ray.set([0, 0, 9, 0, 0.1, 0.05, -1, Infinity]);
    const before = scene.nearestOne(ray, hit) && { ...hit };
    const large = bth.open(compiler.compile(Float32Array.from({ length: 90 * knot.length }, (_, i) => knot[i % knot.length] + Math.floor(i / knot.length))));
    assert.deepEqual(scene.nearestOne(ray, hit) && { ...hit }, before);
    for (const one of [scene, large]) one.close();
});

test("boxes and balls find the triangles whose distance fits", () => {
    const scene = bth.open(compiler.compile(knot)), { lower, upper } = scene.bounds;
    const corner = lower.map((x, k) => x + 0.6 * (upper[k] - x)), center = [0.5, 0.2, 0.1], radius = 0.7;
    const inBall = scene.trianglesInSphere(center, radius);
    assert.equal(scene.overlapsSphere(center, radius), inBall.count > 0);
    assert.ok(inBall.count > 10 && inBall.count < scene.triangles);
    assert.deepEqual([...inBall.triangle].sort((a, b) => a - b), [...inBall.triangle]);
    assert.equal(scene.trianglesInBox(lower, upper).count, scene.triangles);
    assert.ok(scene.overlapsBox(lower, corner));
    assert.equal(scene.overlapsBox(upper.map((x) => x + 1), upper.map((x) => x + 2)), false);
});

test("new positions give the answers of a mesh that is compiled with them", () => {
    const scene = bth.open(compiler.compile(knot, null, { deformable: true }));
    assert.equal(scene.vertices(), knot.length / 3);
    const moved = knot.map((x, i) => x + 0.3 * Math.sin(3 * knot[i - (i % 3)]));
    scene.setPositions(moved);
    const expected = bth.open(compiler.compile(moved)), rays = raysThrough(expected.bounds, 1000);
    for (const name of ["t", "u", "v", "triangle"]) assert.deepEqual(scene.nearest(rays)[name], expected.nearest(rays)[name]);
    assert.throws(() => scene.setPositions(moved.subarray(3)), (error) => error.code === "BTH-S007");
    assert.equal(expected.vertices(), null);
    assert.throws(() => expected.setPositions(moved), (error) => error.code === "BTH-S006");
});

test("instances are where their matrices put them, and can be moved and hidden", () => {
    const scenes = [knot, Float32Array.of(0, 0, 0, 1, 0, 0, 0, 1, 0)].map((positions) => bth.open(compiler.compile(positions)));
    const at = (x, scale = 1) => [scale, 0, 0, 0, 0, scale, 0, 0, 0, 0, scale, 0, x, 0, 0, 1];
    const scene = bth.instances(scenes, Float64Array.from([at(0), at(100), at(200)].flat()), [0, 1, 1]), hit = {};
    assert.deepEqual([scene.instances, scene.objects], [3, 2]);
    const ask = (x) => scene.nearestOne([x + 0.25, 0.25, 5, 0, 0, 0, -1, Infinity], hit) && hit.instance;
    assert.deepEqual([ask(100), ask(200), ask(300)], [1, 2, false]);
    scene.setTransforms(Float32Array.from(at(300)), 2);
    assert.deepEqual([ask(100), ask(200), ask(300)], [1, false, 2]);
    scene.setTransforms(Float32Array.from(at(100, 0)), 1);
    assert.equal(ask(100), false);
    assert.throws(() => scene.setTransforms(Float32Array.from(at(0)), 3), RangeError);
    assert.throws(() => scene.setTransforms(Float32Array.of(1)), /transforms: expected .* 16 numbers a matrix/);
    assert.throws(() => scenes[0].setTransforms(Float32Array.from(at(0))), /only instances/);
    const flat = at(0);
    flat[0] = 0;
    assert.throws(() => bth.instances(scenes[0], Float32Array.from(flat)), (error) => error.code === "BTH-S001");
    scene.close();
    assert.throws(() => ask(0), /closed/);
});
