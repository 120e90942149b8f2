// Drop a GLB, OBJ, PLY or STL file: a worker compiles it, and the pointer finds its triangles. The compiled file can be saved.
import * as THREE from "three";
import { TeapotGeometry } from "three/addons/geometries/TeapotGeometry.js";
import { CompilerWorker } from "bth/compile";
import { BoundsTree, acceleratedRaycast, ready } from "@bth/three";
import { counted, done, model, report, stage } from "./common.js";

await ready();
THREE.Mesh.prototype.raycast = acceleratedRaycast;
const { scene, camera, controls, run } = stage({ eye: [2.4, 1.7, 3.4], floor: -0.8 }), worker = new CompilerWorker();
let shown = null, line = "";

/** The triangles of a file, as one geometry in world space. Loaders are fetched when they are needed. */
const LOADERS = {
    async glb(bytes) {
        const { GLTFLoader } = await import("three/addons/loaders/GLTFLoader.js");
        return (await new GLTFLoader().parseAsync(bytes, "")).scene;
    },
    async obj(bytes) {
        const { OBJLoader } = await import("three/addons/loaders/OBJLoader.js");
        return new OBJLoader().parse(new TextDecoder().decode(bytes));
    },
    async ply(bytes) {
        const { PLYLoader } = await import("three/addons/loaders/PLYLoader.js");
        return new THREE.Mesh(new PLYLoader().parse(bytes));
    },
    async stl(bytes) {
        const { STLLoader } = await import("three/addons/loaders/STLLoader.js");
        return new THREE.Mesh(new STLLoader().parse(bytes));
    },
};

/** Compiles the meshes of an object and shows them, at a size of about 2. */
async function show(object, name) {
    const positions = [], indices = [], vertex = new THREE.Vector3();
    object.updateMatrixWorld(true);
    object.traverse((mesh) => {
        if (!mesh.isMesh) return;
        const { index, attributes } = mesh.geometry, first = positions.length / 3, { count } = attributes.position;
        for (let i = 0; i < count; i++) positions.push(...vertex.fromBufferAttribute(attributes.position, i).applyMatrix4(mesh.matrixWorld));
        for (let i = 0; i < (index?.count ?? count); i++) indices.push(first + (index ? index.getX(i) : i));
    });
    const geometry = new THREE.BufferGeometry().setAttribute("position", new THREE.Float32BufferAttribute(positions, 3)).setIndex(indices);
    geometry.computeBoundingSphere();
    const { center, radius } = geometry.boundingSphere;
    geometry.translate(-center.x, -center.y, -center.z).scale(1.25 / radius, 1.25 / radius, 1.25 / radius).computeVertexNormals();
    report(`${name}: compiling ${counted(indices.length / 3)} triangles`);
    const start = performance.now(), file = await worker.compile(geometry.attributes.position.array, geometry.index.array);
    const seconds = (performance.now() - start) / 1000;
    const mesh = model(geometry, 0x6fa8a0, { side: THREE.DoubleSide });
    geometry.boundsTree = new BoundsTree(geometry, { file });
    if (shown) scene.remove(shown);
    scene.add((shown = mesh));
    save.href = URL.createObjectURL(new Blob([file]));
    save.download = `${name.replace(/\.\w+$/, "")}.bth`;
    line = `${name}: ${counted(indices.length / 3)} triangles compiled in ${seconds.toFixed(2)} s, ${(file.length / 2 ** 20).toFixed(1)} MiB`;
    return { triangles: indices.length / 3, bytes: file.length };
}

async function open(file) {
    const load = LOADERS[file.name.split(".").pop().toLowerCase()];
    if (!load) return report(`${file.name}: expected a GLB, OBJ, PLY or STL file`);
    try {
        await show(await load(await file.arrayBuffer()), file.name);
    } catch (error) {
        report(`${file.name}: ${error.message}`);
    }
}
addEventListener("dragover", (event) => event.preventDefault());
addEventListener("drop", (event) => {
    event.preventDefault();
    if (event.dataTransfer.files[0]) open(event.dataTransfer.files[0]);
});
const box = document.createElement("div"), save = document.createElement("a"), choose = document.createElement("input");
box.className = "controls";
save.textContent = "save as .bth";
choose.type = "file";
choose.addEventListener("change", () => choose.files[0] && open(choose.files[0]));
box.append(choose, " ", save);
document.body.append(box);

const dot = new THREE.Mesh(new THREE.SphereGeometry(0.025), new THREE.MeshBasicMaterial({ color: 0xe2542c })), raycaster = new THREE.Raycaster();
const pointer = new THREE.Vector2(0, 0.1);
dot.raycast = () => {};
scene.add(dot);
raycaster.firstHitOnly = true;
addEventListener("pointermove", ({ clientX, clientY }) => pointer.set((2 * clientX) / innerWidth - 1, 1 - (2 * clientY) / innerHeight));
const first = await show(new THREE.Mesh(new TeapotGeometry(1, 36)), "teapot");
run(() => {
    controls.update();
    raycaster.setFromCamera(pointer, camera);
    const [hit] = raycaster.intersectObject(shown);
    dot.visible = hit !== undefined;
    if (hit) dot.position.copy(hit.point);
    report(`${line}\n${hit ? `under the pointer: triangle ${counted(hit.faceIndex)}, ${hit.distance.toFixed(3)} away` : "drop a GLB, OBJ, PLY or STL file here"}`);
    done({ ...first, face: hit?.faceIndex });
});
