// Rays from moving points all around to a mesh, and one from the pointer, through three.js's Raycaster.
import * as THREE from "three";
import { acceleratedRaycast, computeBoundsTreeAsync, ready } from "@bth/three";
import { counted, done, model, report, stage } from "./common.js";

await ready();
THREE.Mesh.prototype.raycast = acceleratedRaycast;

const RAYS = 400, { scene, camera, renderer, run } = stage({ eye: [0, 1.5, 6.6], target: [0, 0.1, 0] });
const knot = model(new THREE.TorusKnotGeometry(1, 0.33, 400, 75), 0x4f8fcf);
scene.add(knot);
await computeBoundsTreeAsync(knot.geometry);

// A line, a source and a hit for each ray.
const lines = new THREE.LineSegments(
    new THREE.BufferGeometry().setAttribute("position", new THREE.BufferAttribute(new Float32Array(6 * RAYS), 3)),
    new THREE.LineBasicMaterial({ color: 0x203040, transparent: true, opacity: 0.3 }),
);
lines.frustumCulled = false;
const balls = new THREE.InstancedMesh(new THREE.SphereGeometry(0.022, 12, 8), new THREE.MeshStandardMaterial({ color: 0xe2542c }), RAYS);
balls.frustumCulled = false;
const marker = new THREE.ArrowHelper(new THREE.Vector3(0, 0, 1), new THREE.Vector3(), 0.5, 0x0a8f4a, 0.12, 0.07);
scene.add(lines, balls, marker);
lines.raycast = balls.raycast = () => {};

const raycaster = new THREE.Raycaster(), matrix = new THREE.Matrix4(), from = new THREE.Vector3(), to = new THREE.Vector3();
const pointer = new THREE.Vector2(0.12, 0.2);
raycaster.firstHitOnly = true;
addEventListener("pointermove", ({ clientX, clientY }) => pointer.set((2 * clientX) / innerWidth - 1, 1 - (2 * clientY) / innerHeight));

/** The first hit of a ray with the knot. */
function cast(from, direction) {
    raycaster.set(from, direction);
    return raycaster.intersectObject(knot)[0];
}

let hits = 0;
run((seconds) => {
    knot.rotation.set(0.2 * seconds, 0.3 * seconds, 0);
    knot.updateMatrixWorld();
    const ends = lines.geometry.attributes.position, start = performance.now();
    hits = 0;
    for (let i = 0; i < RAYS; i++) {
        // Sources on a spiral around a ball, which miss its middle.
        const y = 1 - (2 * i + 1) / RAYS, angle = 2.4 * i + 0.1 * seconds, r = Math.sqrt(1 - y * y);
        from.set(2.2 * r * Math.cos(angle), 2.2 * y, 2.2 * r * Math.sin(angle));
        to.set(0.4 * Math.sin(i), 0.4 * Math.cos(3 * i), 0).sub(from).normalize();
        const hit = cast(from, to);
        if (hit) hits++;
        const end = hit?.point ?? from;
        ends.setXYZ(2 * i, ...from);
        ends.setXYZ(2 * i + 1, ...end);
        balls.setMatrixAt(i, matrix.makeTranslation(end));
    }
    const microseconds = (1000 * (performance.now() - start)) / RAYS;
    ends.needsUpdate = balls.instanceMatrix.needsUpdate = true;

    raycaster.setFromCamera(pointer, camera);
    const [under] = raycaster.intersectObject(knot);
    marker.visible = under !== undefined;
    if (under) {
        marker.position.copy(under.point);
        marker.setDirection(under.normal.transformDirection(knot.matrixWorld));
    }
    report(`${counted(knot.geometry.index.count / 3)} triangles, ${hits} of ${RAYS} rays hit, ${microseconds.toFixed(1)} µs each\n` +
        (under ? `under the pointer: triangle ${counted(under.faceIndex)}, ${under.distance.toFixed(3)} away` : "nothing under the pointer"));
    done({ hits, rays: RAYS, sameAsThree: window.sameAsThree ??= compare() });
});

/** True if three.js finds the same, triangle by triangle, in a pose that does not depend on the time. */
function compare() {
    knot.rotation.set(0, 0, 0);
    knot.updateMatrixWorld();
    raycaster.set(new THREE.Vector3(0.3, 0.2, 4), new THREE.Vector3(0.1, 0.02, -1).normalize());
    raycaster.firstHitOnly = false;
    const ours = raycaster.intersectObject(knot).map((hit) => hit.faceIndex), tree = knot.geometry.boundsTree;
    knot.geometry.boundsTree = null;
    const theirs = raycaster.intersectObject(knot).map((hit) => hit.faceIndex);
    knot.geometry.boundsTree = tree;
    raycaster.firstHitOnly = true;
    return ours.length > 0 && ours.join() === theirs.join();
}
