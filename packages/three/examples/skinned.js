// A character with a skeleton: its tree follows each pose (refit), so that rays hit what is seen.
import * as THREE from "three";
import { mergeGeometries } from "three/addons/utils/BufferGeometryUtils.js";
import { acceleratedRaycast, computeBoundsTreeAsync, ready } from "@bth/three";
import { counted, done, report, stage } from "./common.js";

await ready();
const original = THREE.SkinnedMesh.prototype.raycast;
THREE.SkinnedMesh.prototype.raycast = acceleratedRaycast;
const ARMS = 8, JOINTS = 6, LENGTH = 1.9, RAYS = 500;
const { scene, run } = stage({ eye: [2.6, 1.6, 4.4], target: [0, 0, 0], floor: -1.25 });

/** An octopus: a head, and arms whose vertices follow their joints. Each vertex has two bones with weights. */
function octopus() {
    const parts = [], bones = [new THREE.Bone()];
    const head = new THREE.SphereGeometry(0.62, 48, 36).scale(1, 1.2, 1).translate(0, 0.35, 0);
    parts.push(weighed(head, () => [0, 0, 0]));
    for (let arm = 0; arm < ARMS; arm++) {
        const angle = (2 * Math.PI * arm) / ARMS, first = bones.length;
        for (let joint = 0; joint < JOINTS; joint++) {
            const bone = new THREE.Bone();
            if (joint === 0) {
                bone.position.set(0.42 * Math.cos(angle), -0.1, 0.42 * Math.sin(angle));
                bone.rotation.y = -angle;
            } else {
                bone.position.x = LENGTH / JOINTS;
            }
            (joint === 0 ? bones[0] : bones[first + joint - 1]).add(bone);
            bones.push(bone);
        }
        const tube = new THREE.CylinderGeometry(0.02, 0.17, LENGTH, 20, 60).rotateZ(-Math.PI / 2).translate(LENGTH / 2, 0, 0);
        weighed(tube, (x) => {
            const at = Math.min((x / LENGTH) * JOINTS, JOINTS - 0.001), joint = Math.floor(at);
            return [first + joint, first + Math.min(joint + 1, JOINTS - 1), at - joint];
        });
        parts.push(tube.rotateY(-angle).translate(0.42 * Math.cos(angle), -0.1, 0.42 * Math.sin(angle)));
    }
    const mesh = new THREE.SkinnedMesh(mergeGeometries(parts), new THREE.MeshPhysicalMaterial({ color: 0xd4596a, roughness: 0.42, clearcoat: 0.5 }));
    mesh.add(bones[0]);
    mesh.bind(new THREE.Skeleton(bones));
    mesh.castShadow = mesh.receiveShadow = true;
    mesh.frustumCulled = false;
    return { mesh, bones };
}

/** Gives the vertices of a part two bones and the share of the second, by x. */
function weighed(part, bonesAt) {
    const { position } = part.attributes, indices = [], weights = [];
    for (let i = 0; i < position.count; i++) {
        const [a, b, share] = bonesAt(position.getX(i));
        indices.push(a, b, 0, 0);
        weights.push(1 - share, share, 0, 0);
    }
    part.setAttribute("skinIndex", new THREE.Uint16BufferAttribute(indices, 4));
    return part.setAttribute("skinWeight", new THREE.Float32BufferAttribute(weights, 4));
}

const { mesh, bones } = octopus();
scene.add(mesh);
mesh.updateMatrixWorld(true);
const tree = await computeBoundsTreeAsync(mesh);

const drops = new THREE.InstancedMesh(new THREE.SphereGeometry(0.022, 10, 8), new THREE.MeshStandardMaterial({ color: 0x2b6fd6, roughness: 0.3 }), RAYS);
drops.frustumCulled = false;
drops.raycast = () => {};
scene.add(drops);
const raycaster = new THREE.Raycaster(), from = new THREE.Vector3(), down = new THREE.Vector3(0.15, -1, 0.1).normalize(), matrix = new THREE.Matrix4();
raycaster.firstHitOnly = true;

/** Rays of rain; the distances of those that hit. */
function rain(each = () => {}) {
    const found = [];
    for (let i = 0; i < RAYS; i++) {
        const r = 2.3 * Math.sqrt((i + 0.5) / RAYS), angle = 2.4 * i;
        raycaster.set(from.set(r * Math.cos(angle), 3, r * Math.sin(angle)), down);
        const [hit] = raycaster.intersectObject(mesh, false);
        if (hit) found.push(hit.distance);
        each(i, hit);
    }
    return found;
}

run((seconds) => {
    bones[0].position.y = 0.12 * Math.sin(1.4 * seconds);
    for (let arm = 0; arm < ARMS; arm++) {
        for (let joint = 0; joint < JOINTS; joint++) {
            const { rotation } = bones[1 + arm * JOINTS + joint];
            rotation.z = (joint === 0 ? -0.5 : 0.16) + 0.28 * Math.sin(1.4 * seconds - 0.8 * joint + 1.3 * arm);
            if (joint > 0) rotation.y = 0.2 * Math.sin(0.9 * seconds + arm - 0.5 * joint);
        }
    }
    mesh.updateMatrixWorld(true);
    mesh.skeleton.update();
    const start = performance.now();
    tree.refit();
    const refit = performance.now() - start;
    const hits = rain((i, hit) => drops.setMatrixAt(i, hit ? matrix.makeTranslation(hit.point) : matrix.makeScale(0, 0, 0)));
    drops.instanceMatrix.needsUpdate = true;
    report(`${counted(mesh.geometry.index.count / 3)} triangles posed by ${bones.length} bones, refit in ${refit.toFixed(1)} ms\n${hits.length} of ${RAYS} drops hit`);
    done({ hits: hits.length, sameAsThree: window.compared ??= compare(hits) });
});

/** True if three.js hits the same in this pose, for a few of the rays. */
function compare(hits) {
    raycaster.firstHitOnly = false;
    THREE.SkinnedMesh.prototype.raycast = original;
    mesh.computeBoundingSphere();
    raycaster.set(from.set(0.1, 3, 0.1), down);
    const theirs = raycaster.intersectObject(mesh, false).map((hit) => hit.faceIndex);
    THREE.SkinnedMesh.prototype.raycast = acceleratedRaycast;
    const ours = raycaster.intersectObject(mesh, false).map((hit) => hit.faceIndex);
    raycaster.firstHitOnly = true;
    return hits.length > 0 && ours.length > 0 && ours.join() === theirs.join();
}
