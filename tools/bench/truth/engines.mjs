// three-mesh-bvh, for `bth-bench truth`. src/truth/process.rs describes commands and files; `setup` puts this file
// next to its modules.
import { readFileSync, writeFileSync } from 'node:fs';
import { createInterface } from 'node:readline';
import { BufferAttribute, BufferGeometry, DoubleSide, Ray } from 'three';
import { MeshBVH } from 'three-mesh-bvh';

const version = JSON.parse(readFileSync(new URL('node_modules/three-mesh-bvh/package.json', import.meta.url))).version;
const say = (...words) => process.stdout.write(words.join(' ') + '\n');
const cpu = () => { const { user, system } = process.cpuUsage(); return (user + system) * 1e-6; };
const NONE = 2 ** 32 - 1;

let set;

function load(folder) {
    const read = (name, type) => new type(new Uint8Array(readFileSync(`${folder}/${name}`)).buffer);
    const geometry = new BufferGeometry();
    geometry.setAttribute('position', new BufferAttribute(new Float32Array(read('positions', Float64Array)), 3));
    geometry.setIndex(new BufferAttribute(read('triangles', Uint32Array), 1));
    // Indirect: the order of the triangles stays.
    const bvh = new MeshBVH(geometry, { indirect: true });
    set = {
        folder, bvh, query: readFileSync(`${folder}/query`, 'utf8'),
        origins: read('origins', Float64Array), directions: read('directions', Float64Array),
    };
}

// The nearest hit from `near` to `far`, in units of the direction's length. Its rays have unit directions.
function first(ray, i, far) {
    ray.origin.fromArray(set.origins, 3 * i);
    ray.direction.fromArray(set.directions, 3 * i);
    const length = ray.direction.length();
    ray.direction.divideScalar(length);
    const hit = set.bvh.raycastFirst(ray, DoubleSide, 0, far * length);
    return hit && { t: hit.distance / length, id: hit.faceIndex, normal: hit.face.normal };
}

function run() {
    const count = set.origins.length / 3, ray = new Ray();
    const t = new Float64Array(count).fill(Infinity), id = new Uint32Array(count).fill(NONE);
    const start = cpu();
    for (let i = 0; i < count; i++) {
        if (set.query === 'inside') {
            // As its example of signed distances does it.
            set.directions.set([0, 0, 1], 3 * i);
            const hit = first(ray, i, Infinity);
            id[i] = hit && hit.normal.dot(ray.direction) > 0 ? 1 : 0;
        } else if (set.query === 'visible') {
            id[i] = first(ray, i, 1) ? 0 : 1;
        } else {
            const hit = first(ray, i, Infinity);
            if (hit) { t[i] = hit.t; id[i] = hit.id; }
        }
    }
    const taken = cpu() - start;
    writeFileSync(`${set.folder}/t`, t);
    writeFileSync(`${set.folder}/id`, id);
    return taken;
}

say('ok', version);
for await (const line of createInterface({ input: process.stdin })) {
    const start = cpu();
    if (line.startsWith('load ')) { load(line.slice(5)); say('ok', cpu() - start); } else { say('ok', run()); }
}
