// A worker: it holds a copy of the file and shades tiles.

import { load } from "../index.js";
import { materialsOf } from "./materials.js";
import { compiledModel } from "./models.js";
import { shadeTile } from "./shading.js";

let bth = null;
let scene = null, materials = null;

const answers = {
    async module({ module }) {
        bth = await load(module);
        return {};
    },
    async open({ file }) {
        scene?.close();
        scene = null;
        scene = bth.open(file);
        materials = await materialsOf(scene);
        const { objects, instances, triangles, frames, bounds } = scene;
        return { objects, instances, triangles, frames, bounds, undecoded: materials.undecoded };
    },
    compile({ module, name, file }) {
        return compiledModel(module, name, file);
    },
    seconds({ seconds }) {
        scene.seconds = seconds;
        return { bounds: scene.bounds };
    },
    tile({ job }) {
        const start = performance.now();
        const picture = shadeTile(scene, materials, job);
        return { picture, milliseconds: performance.now() - start };
    },
    pick({ ray }) {
        const hits = scene.nearest(ray);
        return { t: hits.t[0], instance: hits.instance[0], triangle: hits.triangle[0] };
    },
};

// One request after the other: each waits for the one before.
let last = Promise.resolve();
addEventListener("message", ({ data }) => {
    last = last.then(async () => {
        try {
            const answer = await answers[data.kind](data);
            postMessage({ id: data.id, answer }, answer.picture ? [answer.picture.buffer] : []);
        } catch (error) {
            postMessage({ id: data.id, error: String(error.message ?? error) });
        }
    });
});
