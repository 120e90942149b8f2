// The package in node: answers beside those of bthc, errors, what a file holds.
//
//   DIST=FOLDER BTHC=PROGRAM BTH_SCENES=PROGRAM [TSC=PROGRAM] node --test package.test.mjs
import assert from "node:assert/strict";
import { execFileSync, spawnSync } from "node:child_process";
import { copyFileSync, mkdirSync, mkdtempSync, readFileSync, readdirSync, rmSync, writeFileSync } from "node:fs";
import { tmpdir } from "node:os";
import { dirname, join, resolve } from "node:path";
import { after, before, test } from "node:test";
import { fileURLToPath, pathToFileURL } from "node:url";
import { runInNewContext } from "node:vm";
import { FOUR_TEXELS, png, quads } from "./models.mjs";

const here = dirname(fileURLToPath(import.meta.url)), conformance = resolve(here, "../../../format-spec/conformance");
const { BTHC, BTH_SCENES } = process.env;
const { load, BthError } = await import(pathToFileURL(join(resolve(process.env.DIST), "index.js")));

let folder, bth;
before(async () => {
    folder = mkdtempSync(join(tmpdir(), "bth-js-"));
    bth = await load();
});
after(() => rmSync(folder, { recursive: true }));

/** Numbers from 0 to 1 by a linear congruential generator (Numerical Recipes). */
function numbers(seed) {
    let state = seed >>> 0;
    return () => (state = (Math.imul(state, 1664525) + 1013904223) >>> 0) / 2 ** 32;
}

/** Rays from around a box into it; some along axes, some short, some invalid. */
function raysInto(bounds, count, seed) {
    const random = numbers(seed), rays = new Float32Array(8 * count);
    const { lower, upper } = bounds ?? { lower: [-1, -1, -1], upper: [1, 1, 1] };
    const point = (k, grow) => {
        const side = upper[k] - lower[k] || 1;
        return lower[k] - grow * side + random() * (1 + 2 * grow) * side;
    };
    for (let i = 0; i < count; i++) {
        const from = [0, 1, 2].map((k) => point(k, 1)), to = [0, 1, 2].map((k) => point(k, 0));
        const direction = to.map((x, k) => x - from[k]);
        if (i % 7 === 0) direction.fill(0, 0, 2);
        rays.set([...from, i % 5 === 0 ? 0.25 : 0, ...direction, i % 3 === 0 ? Infinity : 2 * random()], 8 * i);
    }
    rays[8 * 3] = NaN;
    rays.fill(0, 8 * 4 + 4, 8 * 4 + 7);
    return rays;
}

/** Rays from one point through the pixels of a square picture of a box, in tiles of four by four. */
function cameraRays({ lower, upper }, size) {
    const rays = new Float32Array(8 * size * size), tiles = size / 4;
    const eye = upper.map((x, k) => x + [0.4, 0.5, 0.6][k] * (x - lower[k]));
    const middle = lower.map((x, k) => (x + upper[k]) / 2);
    for (let i = 0; i < size * size; i++) {
        const tile = i >> 4, x = 4 * (tile % tiles) + (i & 3), y = 4 * Math.floor(tile / tiles) + ((i >> 2) & 3);
        const across = (x + 0.5) / size - 0.5, down = (y + 0.5) / size - 0.5;
        const side = upper[0] - lower[0], to = [middle[0] + across * side, middle[1] - down * side, middle[2] - across * side];
        rays.set([...eye, 0, ...to.map((p, k) => p - eye[k]), Infinity], 8 * i);
    }
    return rays;
}

/** The answers of bthc to rays, from a file of rays in a file of hits: columns of the bits of t, u and v, and of triangles. */
function native(file, rays, any) {
    const [from, to] = [join(folder, "rays"), join(folder, "hits")];
    const header = Buffer.alloc(16);
    header.write("RAYS");
    header.writeUInt32LE(1, 4);
    header.writeUInt32LE(rays.length / 8, 8);
    writeFileSync(from, Buffer.concat([header, new Uint8Array(rays.buffer)]));
    execFileSync(BTHC, ["trace", file, from, "-o", to, ...(any ? ["--any"] : [])]);
    const bytes = readFileSync(to);
    const words = new Uint32Array(bytes.buffer.slice(bytes.byteOffset + 16, bytes.byteOffset + bytes.length));
    const column = (k) => words.filter((_, i) => i % 4 === k);
    return { t: column(0), u: column(1), v: column(2), triangle: column(3) };
}

const bits = (array) => new Uint32Array(array.buffer);

/** Compares answers to rays with those of bthc; `raysOf` makes rays for the bounds of the scene. */
function sameAnswers(file, raysOf) {
    const scene = bth.open(readFileSync(file));
    const rays = raysOf(scene.bounds), count = rays.length / 8;
    const hits = scene.nearest(rays), expected = native(file, rays, false);
    for (const name of ["t", "u", "v", "triangle"]) {
        assert.deepEqual(bits(hits[name]), expected[name], `${file}: ${name}`);
    }
    const found = native(file, rays, true).triangle.map((triangle) => Number(triangle === 0));
    assert.deepEqual([...scene.any(rays)], [...found], `${file}: any`);
    assert.equal(scene.steps(rays).count, count);
    scene.close();
    return hits.t.filter((t) => t < Infinity).length;
}

test("vector instructions are used", () => assert.equal(bth.simd, true));

test("answers to conformance files have the bits of bthc", () => {
    let hits = 0;
    for (const name of readdirSync(join(conformance, "valid"))) hits += sameAnswers(join(conformance, "valid", name), (bounds) => raysInto(bounds, 300, 1));
    assert.ok(hits > 1000, `${hits} hits`);
});

test("answers to a model of 20,000 triangles have the bits of bthc, over several chunks", () => {
    const [model, file] = [join(folder, "gyroid.ply"), join(folder, "gyroid.bth")];
    execFileSync(BTH_SCENES, ["make", "gyroid", "--faces", "20000", "-o", model]);
    execFileSync(BTHC, ["compile", model, "-o", file, "--quality", "fast", "--quiet"]);
    assert.ok(sameAnswers(file, (bounds) => raysInto(bounds, 10_000, 2)) > 3000);
});

test("answers of camera rays to a scene of 18 instances have the bits of bthc", () => {
    const [made, file] = [join(folder, "carousel"), join(folder, "carousel.bth")];
    execFileSync(BTH_SCENES, ["scene", "carousel", "-o", made]);
    execFileSync(BTHC, ["compile", join(made, "carousel.manifest"), "-o", file, "--quality", "fast", "--quiet"]);
    assert.ok(sameAnswers(file, (bounds) => cameraRays(bounds, 64)) > 1000);
    assert.ok(sameAnswers(file, (bounds) => raysInto(bounds, 3000, 3)) > 500);
});

/** Directions of rays: three numbers each from -1 to 1. */
function directionsOf(count, seed) {
    const random = numbers(seed);
    return Float32Array.from({ length: 3 * count }, () => 2 * random() - 1);
}

/** The rows of columns, as an object of its own. */
const rowsOf = ({ instance, triangle, u, v }, from, to) => ({
    count: to - from, instance: instance.subarray(from, to), triangle: triangle.subarray(from, to), u: u.subarray(from, to), v: v.subarray(from, to),
});

test("rays that start on surfaces leave them, and hit what is behind", () => {
    const [model, file] = [join(folder, "room.obj"), join(folder, "room.bth")];
    const corners = Array.from({ length: 8 }, (_, i) => [i & 1, (i >> 1) & 1, i >> 2].join(" "));
    const faces = [[1, 2, 4, 3], [5, 6, 8, 7], [1, 2, 6, 5], [3, 4, 8, 7], [1, 3, 7, 5], [2, 4, 8, 6]];
    writeFileSync(model, [...corners.map((at) => `v ${at}`), ...faces.map((face) => `f ${face.join(" ")}`)].join("\n"));
    execFileSync(BTHC, ["compile", model, "-o", file, "--quiet"]);
    const scene = bth.open(readFileSync(file)), random = numbers(9);
    // From the middle to all sides, more than a chunk; then on through the room, and out of it.
    const count = 5000, rays = new Float32Array(8 * count);
    for (let i = 0; i < count; i++) rays.set([0.5, 0.5, 0.5, 0, 2 * random() - 1, 2 * random() - 1, 2 * random() - 1, Infinity], 8 * i);
    const hits = scene.nearest(rays), { position } = scene.surface(hits);
    const inward = Float32Array.from(position, (x) => 0.5 - x + 0.1 * (random() - 0.5)), outward = inward.map((x) => -x);
    const onward = scene.nearestStarts(hits, inward);
    assert.ok(onward.t.every((t, i) => t > 0.5 && t < 10 && onward.triangle[i] !== hits.triangle[i]));
    assert.ok(scene.anyStarts(hits, inward).every((any) => any === 1));
    assert.ok(scene.anyStarts(hits, outward).every((any) => any === 0));
    // An end for all, and one for each.
    assert.ok(scene.nearestStarts(hits, inward, 0.5).triangle.every((triangle) => triangle === 0xffffffff));
    const ends = onward.t.map((t, i) => (i % 2 ? t : t / 2));
    assert.deepEqual([...scene.anyStarts(hits, inward, ends)], [...ends.keys()].map((i) => i % 2));
    // Alone and together.
    for (const i of [0, 4095, 4096, 4999]) {
        const one = scene.nearestStarts(rowsOf(hits, i, i + 1), inward.subarray(3 * i, 3 * i + 3));
        for (const name of ["t", "u", "v", "instance", "triangle"]) assert.deepEqual(bits(one[name]), bits(onward[name].slice(i, i + 1)));
    }
    scene.close();
    assert.throws(() => scene.nearestStarts(hits, inward), BthError);
});

test("rays from hits of a scene are the same alone, together and for any hit", () => {
    for (const name of ["gyroid.bth", "carousel.bth"]) {
        const scene = bth.open(readFileSync(join(folder, name))), count = 64 * 64;
        const hits = scene.nearest(cameraRays(scene.bounds, 64)), directions = directionsOf(count, 10);
        const onward = scene.nearestStarts(hits, directions), any = scene.anyStarts(hits, directions);
        let found = 0;
        for (let i = 0; i < count; i++) {
            assert.equal(any[i], Number(onward.t[i] < Infinity));
            assert.ok(onward.t[i] > 0);
            if (hits.t[i] === Infinity) assert.equal(any[i], 0);
            found += any[i];
        }
        assert.ok(found > 200, `${name}: ${found}`);
        for (let i = 0; i < count; i += 37) {
            const one = scene.nearestStarts(rowsOf(hits, i, i + 1), directions.subarray(3 * i, 3 * i + 3));
            assert.deepEqual([one.t[0], one.u[0], one.v[0], one.triangle[0]], [onward.t[i], onward.u[i], onward.v[i], onward.triangle[i]]);
        }
        scene.close();
    }
});

test("what is no start is a miss, and other arguments are refused", () => {
    const scene = bth.open(readFileSync(join(conformance, "valid/triangle.bth"))), up = Float32Array.of(0, 0, 1);
    const start = (instance, triangle, u, v) => ({ count: 1, instance: Uint32Array.of(instance), triangle: Uint32Array.of(triangle), u: Float32Array.of(u), v: Float32Array.of(v) });
    const good = start(0, 0, 0.25, 0.25);
    for (const bad of [start(1, 0, 0, 0), start(0, 9, 0, 0), start(0, 0, -1, 0), start(0, 0, 0.75, 0.5), start(0, 0, NaN, 0), good]) {
        assert.equal(scene.nearestStarts(bad, up).t[0], Infinity);
        assert.deepEqual([...scene.anyStarts(bad, up)], [0]);
    }
    assert.equal(scene.nearestStarts({ ...good, count: 0, instance: new Uint32Array(0), triangle: new Uint32Array(0), u: new Float32Array(0), v: new Float32Array(0) }, new Float32Array(0)).count, 0);
    const refused = (text, ...given) => {
        for (const query of ["nearestStarts", "anyStarts"]) assert.throws(() => scene[query](...given), (error) => error instanceof TypeError && text.test(error.message), String(text));
    };
    refused(/^starts: expected hits, .* found undefined$/);
    refused(/^starts: expected hits, .* found Array$/, [good], up);
    refused(/^starts.u: expected a Float32Array of 1 elements, .* found Array of 1$/, { ...good, u: [0] }, up);
    refused(/^starts.v: expected a Float64Array of 1 elements, .* found Float32Array of 1$/, { ...good, u: Float64Array.of(0) }, up);
    refused(/^starts.triangle: expected a Uint32Array of 1 elements, .* found Uint32Array of 2$/, { ...good, triangle: new Uint32Array(2) }, up);
    refused(/^directions: expected a Float32Array of 3 elements, three numbers a ray; found Array of 3$/, good, [0, 0, 1]);
    refused(/^directions: .* found Float32Array of 6$/, good, new Float32Array(6));
    refused(/^tmax: expected a Float32Array of 1 elements, or a number for all rays; found Array of 1$/, good, up, [1]);
    refused(/^tmax: .* found Float32Array of 2$/, good, up, new Float32Array(2));
});

test("rays in double are not rounded, and their hits are in double", () => {
    const [model, file] = [join(folder, "triangle.obj"), join(folder, "triangle.bth")];
    writeFileSync(model, "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n");
    execFileSync(BTHC, ["compile", model, "-o", file, "--quiet"]);
    const scene = bth.open(readFileSync(file));
    const above = 2 ** -40, down = [0, 0, -1, Infinity];
    const rays = Float64Array.of(0.25, 0.25, above, 0, ...down, 0.25, 0.25, -above, 0, ...down, 0.3, 0.5, 3, 0, ...down);
    const [{ t, u, v, instance, triangle }, any] = [scene.nearest(rays), scene.any(rays)];
    for (const numbers of [t, u, v]) assert.ok(numbers instanceof Float64Array);
    assert.deepEqual([[...t], u[0], u[1], [...v]], [[above, Infinity, 3], 0.25, 0, [0.25, 0, 0.5]]);
    // A float is farther from 0.3.
    assert.ok(Math.abs(u[2] - 0.3) <= 2 ** -28);
    assert.deepEqual([[...instance], [...triangle], [...any]], [[0, 2 ** 32 - 1, 0], [0, 2 ** 32 - 1, 0], [1, 0, 1]]);
    // Positions at hits in double are in double; others as for hits in float.
    const surface = scene.surface({ count: 3, t, u, v, instance, triangle });
    assert.ok(surface.position instanceof Float64Array && surface.normal instanceof Float32Array);
    assert.deepEqual([...surface.position], [0.25, 0.25, 0, NaN, NaN, NaN, Math.fround(0.3), 0.5, 0]);
    assert.ok(scene.surface(scene.nearest(Float32Array.from(rays))).position instanceof Float32Array);
    assert.equal(scene.nearestStarts({ count: 3, u, v, instance, triangle }, new Float32Array(9).fill(1)).count, 3);
    assert.throws(() => scene.steps(rays), /^TypeError: rays: expected a Float32Array of eight .* found Float64Array of 24$/);
    scene.close();
});

test("rays whose numbers are floats have the hits of floats, rounded no more, over several chunks", () => {
    for (const name of ["gyroid.bth", "carousel.bth"]) {
        const scene = bth.open(readFileSync(join(folder, name)));
        const rays = raysInto(scene.bounds, 10_000, 4), hits = scene.nearest(rays);
        const wide = scene.nearest(Float64Array.from(rays));
        for (const name of ["instance", "triangle"]) assert.deepEqual(wide[name], hits[name]);
        // Both are rounded, by half a unit in the last place of a float and by 2^-40 (t) or 2^-28 (u and v).
        wide.t.forEach((t, i) => assert.ok(t === hits.t[i] || Math.abs(t - hits.t[i]) <= 2 ** -23 * Math.abs(t), `${t}, ${hits.t[i]}`));
        for (const name of ["u", "v"]) wide[name].forEach((u, i) => assert.ok(Math.abs(u - hits[name][i]) <= 2 ** -24 + 2 ** -27));
        assert.deepEqual(scene.any(Float64Array.from(rays)), scene.any(rays));
        scene.close();
    }
});

test("the closest points to points in double, and how often they are enclosed", () => {
    const scene = bth.open(readFileSync(join(folder, "triangle.bth"))), above = 2 ** -40, none = 2 ** 32 - 1;
    const points = Float64Array.of(0.25, 0.25, above, -3, -4, 0, 0.5, -2, 0, 9, 9, 9, NaN, 0, 0);
    const { count, distance, point, u, v, instance, triangle, feature } = scene.closest(points, 5);
    assert.deepEqual([count, ...distance], [5, above, 5, 2, Infinity, Infinity]);
    assert.deepEqual([...point], [0.25, 0.25, 0, 0, 0, 0, 0.5, 0, 0, ...Array(6).fill(NaN)]);
    assert.deepEqual([[...u], [...v]], [[0.25, 0, 0.5, NaN, NaN], [0.25, 0, 0, NaN, NaN]]);
    for (const index of [instance, triangle]) assert.deepEqual([...index], [0, 0, 0, none, none]);
    assert.deepEqual([...feature], [0, 4, 1, none, none]);
    assert.deepEqual([...scene.closest(points, -1).triangle], Array(5).fill(none));
    assert.deepEqual([...scene.winding(points)], [0, 0, 0, 0, 0]);
    const refused = (query, text) => assert.throws(query, (error) => error instanceof TypeError && text.test(error.message), String(text));
    refused(() => scene.closest([0, 0, 0]), /^points: expected a Float32Array or Float64Array of three numbers a point; found Array of 3$/);
    refused(() => scene.winding(new Float64Array(4)), /^points: .* found Float64Array of 4$/);
    refused(() => scene.closest(points, "5"), /^radius: expected a number; found String$/);
    scene.close();
    assert.throws(() => scene.closest(points), BthError);
    // A closed box: all points of a grid in and around it, which are more than a chunk.
    const [model, file] = [join(folder, "box.obj"), join(folder, "box.bth")];
    const corners = Array.from({ length: 8 }, (_, i) => `v ${8 * (i & 1)} ${8 * ((i >> 1) & 1)} ${8 * (i >> 2)}`);
    const faces = ["1 3 4 2", "5 6 8 7", "1 2 6 5", "3 7 8 4", "1 5 7 3", "2 4 8 6"];
    writeFileSync(model, [...corners, ...faces.map((face) => `f ${face}`)].join("\n"));
    execFileSync(BTHC, ["compile", model, "-o", file, "--quiet"]);
    const box = bth.open(readFileSync(file)), side = 20, grid = new Float32Array(3 * side ** 3);
    for (let i = 0; i < side ** 3; i++) grid.set([i % side, Math.floor(i / side) % side, Math.floor(i / side ** 2)].map((x) => x - 5.5), 3 * i);
    const found = box.closest(grid), winding = box.winding(Float64Array.from(grid));
    for (let i = 0; i < side ** 3; i++) {
        const at = grid.subarray(3 * i, 3 * i + 3), out = at.map((x) => Math.max(0, -x, x - 8));
        const inside = out.every((x) => x === 0), expected = inside ? Math.min(...at, ...at.map((x) => 8 - x)) : Math.hypot(...out);
        assert.equal(winding[i], Number(inside));
        assert.ok(Math.abs(found.distance[i] - expected) <= 2 ** -28 * expected, `${at}: ${found.distance[i]}`);
    }
    box.close();
});

test("damaged files are refused with the code of the specification", () => {
    const names = readdirSync(join(conformance, "invalid")).filter((name) => name.endsWith(".bth"));
    let refused = 0;
    for (const name of names) {
        const code = `BTH-${name.split(/[-.]/)[0]}`;
        try {
            bth.open(readFileSync(join(conformance, "invalid", name))).close();
        } catch (error) {
            assert.ok(error instanceof BthError, `${name}: ${error}`);
            assert.equal(error.code, code, `${name}: ${error.message}`);
            refused++;
        }
    }
    // The others break what only `bthc verify` looks at.
    assert.ok(refused > names.length / 2, `${refused} of ${names.length}`);
    for (const [file, text] of [[new ArrayBuffer(0), /^BTH-F001: byte 0: expected 128 bytes, found 0 \(hint: this is not a BTH file/], [new ArrayBuffer(4096), /^BTH-F002: byte 0: expected .*, found .* \(hint: /]]) {
        assert.throws(() => bth.open(file), (error) => error instanceof BthError && text.test(error.message));
    }
});

test("the surface at a hit", () => {
    const scene = bth.open(readFileSync(join(conformance, "valid/triangle.bth")));
    const hits = scene.nearest(Float32Array.of(0.25, 0.25, 1, 0, 0, 0, -1, Infinity, 9, 9, 1, 0, 0, 0, -1, Infinity));
    const surface = scene.surface(hits);
    assert.ok(hits.t[0] < Infinity && hits.t[1] === Infinity);
    const position = [0.25, 0.25, 1 - hits.t[0]];
    for (let k = 0; k < 3; k++) assert.ok(Math.abs(surface.position[k] - position[k]) < 1e-6);
    assert.equal(Math.abs(surface.geometricNormal[2]), 1);
    assert.deepEqual([...surface.color.subarray(0, 4)], [1, 1, 1, 1]);
    assert.ok(Number.isNaN(surface.position[3]) && surface.object[1] === 0xffffffff);
});

test("materials, textures and their images are those of the source", () => {
    const [model, file] = [join(folder, "quads.gltf"), join(folder, "quads.bth")];
    const document = JSON.parse(quads());
    // A texture whose coordinates are a second set.
    document.materials[0].emissiveFactor = [0.5, 0.25, 1];
    document.materials[0].emissiveTexture = { index: 1, texCoord: 1 };
    document.textures.push({ source: 0 });
    document.meshes[0].primitives[0].attributes.TEXCOORD_1 = 2;
    writeFileSync(model, JSON.stringify(document));
    execFileSync(BTHC, ["compile", model, "-o", file, "--materials", "--quiet"]);
    const scene = bth.open(readFileSync(file));
    const [glass, green] = scene.materials(0);
    assert.deepEqual(glass, {
        baseColor: [1, 1, 1, 1], baseColorTexture: 0, emissive: [0.5, 0.25, 1], emissiveTexture: 1, alpha: "blend", alphaCutoff: 0,
        doubleSided: false, unlit: true, gloss: glass.gloss,
    });
    const [brass] = bth.open(readFileSync(join(conformance, "valid/gloss.bth"))).materials(0);
    assert.deepEqual(brass.gloss, {
        metallic: 1, roughness: 0.25, metallicRoughnessTexture: 1, normalTexture: 0, normalScale: 1, occlusionTexture: null, occlusionStrength: 1,
    });
    assert.equal(bth.open(readFileSync(join(conformance, "valid/materials.bth"))).materials(0)[0].gloss, null);
    assert.deepEqual([green.baseColor, green.baseColorTexture, green.emissiveTexture, green.alpha, green.doubleSided], [[0, 0.5, 0, 1], null, null, "opaque", true]);
    const textures = scene.textures(0);
    const transform = [1, 0, 0, 0, 1, 0];
    assert.deepEqual(textures[0], { image: 0, wrap: ["clamp", "clamp"], filter: "nearest", uvSet: 0, transform });
    assert.deepEqual(textures[1], { image: 0, wrap: ["repeat", "repeat"], filter: "linear", uvSet: 1, transform });
    for (const texture of [0, 1]) assert.deepEqual([...scene.image(0, texture)], [...png(2, 2, FOUR_TEXELS)]);
    const hits = scene.nearest(Float32Array.of(0.5, 0.25, 1, 0, 0, 0, -1, Infinity, 1.5, 1.5, 1, 0, 0, 0, -1, Infinity));
    const { uv, secondUv, material, color } = scene.surface(hits);
    assert.deepEqual([[...uv.subarray(0, 2)], [...secondUv.subarray(0, 2)]], [[0.75, 0.375], [0.75, 0.375]]);
    assert.deepEqual([...material, ...color.subarray(4)], [0, 1, 0, 0.5, 0, 1]);
    // What is not kept, and what is not there.
    const plain = bth.open(readFileSync(join(conformance, "valid/triangle.bth")));
    assert.deepEqual([plain.materials(0), plain.textures(0)], [[], []]);
    for (const object of [1, -1, 0.5, NaN, "0", undefined, 2 ** 32]) {
        assert.throws(() => plain.materials(object), (error) => error instanceof RangeError && /^object: expected an index below 1; found/.test(error.message));
        assert.throws(() => scene.textures(object), RangeError);
        assert.throws(() => scene.image(object, 0), RangeError);
    }
    for (const texture of [2, -1, 0.5, NaN, "0", undefined, 2 ** 32]) assert.throws(() => scene.image(0, texture), /^RangeError: texture: expected the index of a texture of object 0/);
    assert.throws(() => plain.image(0, 0), RangeError);
    scene.close();
    for (const call of [() => scene.materials(0), () => scene.textures(0), () => scene.image(0, 0)]) assert.throws(call, BthError);
});

test("what files hold is counted", () => {
    const counts = (name) => {
        const scene = bth.open(readFileSync(join(conformance, "valid", name)));
        return [scene.objects, scene.instances, scene.triangles];
    };
    assert.deepStrictEqual(counts("no-objects.bth"), [0, 0, 0]);
    assert.deepStrictEqual(counts("groups.bth"), [2, 2, 8]);
    assert.deepStrictEqual(counts("scene-moving.bth"), [2, 3, 2]);
});

test("a scene moves when its time is set", () => {
    const scene = bth.open(readFileSync(join(conformance, "valid/scene-moving.bth")));
    assert.ok(scene.frames.last > scene.frames.first);
    const first = scene.bounds;
    scene.seconds = scene.frames.last / scene.frames.rate;
    assert.notDeepEqual(scene.bounds, first);
    const model = bth.open(readFileSync(join(conformance, "valid/triangle.bth")));
    assert.equal(model.frames, null);
    assert.throws(() => (model.seconds = 1), (error) => error instanceof BthError && /^seconds: this file is a model/.test(error.message));
    assert.equal(model.seconds, 0);
});

test("arguments of the wrong kind and closed scenes are errors", () => {
    const scene = bth.open(readFileSync(join(conformance, "valid/triangle.bth")));
    assert.throws(() => scene.nearest(new Float32Array(9)), TypeError);
    assert.throws(() => scene.any([0, 0, 0, 0, 0, 0, 1, 1]), TypeError);
    const sent = new Float32Array(8);
    structuredClone(sent, { transfer: [sent.buffer] });
    for (const query of ["nearest", "any", "steps"]) {
        assert.throws(() => scene[query](sent), (error) => error instanceof TypeError && /detached/.test(error.message));
        scene[query](new Float32Array(0));
    }
    scene.close();
    scene.close();
    assert.throws(() => scene.nearest(new Float32Array(8)), BthError);
});

/** The module with a memory of at most so many pages of 64 KiB. */
function withMemory(module, pages) {
    const leb = (number) => (number < 128 ? [number] : [(number & 127) | 128, ...leb(number >> 7)]);
    const read = (at) => {
        let value = 0, shift = 0;
        do (value |= (module[at] & 127) << shift), (shift += 7);
        while (module[at++] & 128);
        return [value, at];
    };
    for (let at = 8; at < module.length; ) {
        const [length, from] = read(at + 1);
        if (module[at] === 5) {
            // One memory: whether it has a maximum, its minimum, its maximum.
            const section = [1, 1, ...leb(read(from + 2)[0]), ...leb(pages)];
            return Buffer.concat([module.subarray(0, at), Buffer.from([5, section.length, ...section]), module.subarray(from + length)]);
        }
        at = from + length;
    }
    throw new Error("the module has no memory");
}

test("where memory ends calls throw errors, and work again when there is some", async () => {
    const full = await load(withMemory(readFileSync(join(process.env.DIST, "bth.wasm")), 256));
    const file = (name) => readFileSync(join(conformance, "valid", name));
    const model = full.open(file("tets-link32.bth")), moving = full.open(file("deformers.bth"));
    const rays = raysInto(model.bounds, 4096, 5);
    const expected = bth.open(file("tets-link32.bth")).nearest(rays);
    const noMemory = (error) => error instanceof BthError && error.code === "BTH-O001" && /not enough memory/.test(error.message);
    const others = [];
    for (const name of ["tets-link32.bth", "two-objects.bth", "no-objects.bth"]) {
        const bytes = file(name);
        assert.throws(() => { for (;;) others.push(full.open(bytes)); }, noMemory);
    }
    assert.throws(() => full.open(new ArrayBuffer(1 << 24)), noMemory);
    // Each trap would leave a part of the stack in use, of which there is 1 MiB.
    for (let i = 0; i < 300; i++) assert.throws(() => model.nearest(rays), noMemory);
    assert.throws(() => (moving.seconds = 1), noMemory);
    assert.throws(() => moving.bounds, BthError);
    for (const scene of [...others, moving]) scene.close();
    assert.deepEqual(model.nearest(rays), expected);
    full.open(file("deformers.bth")).seconds = 1;
});

test("calls work again after some that recursion left too little stack", async () => {
    const scene = (await load(bth.module)).open(readFileSync(join(conformance, "valid/tets-link32.bth")));
    const rays = raysInto(scene.bounds, 16, 8), expected = scene.nearest(rays);
    let failed = 0;
    for (let i = 0; i < 3; i++) {
        // From the deepest call on, until there is stack enough.
        let done = false;
        const deeper = () => {
            try { deeper(); } catch {}
            if (done) return;
            try { scene.nearest(rays); done = true; } catch { failed++; }
        };
        deeper();
    }
    assert.ok(failed > 0);
    assert.deepEqual(scene.nearest(rays), expected);
});

test("what is no file is refused with what is expected", async () => {
    const bytes = readFileSync(join(conformance, "valid/triangle.bth"));
    const buffer = bytes.buffer.slice(bytes.byteOffset, bytes.byteOffset + bytes.length), shared = new SharedArrayBuffer(bytes.length);
    new Uint8Array(shared).set(bytes);
    for (const file of [bytes, buffer, shared, new DataView(buffer), runInNewContext("new Uint8Array(bytes).buffer", { bytes })]) bth.open(file).close();
    const refused = (file, found) => assert.throws(() => bth.open(file), (error) => error instanceof TypeError && found.test(error.message), String(found));
    refused(Promise.resolve(buffer), /expected an ArrayBuffer .* found Promise: await it$/);
    refused(new Response(buffer), /found Response: await its arrayBuffer\(\)$/);
    refused(new Blob([bytes]), /found Blob: await its arrayBuffer\(\)$/);
    refused("triangle.bth", /found String$/);
    refused(5, /found Number$/);
    refused(undefined, /found undefined$/);
    refused(null, /found null$/);
    refused([...bytes], /found Array$/);
    structuredClone(buffer, { transfer: [buffer] });
    refused(buffer, /detached/);
});

test("files of 2 GiB and more are refused", () => {
    const refused = (error) => error instanceof BthError && error.code === "BTH-O001" && /less than 2 GiB.* found 2147483648 bytes$/.test(error.message);
    assert.throws(() => bth.open(new ArrayBuffer(2 ** 31)), refused);
});

test("hits need all their columns", () => {
    const scene = bth.open(readFileSync(join(conformance, "valid/triangle.bth")));
    const hits = scene.nearest(Float32Array.of(0.25, 0.25, 1, 0, 0, 0, -1, Infinity, 0.5, 0.25, 1, 0, 0, 0, -1, Infinity));
    assert.equal(scene.surface(structuredClone({ ...hits })).count, 2);
    const refused = (changed) => assert.throws(() => scene.surface({ ...hits, ...changed }), TypeError, Object.keys(changed).join());
    refused({ triangle: hits.triangle.subarray(1) });
    refused({ t: hits.t.subarray(1) });
    refused({ u: Float64Array.from(hits.u) });
    refused({ v: [...hits.v] });
    refused({ instance: Int32Array.from(hits.instance) });
    refused({ v: undefined });
    refused({ count: 3 });
    refused({ count: undefined });
    const nothing = (hits, found) => assert.throws(() => scene.surface(hits), (error) => error instanceof TypeError && found.test(error.message), String(hits));
    nothing(undefined, /^hits: expected the answer of nearest; found undefined$/);
    nothing(null, /found null$/);
    nothing([hits], /found Array$/);
    nothing({ ...hits, v: undefined }, /^hits.v: expected a Float32Array of 2 elements, .* found undefined$/);
});

test("rays and hits of another window are taken", () => {
    const scene = bth.open(readFileSync(join(conformance, "valid/triangle.bth")));
    const rays = Float32Array.of(0.25, 0.25, 1, 0, 0, 0, -1, Infinity, 9, 9, 1, 0, 0, 0, -1, Infinity), hits = scene.nearest(rays);
    const elsewhere = (array) => runInNewContext(`${array.constructor.name}.from(array)`, { array: [...array] });
    assert.ok(!(elsewhere(rays) instanceof Float32Array));
    assert.deepEqual(scene.nearest(elsewhere(rays)), hits);
    assert.deepEqual(scene.any(elsewhere(rays)), scene.any(rays));
    const columns = Object.fromEntries(["t", "u", "v", "instance", "triangle"].map((name) => [name, elsewhere(hits[name])]));
    assert.deepEqual(scene.surface({ count: hits.count, ...columns }), scene.surface(hits));
    const refused = (rays, found) => assert.throws(() => scene.nearest(rays), (error) => error instanceof TypeError && found.test(error.message), String(found));
    refused(new Float64Array(9), /found Float64Array of 9$/);
    refused(new Float32Array(9), /found Float32Array of 9$/);
    refused(new Int32Array(8), /^rays: expected a Float32Array or Float64Array of eight numbers a ray .* found Int32Array of 8$/);
    refused([...rays], /found Array of 16$/);
    refused(undefined, /found undefined$/);
    refused(new DataView(new ArrayBuffer(32)), /found DataView of 32 bytes$/);
});

test("a time is a finite number", () => {
    const scene = bth.open(readFileSync(join(conformance, "valid/scene-moving.bth")));
    scene.seconds = 0.5;
    const refused = [[NaN, "NaN"], [-Infinity, "-Infinity"], ["1", "String"], [undefined, "undefined"], [null, "null"], [1n, "BigInt"], [[1], "Array"]];
    for (const [seconds, found] of refused) {
        assert.throws(() => (scene.seconds = seconds), (error) => error instanceof TypeError && error.message.endsWith(`, found ${found}`), found);
    }
    assert.equal(scene.seconds, 0.5);
});

test("the types need no library but ES2022", (t) => {
    const types = join(process.env.DIST, "index.d.ts"), code = readFileSync(types, "utf8").replace(/\/\*[^]*?\*\/|\/\/.*/g, "");
    assert.doesNotMatch(code, /\b(WebAssembly|BufferSource|URL|Response|Blob|Worker|Buffer)\b/);
    if (!process.env.TSC) return t.diagnostic("no compiler of TypeScript: TSC names none");
    // A program of each kind: without other types, and with those of browsers.
    for (const [lib, more] of [["es2022", ""], ["es2022,dom", "load(fetch(new URL('a', 'b:'))); new WebAssembly.Instance(bth.module); new Worker('').postMessage(bth.module);"]]) {
        const program = join(folder, "program.ts");
        writeFileSync(program, `import { load, BthError, type Bth, type Hit, type Hits, type Scene, type Surface } from "./bth/index.js";
            import { loadCompiler } from "./bth/compile.js";
            const bth: Bth = await load(new Uint8Array(8));
            await load(Promise.resolve(bth.module));
            const scene: Scene = bth.open(new ArrayBuffer(8));
            const hits = scene.nearest(Float32Array.of(1));
            const surface: Surface = scene.surface(scene.nearestStarts(hits, Float32Array.of(1), 2));
            const wide = scene.nearest(Float64Array.of(1)), t: Float64Array = wide.t, at: Float64Array = scene.surface(wide).position;
            scene.nearestStarts(wide, Float32Array.of(1));
            const away: Float64Array = scene.closest(t, 2).distance, turns: Int32Array = scene.winding(hits.t);
            // @ts-expect-error: steps are those of rays in float.
            scene.steps(t);
            const hit: Partial<Hit> = {}, found: boolean = scene.nearestOne([1], hit, "front"), all: Hits<Float64Array> = scene.allHits(t);
            const bytes: Uint8Array = (await loadCompiler()).compile(hits.t, hits.instance, { deformable: true });
            bth.instances([bth.open(bytes)], hits.t, [0]).setTransforms(t, 1);
            // @ts-expect-error: a side is front, back or both.
            scene.anyOne(t, "left");
            scene.anyStarts({ count: 0, u: hits.u, v: hits.v, instance: hits.instance, triangle: hits.triangle }, hits.t, hits.t);
            // @ts-expect-error: it is not to be set.
            scene.objects = 1;
            // @ts-expect-error: rays are no array.
            scene.nearest([1]);
            // @ts-expect-error: the bytes have to be awaited.
            bth.open(Promise.resolve(new ArrayBuffer(8)));
            ${more} export { surface, at, away, turns, found, all, BthError };`);
        mkdirSync(join(folder, "bth"), { recursive: true });
        for (const name of ["index.d.ts", "compile.d.ts"]) copyFileSync(join(dirname(types), name), join(folder, "bth", name));
        const compilerOptions = { strict: true, noEmit: true, lib: lib.split(","), types: [], target: "es2022", module: "esnext", moduleResolution: "bundler" };
        writeFileSync(join(folder, "tsconfig.json"), JSON.stringify({ compilerOptions, files: [program] }));
        execFileSync(process.env.TSC, ["-p", folder], { encoding: "utf8" });
    }
});

test("the package is complete", () => {
    const { files } = JSON.parse(readFileSync(join(process.env.DIST, "package.json"), "utf8"));
    for (const name of files) assert.ok(readFileSync(join(process.env.DIST, name)).length > 0, name);
    for (const name of ["LICENSE-MIT", "LICENSE-APACHE", "NOTICES"]) assert.ok(files.includes(name), name);
    assert.match(readFileSync(join(process.env.DIST, "NOTICES"), "utf8"), /^blake3 /m);
});

test("what is no folder is refused before anything is built", () => {
    for (const given of [["--help"], ["one", "two"]]) {
        const { status, stderr } = spawnSync(process.execPath, [resolve(here, "../build.mjs"), ...given], { cwd: folder, encoding: "utf8", timeout: 5000 });
        assert.equal(status, 2, String(given));
        assert.match(stderr, /^usage: /);
    }
    assert.ok(!readdirSync(folder).some((name) => ["--help", "one", "two"].includes(name)));
});

test("a compiled module and bytes can be loaded", async () => {
    assert.ok((await load(bth.module)).simd);
    const bytes = readFileSync(join(process.env.DIST, "bth.wasm"));
    assert.ok((await load(bytes)).simd);
    assert.ok((await load(Promise.resolve(bth.module))).simd);
    assert.ok((await load(new DataView(bytes.buffer, bytes.byteOffset, bytes.length))).simd);
    assert.ok((await load({ href: pathToFileURL(join(resolve(process.env.DIST), "bth.wasm")).href })).simd);
    assert.ok((await load(runInNewContext("new Uint8Array(bytes).buffer", { bytes }))).simd);
});

test("what is no module is refused with what is expected", async () => {
    for (const [source, found] of [[null, "null"], [5, "Number"], [[], "Array"], [{}, "Object"], [new SharedArrayBuffer(8), "SharedArrayBuffer"]]) {
        await assert.rejects(load(source), (error) => error instanceof TypeError && /expected a module of WebAssembly as its URL/.test(error.message) && error.message.endsWith(`found ${found}`), found);
    }
    // The shortest module: the magic number and the version.
    const another = Uint8Array.of(0, 97, 115, 109, 1, 0, 0, 0);
    await assert.rejects(load(another), (error) => error instanceof TypeError && /expected bth.wasm; found another module/.test(error.message));
});

test("bundlers for browsers leave out what is of node", () => {
    const file = (name) => readFileSync(join(process.env.DIST, name), "utf8"), { browser } = JSON.parse(file("package.json"));
    const imports = [...file("module.js").matchAll(/\bimport\((.*)"(node:[^"]+)"\)|from "(node:[^"]+)"/g)];
    assert.equal(imports.length, 1);
    for (const [text, comments, name] of imports) {
        assert.ok(/webpackIgnore: true/.test(comments) && /@vite-ignore/.test(comments), text);
        assert.equal(browser[name], false, text);
    }
    // What is not a constant is left as it is; the default is taken along.
    assert.match(file("index.js"), /new URL\("\.\/bth\.wasm", import\.meta\.url\)/);
    assert.match(file("compile.js"), /new URL\("\.\/compile\.wasm", import\.meta\.url\)/);
    assert.match(file("module.js"), /new URL\(\/\* webpackIgnore: true \*\/ source/);
});
