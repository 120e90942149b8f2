// The colours of a tile of the picture in each mode.

import { directionThrough, onGround } from "./camera.js";
import { texel } from "./materials.js";
import { add, blend, cosineDirection, dot, length, mix, samplePoint, scale, tilted, unit } from "./vectors.js";

/** Ambient-occlusion rays of a sample in mode shaded and in mode ao. */
const AMBIENT_RAYS = 2, AO_RAYS = 4;
/** Length of ambient-occlusion rays relative to the diagonal of the scene, of pictures from outside and from inside. */
const OPEN_OUTSIDE = 0.5, OPEN_INSIDE = 0.08;
/** How far the lamp of a room is above the camera, relative to the diagonal of the scene. */
const LAMP_HEIGHT = 1e-3;
/** Surfaces that let a part of the light through, behind each other, at most; the last one counts as opaque. */
const MOST_LAYERS = 16;
/** Radius of the key light at distance 1, which decides how soft its shadows are. */
const KEY_RADIUS = 0.16;

// Light of the studio: linear red, green and blue.
const CLAY = [0.57, 0.515, 0.465];
const KEY = [1.15, 1.08, 0.97];
const FILL = [0.12, 0.145, 0.19];
const SKY = [0.33, 0.37, 0.43];
const BOUNCE = [0.22, 0.2, 0.18];
const BACKGROUND_TOP = [0.52, 0.56, 0.62];
const BACKGROUND_BOTTOM = [0.8, 0.81, 0.82];
const DARK = [0.02, 0.02, 0.02];

/**
 * The colours of a tile, three numbers a pixel, row by row; in mode steps the first is the number of steps. `materials` are those of
 * the scene as `materialsOf` has them. A job has the camera, the
 * mode, the size of the whole picture, the tile (left, top, width, height), the distance of its pixels in those of the picture
 * (`step`), the number of the sample, the scene's bounds and whether the camera is inside them.
 */
export function shadeTile(scene, materials, job) {
    const samples = samplesOf(job);
    const shade = { shaded, normals, ao: ambientOcclusion, steps }[job.mode];
    const colors = shade({ scene, materials }, job, samples);
    const { width, height } = job.tile;
    const picture = new Float32Array(3 * width * height);
    samples.forEach(({ x, y }, i) => picture.set(colors[i], 3 * (y * width + x)));
    return picture;
}

/** The samples of a tile in blocks of 8 by 8 pixels, which are traced together. */
function samplesOf({ camera, size, tile, step, sample }) {
    const samples = [];
    for (let y0 = 0; y0 < tile.height; y0 += 8) {
        for (let x0 = 0; x0 < tile.width; x0 += 8) {
            for (let y = y0; y < Math.min(y0 + 8, tile.height); y++) {
                for (let x = x0; x < Math.min(x0 + 8, tile.width); x++) {
                    const column = tile.left + x * step, row = tile.top + y * step;
                    const pixel = mix(mix(column) ^ row);
                    const [dx, dy] = samplePoint(pixel, 0, sample);
                    const h = (2 * (column + dx * step)) / size.width - 1, v = 1 - (2 * (row + dy * step)) / size.height;
                    samples.push({ x, y, pixel, h, v, direction: directionThrough(camera, h, v) });
                }
            }
        }
    }
    return samples;
}

/** Rays that are traced together. */
class Rays {
    constructor(capacity) {
        this.numbers = new Float32Array(8 * capacity);
        this.count = 0;
    }
    push(origin, direction, tmax) {
        const { numbers } = this, at = 8 * this.count++;
        for (let k = 0; k < 3; k++) {
            numbers[at + k] = origin[k];
            numbers[at + 4 + k] = direction[k];
        }
        numbers[at + 7] = tmax;
    }
    get used() {
        return this.numbers.subarray(0, 8 * this.count);
    }
}

/** Rays that start on surfaces and are traced together. */
class StartRays {
    constructor(capacity) {
        this.columns = Object.fromEntries(["u", "v", "tmax"].map((name) => [name, new Float32Array(capacity)]));
        for (const name of ["instance", "triangle"]) this.columns[name] = new Uint32Array(capacity);
        this.directions = new Float32Array(3 * capacity);
        this.count = 0;
    }
    push(start, direction, tmax) {
        const { columns, directions } = this, i = this.count++;
        columns.instance[i] = start.instance;
        columns.triangle[i] = start.triangle;
        columns.u[i] = start.u;
        columns.v[i] = start.v;
        columns.tmax[i] = tmax;
        for (let k = 0; k < 3; k++) directions[3 * i + k] = direction[k];
    }
    /** The arguments of the queries. */
    get used() {
        const { count } = this, used = { count };
        for (const [name, column] of Object.entries(this.columns)) used[name] = column.subarray(0, count);
        return [used, this.directions.subarray(0, 3 * count), used.tmax];
    }
}

/** Rays that go on from points: from surfaces, where they start exactly, and from the ground. */
class SecondaryRays {
    constructor(capacity) {
        this.fromSurfaces = new StartRays(capacity);
        this.fromGround = new Rays(capacity);
    }
    push(at, direction, tmax) {
        if (at.start === null) this.fromGround.push(at.point, direction, tmax);
        else this.fromSurfaces.push(at.start, direction, tmax);
    }
    /**
     * Traces all. Returns a function that takes the point of each ray, in the order of `push`, and
     * returns 1 if the ray is blocked.
     */
    blocked(scene) {
        const surfaces = scene.anyStarts(...this.fromSurfaces.used), ground = scene.any(this.fromGround.used);
        let surface = 0, onGround = 0;
        return (at) => (at.start === null ? ground[onGround++] : surfaces[surface++]);
    }
}

function cameraRays(camera, samples) {
    const rays = new Rays(samples.length);
    for (const { direction } of samples) rays.push(camera.eye, direction, Infinity);
    return rays.used;
}

const vector = (array, i) => [array[3 * i], array[3 * i + 1], array[3 * i + 2]];

/**
 * What the camera rays meet: for each sample the point, its normals on the side of the camera and its colours, or null. Rays pass
 * surfaces whose alpha lets them through: all below the cutoff of a mask, else as many as light passes.
 */
function visiblePoints({ scene, materials }, { camera, sample }, samples) {
    const points = new Array(samples.length).fill(null);
    // How far the ray of each sample has come.
    const reached = new Float64Array(samples.length);
    let hits = scene.nearest(cameraRays(camera, samples)), indices = samples.map((_, i) => i);
    for (let layer = 0; indices.length > 0; layer++) {
        const surface = scene.surface(hits);
        const further = new StartRays(indices.length), passed = [];
        for (let i = 0; i < indices.length; i++) {
            if (hits.t[i] === Infinity) continue;
            const { direction, pixel } = samples[indices[i]], seen = lookOf(materials, surface, i);
            reached[indices[i]] += hits.t[i];
            seen.start = { instance: hits.instance[i], triangle: hits.triangle[i], u: hits.u[i], v: hits.v[i] };
            if (seen.alpha < 1 && layer + 1 < MOST_LAYERS && seen.alpha <= samplePoint(pixel, 3 + layer, sample)[0]) {
                further.push(seen.start, direction, Infinity);
                passed.push(indices[i]);
                continue;
            }
            seen.point = add(camera.eye, direction, reached[indices[i]]);
            turnToCamera(seen, surface, i, direction);
            points[indices[i]] = seen;
        }
        hits = scene.nearestStarts(...further.used);
        indices = passed;
    }
    return points;
}

/** Notes the normals at a hit, on the side from which a ray comes. */
function turnToCamera(seen, surface, i, direction) {
    let geometric = vector(surface.geometricNormal, i), normal = vector(surface.normal, i);
    // A file without vertices has no normals: surfaces then face the camera.
    if (Number.isNaN(geometric[0])) geometric = normal = scale(direction, -1);
    if (dot(geometric, direction) > 0) geometric = scale(geometric, -1);
    if (dot(normal, geometric) < 0) normal = scale(normal, -1);
    seen.geometric = geometric;
    seen.normal = normal;
}

const NO_LIGHT = [0, 0, 0];

/** The surface at a hit: its colour, what it emits, the share of light that it stops, and whether it is shown without light. */
function lookOf(materials, surface, i) {
    const values = surface.color, from = 4 * i;
    const color = [values[from], values[from + 1], values[from + 2]];
    const seen = { color, emission: NO_LIGHT, alpha: 1, unlit: false, start: null, point: null, geometric: null, normal: null };
    const material = materials.of(surface.object[i], surface.material[i]);
    if (material === undefined) {
        const isWhite = color[0] === 1 && color[1] === 1 && color[2] === 1;
        if ((isWhite && surface.material[i] === 0xffffffff) || Number.isNaN(color[0])) seen.color = CLAY;
        return seen;
    }
    let share = values[from + 3];
    if (material.baseColorTexture) {
        const texels = texelAt(material.baseColorTexture, surface, i);
        for (let k = 0; k < 3; k++) color[k] *= texels[k];
        share *= texels[3];
    }
    seen.emission = material.emissive;
    if (material.emissiveTexture) {
        const texels = texelAt(material.emissiveTexture, surface, i);
        seen.emission = material.emissive.map((x, k) => x * texels[k]);
    }
    if (material.alpha === "mask") seen.alpha = share >= material.alphaCutoff ? 1 : 0;
    if (material.alpha === "blend") seen.alpha = share;
    seen.unlit = material.unlit;
    return seen;
}

/** The texel of a texture at a hit. */
function texelAt(texture, surface, i) {
    const coordinates = texture.uvSet === 0 ? surface.uv : surface.secondUv;
    return texel(texture, coordinates[2 * i], coordinates[2 * i + 1]);
}

function normals(shown, job, samples) {
    const { camera } = job;
    const shade = (along) => 0.5 + 0.5 * along;
    return visiblePoints(shown, job, samples).map((at) => {
        if (at === null) return DARK;
        const { normal } = at;
        return [shade(dot(normal, camera.right)), shade(dot(normal, camera.up)), shade(-dot(normal, camera.forward))];
    });
}

function steps({ scene }, { camera }, samples) {
    const { nodes, leaves, tets } = scene.steps(cameraRays(camera, samples));
    return samples.map((_, i) => [nodes[i] + leaves[i] + tets[i], 0, 0]);
}

function ambientOcclusion(shown, job, samples) {
    const { scene } = shown;
    const points = visiblePoints(shown, job, samples);
    const rays = new SecondaryRays(AO_RAYS * samples.length);
    points.forEach((at, i) => {
        if (at !== null) pushAmbient(rays, job, at, samples[i].pixel, AO_RAYS);
    });
    const blocked = rays.blocked(scene);
    return points.map((at) => {
        if (at === null) return DARK;
        const open = 1 - mean(blocked, at, AO_RAYS);
        return [0.9 * open, 0.9 * open, 0.9 * open];
    });
}

/** Adds rays over the hemisphere above a point. */
function pushAmbient(rays, { diagonal, inside, sample }, at, pixel, count) {
    for (let ray = 0; ray < count; ray++) {
        const direction = cosineDirection(at.geometric, samplePoint(pixel, 2, sample * count + ray));
        rays.push(at, direction, diagonal * (inside ? OPEN_INSIDE : OPEN_OUTSIDE));
    }
}

/** The share of the next rays of a point that are blocked. */
const mean = (blocked, at, count) => {
    let sum = 0;
    for (let i = 0; i < count; i++) sum += blocked(at);
    return sum / count;
};

/** A matte model under a soft key light and a fill light, with ambient occlusion, on a ground that only catches shadows. */
function shaded(shown, job, samples) {
    const { scene } = shown, { camera, diagonal, inside, bounds } = job;
    const lights = studio(job);
    const ground = inside ? null : dot(camera.vertical, camera.vertical.map((x, k) => (x < 0 ? bounds.upper[k] : bounds.lower[k])));
    const center = scale(add(bounds.lower, bounds.upper), 0.5);
    const points = visiblePoints(shown, job, samples).map((at, i) => {
        if (at !== null || ground === null) return at;
        const point = onGround(camera, samples[i].direction, ground);
        if (point === null) return null;
        const away = add(point, center, -1);
        const flat = length(add(away, camera.vertical, -dot(away, camera.vertical))) / diagonal;
        // Beyond a few diagonals the shadow is too faint to be seen.
        if (flat > 3) return null;
        return { start: null, point, geometric: camera.vertical, normal: camera.vertical, shadow: Math.exp(-((flat / 1.1) ** 2)) };
    });
    const each = 1 + AMBIENT_RAYS;
    const rays = new SecondaryRays(each * samples.length);
    points.forEach((at, i) => {
        if (at === null || at.unlit) return;
        pushKey(rays, lights, job, at, samples[i].pixel);
        pushAmbient(rays, job, at, samples[i].pixel, AMBIENT_RAYS);
    });
    const blocked = rays.blocked(scene);
    return points.map((at, i) => {
        const behind = background(samples[i]);
        if (at === null) return behind;
        if (at.unlit) return at.color;
        const key = at.facesKey ? 1 - blocked(at) : 0, open = 1 - mean(blocked, at, AMBIENT_RAYS);
        if (at.shadow !== undefined) return scale(behind, 1 - at.shadow * (0.62 * (1 - open) + 0.3 * (1 - key)));
        return shoulder(lit(at, lights, camera, samples[i].direction, key, open));
    });
}

/** The lights of a camera: the key light is far away, or beside the camera in a room. */
function studio({ camera, inside, diagonal }) {
    const { right, up, forward, vertical } = camera;
    const direction = add(add(scale(forward, -0.45), right, -0.55), vertical, 0.85);
    const fill = unit(add(add(scale(right, 0.85), forward, -0.5), vertical, 0.1));
    return { fill, key: inside ? null : unit(direction), lamp: add(camera.eye, up, LAMP_HEIGHT * diagonal) };
}

/**
 * Notes the unit direction to the key light without its radius. Adds a ray to the light if that is
 * in front of the surface.
 */
function pushKey(rays, lights, { diagonal, sample }, at, pixel) {
    const toLamp = add(lights.lamp, at.point, -1);
    at.toKey = lights.key ?? unit(toLamp);
    const distance = lights.key === null ? length(toLamp) * 0.999 : 4 * diagonal;
    const [x, y] = samplePoint(pixel, 1, sample);
    const to = unit(tilted(at.toKey, KEY_RADIUS * Math.sqrt(y), 1, 2 * Math.PI * x));
    at.facesKey = dot(to, at.geometric) > 0;
    if (at.facesKey) rays.push(at, to, distance);
}

/** The light that leaves a point towards the camera; `key` and `open` are the visible shares of key light and hemisphere. */
function lit(at, { fill }, camera, direction, key, open) {
    const facing = Math.max(dot(at.normal, at.toKey), 0);
    const fromFill = Math.max(dot(at.normal, fill), 0) * (0.4 + 0.6 * open);
    const ambient = blend(BOUNCE, SKY, dot(at.normal, camera.vertical) * 0.5 + 0.5);
    // A weak specular term (Blinn) shows curvature in the lit parts.
    const half = unit(add(at.toKey, direction, -1));
    const gloss = 0.06 * key * Math.max(dot(at.normal, half), 0) ** 24;
    const channel = (k) => at.emission[k] + at.color[k] * (KEY[k] * key * facing + FILL[k] * fromFill + ambient[k] * open) + KEY[k] * gloss;
    return [channel(0), channel(1), channel(2)];
}

/** A vertical gradient with a slight vignette. */
function background({ h, v }) {
    const part = v * 0.5 + 0.5;
    const color = blend(BACKGROUND_BOTTOM, BACKGROUND_TOP, part * part * (3 - 2 * part));
    return scale(color, 1 - 0.1 * (h * h + v * v));
}

/** Keeps bright colours below 1, smoothly. */
function shoulder(color) {
    const channel = (x) => (x < 0.7 ? x : 0.7 + 0.3 * (1 - Math.exp(-(x - 0.7) / 0.3)));
    return [channel(color[0]), channel(color[1]), channel(color[2])];
}
