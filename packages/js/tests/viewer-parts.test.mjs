// Parts of the viewer in node: the camera, the picture, the light.
//
//   DIST=FOLDER BTHC=PROGRAM node --test viewer-parts.test.mjs
import assert from "node:assert/strict";
import { execFileSync } from "node:child_process";
import { mkdtempSync, readFileSync, rmSync, writeFileSync } from "node:fs";
import { tmpdir } from "node:os";
import { join, resolve } from "node:path";
import { after, before, test } from "node:test";
import { pathToFileURL } from "node:url";
import { cameraOf, firstView } from "../viewer/camera.js";
import { materialsOf, texel } from "../viewer/materials.js";
import { Picture } from "../viewer/picture.js";
import { shadeTile } from "../viewer/shading.js";
import { FOUR_TEXELS, png, quads } from "./models.mjs";

const { BTHC } = process.env;
const { load } = await import(pathToFileURL(join(resolve(process.env.DIST), "index.js")));

let folder, bth;
before(async () => {
    folder = mkdtempSync(join(tmpdir(), "bth-viewer-parts-"));
    bth = await load();
});
after(() => rmSync(folder, { recursive: true }));

/** Numbers from 0 to 1 by a linear congruential generator (Numerical Recipes). */
function numbers(seed) {
    let state = seed >>> 0;
    return () => (state = (Math.imul(state, 1664525) + 1013904223) >>> 0) / 2 ** 32;
}

test("the viewer shows means of any number of samples", () => {
    const image = { data: new Uint8ClampedArray(4) };
    const picture = new Picture({ getContext: () => ({ createImageData: () => image, putImageData() {} }) }, 1, 1);
    const job = { mode: "normals", tile: { left: 0, top: 0, width: 1, height: 1 } };
    for (let i = 0; i < 70_000; i++) picture.add(job, [0.2, 0.4, i % 2]);
    assert.deepEqual([...image.data], [51, 102, 128, 255]);
});

test("the first view of the viewer shows all corners of any bounds", () => {
    const dot = (a, b) => a.reduce((sum, x, k) => sum + x * b[k], 0);
    const random = numbers(6);
    for (let i = 0; i < 1000; i++) {
        const lower = [0, 1, 2].map(() => 10 * random() - 5), upper = lower.map((x) => x + 2 ** (8 * random() - 4));
        const aspect = 2 ** (4 * random() - 2), view = firstView({ lower, upper }, i % 2 ? "y" : "z", aspect), camera = cameraOf(view, aspect);
        for (let corner = 0; corner < 8; corner++) {
            const to = lower.map((low, k) => ((corner >> k) & 1 ? upper[k] : low) - camera.eye[k]), away = dot(to, camera.forward);
            for (const [k, axis] of [camera.right, camera.up].entries()) {
                // Up to the rounding of numbers of this size.
                assert.ok(Math.abs(dot(to, axis)) <= camera.half[k] * away * (1 + 1e-12), `${i}, ${aspect}`);
            }
        }
    }
});

test("the viewer lights a room alike at every size", async () => {
    const picture = async (size) => {
        // A cube, seen from within.
        const corners = Array.from({ length: 8 }, (_, i) => [i & 1, (i >> 1) & 1, i >> 2].map((bit) => (bit ? size : -size)));
        const faces = [[1, 2, 4, 3], [5, 6, 8, 7], [1, 2, 6, 5], [3, 4, 8, 7], [1, 3, 7, 5], [2, 4, 8, 6]];
        const [model, file] = [join(folder, "room.obj"), join(folder, "room.bth")];
        writeFileSync(model, [...corners.map((at) => `v ${at.join(" ")}`), ...faces.map((face) => `f ${face.join(" ")}`)].join("\n"));
        execFileSync(BTHC, ["compile", model, "-o", file, "--quiet"]);
        const camera = { eye: [0.1 * size, 0.2 * size, 0.5 * size], right: [1, 0, 0], up: [0, 1, 0], forward: [0, 0, -1], half: [1, 1], vertical: [0, 1, 0] };
        const bounds = { lower: [-size, -size, -size], upper: [size, size, size] }, diagonal = 2 * size * Math.sqrt(3);
        const tile = { left: 0, top: 0, width: 32, height: 32 };
        const scene = bth.open(readFileSync(file));
        return shadeTile(scene, await materialsOf(scene), { camera, bounds, diagonal, inside: true, mode: "shaded", size: tile, tile, step: 1, sample: 0 });
    };
    const expected = await picture(1);
    assert.ok(expected.every((x) => x > 0.05));
    for (const size of [2 ** -40, 2 ** 20]) assert.deepEqual(await picture(size), expected, String(size));
});

test("texels are found by wrap mode, transform and filter", () => {
    // Two texels by one: black and white.
    const image = { width: 2, height: 1, texels: Uint8Array.of(0, 0, 0, 255, 255, 255, 255, 0) };
    const identity = [1, 0, 0, 0, 1, 0];
    const at = (u, wrap, filter = "nearest", transform = identity) => texel({ ...image, transform, filter, wrap: [wrap, "clamp"] }, u, 0.5)[0];
    for (const [wrap, expected] of [["repeat", [0, 1, 0, 1, 0, 1]], ["mirror", [1, 0, 0, 1, 1, 0]], ["clamp", [0, 0, 0, 1, 1, 1]]]) {
        assert.deepEqual([-0.75, -0.25, 0.25, 0.75, 1.25, 1.75].map((u) => at(u, wrap)), expected, wrap);
    }
    // The middle between two texels is half of their light.
    assert.equal(at(0.5, "clamp", "linear"), 0.5);
    assert.equal(at(0, "repeat", "linear"), 0.5);
    assert.equal(at(0.25, "clamp", "nearest", [1, 0, 0.5, 0, 1, 0]), 1);
    assert.deepEqual(texel({ ...image, transform: identity, filter: "linear", wrap: ["clamp", "clamp"] }, 0.75, 0.5), [1, 1, 1, 0]);
    assert.deepEqual(texel({ ...image, transform: identity, filter: "linear", wrap: ["clamp", "clamp"] }, NaN, 0.5), [1, 1, 1, 1]);
});

test("the viewer shows textures, and what is behind their holes", async () => {
    const [model, file] = [join(folder, "quads.gltf"), join(folder, "quads.bth")];
    writeFileSync(model, quads());
    execFileSync(BTHC, ["compile", model, "-o", file, "--materials", "--quiet"]);
    const scene = bth.open(readFileSync(file));
    const decode = async (bytes, most) => {
        assert.deepEqual([...bytes], [...png(2, 2, FOUR_TEXELS)]);
        assert.ok(most >= 4);
        return { width: 2, height: 2, texels: Uint8Array.from(FOUR_TEXELS.flat()) };
    };
    const camera = { eye: [0, 0, 4], right: [1, 0, 0], up: [0, 1, 0], forward: [0, 0, -1], half: [0.25, 0.25], vertical: [0, 1, 0] };
    const tile = { left: 0, top: 0, width: 2, height: 2 }, { bounds } = scene;
    const job = { camera, bounds, diagonal: 4, inside: false, mode: "shaded", size: tile, tile, step: 1 };
    const average = (materials) => {
        const sums = new Array(12).fill(0), samples = 400;
        for (let sample = 0; sample < samples; sample++) shadeTile(scene, materials, { ...job, sample }).forEach((x, i) => (sums[i] += x / samples));
        return sums;
    };
    const linear = (byte) => ((byte / 255 + 0.055) / 1.055) ** 2.4;
    const found = average(await materialsOf(scene, decode));
    // Red and half of it; a hole, behind which it is green; a third of the light stopped by blue.
    const expected = [1, 0, 0, linear(128), 0, 0, 0, 0.5, 0, 0, 0.5 * (2 / 3), 1 / 3];
    found.forEach((x, i) => assert.ok(Math.abs(x - expected[i]) < (i < 9 ? 1e-6 : 0.02), `${i}: ${found}`));
    // Images that are not decoded count as white.
    const white = await materialsOf(scene, () => Promise.reject(new Error()));
    assert.equal(white.undecoded, 1);
    assert.deepEqual([...shadeTile(scene, white, { ...job, sample: 0 })].slice(0, 9), [1, 1, 1, 1, 1, 1, 1, 1, 1]);
});

test("what would emit by an image that is not decoded does not", async () => {
    const lamp = { emissive: [1, 0.5, 0], emissiveTexture: 0, baseColorTexture: null };
    const scene = {
        objects: 2, image: () => new Uint8Array(), textures: () => [{ image: 7 }],
        materials: (object) => [object === 0 ? lamp : { ...lamp, emissiveTexture: null }],
    };
    const image = { width: 1, height: 1, texels: Uint8Array.of(255, 255, 255, 255) };
    let decoded = 0;
    const whole = await materialsOf(scene, async () => (decoded++, image));
    assert.deepEqual([whole.of(0, 0).emissive, whole.of(1, 0).emissive, whole.undecoded, decoded], [[1, 0.5, 0], [1, 0.5, 0], 0, 1]);
    const lost = await materialsOf(scene, () => Promise.reject(new Error()));
    assert.deepEqual([lost.of(0, 0).emissive, lost.of(1, 0).emissive, lost.undecoded], [[0, 0, 0], [1, 0.5, 0], 1]);
});
