// The package under node: its intersections are the ones of three.js, object by object and bit by bit.
//
//   OUT=FOLDER node --test three.test.mjs
//
// OUT is what build.mjs assembled; packages are found in its lib/.
import assert from "node:assert/strict";
import { symlinkSync } from "node:fs";
import { join, resolve } from "node:path";
import { before, test } from "node:test";
import { pathToFileURL } from "node:url";

const OUT = resolve(process.env.OUT);
try {
    symlinkSync("lib", join(OUT, "node_modules"));
} catch (error) {
    if (error.code !== "EEXIST") throw error;
}
const of = (path) => import(pathToFileURL(join(OUT, "lib", path)));
const THREE = await of("three/build/three.module.js"), bth = await of("@bth/three/index.js");
const { BoundsTree, computeBoundsTreeAsync, ready } = bth;

/** The classes whose functions are replaced, and the functions of three.js. */
const CLASSES = [THREE.Mesh, THREE.SkinnedMesh, THREE.InstancedMesh, THREE.BatchedMesh];
const originals = CLASSES.map((each) => each.prototype.raycast);
before(async () => {
    await assert.rejects(async () => new BoundsTree(new THREE.BoxGeometry()), /compile\.wasm is not loaded yet; .*computeBoundsTreeAsync/);
    await ready({ compiler: true });
    THREE.BufferGeometry.prototype.computeBoundsTree = bth.computeBoundsTree;
    THREE.BufferGeometry.prototype.disposeBoundsTree = bth.disposeBoundsTree;
});

/** Numbers from 0 to 1 by a linear congruential generator (Numerical Recipes). */
function numbers(seed) {
    let state = seed >>> 0;
    return () => (state = (Math.imul(state, 1664525) + 1013904223) >>> 0) / 2 ** 32;
}

/** Gives an object a random place, turn and size; some are mirrored. */
function placed(object, next, isUniform = false) {
    object.position.set(next(), next(), next());
    object.rotation.set(9 * next(), 9 * next(), 9 * next());
    const size = () => (next() < 0.3 ? -1 : 1) * (0.4 + next());
    if (isUniform) object.scale.setScalar(size());
    else object.scale.set(size(), size(), size());
    object.updateMatrixWorld(true);
    return object;
}

/** Asks objects by rays with all of three.js's conditions, with our functions and with the originals; the number of intersections. */
function compare(objects, count, near = [0, 3], far = [Infinity, 6]) {
    const next = numbers(count), raycaster = new THREE.Raycaster();
    let found = 0;
    for (let i = 0; i < count; i++) {
        raycaster.near = near[i % near.length];
        raycaster.far = far[(i >> 1) % far.length];
        raycaster.ray.origin.set(next() - 0.5, next() - 0.5, next() - 0.5).normalize().multiplyScalar(5);
        raycaster.ray.direction.set(next() - 0.5, next() - 0.5, next() - 0.5).sub(raycaster.ray.origin).normalize();
        const ask = (replace, isFirst) => {
            CLASSES.forEach((each, k) => (each.prototype.raycast = replace ? bth.acceleratedRaycast : originals[k]));
            raycaster.firstHitOnly = isFirst;
            return raycaster.intersectObjects(objects, true);
        };
        const expected = ask(false, false);
        assert.deepEqual(ask(true, false), expected);
        const first = ask(true, true);
        assert.deepEqual(first[0], expected[0]);
        assert.ok(first.length <= expected.length);
        found += expected.length;
    }
    return found;
}

const torus = () => new THREE.TorusGeometry(1, 0.5, 60, 24);

test("meshes: sides, normals, both sets of texture coordinates, indexed or not, interleaved", () => {
    const next = numbers(1), objects = [];
    for (const side of [THREE.FrontSide, THREE.BackSide, THREE.DoubleSide]) {
        const geometry = torus(), alone = torus().toNonIndexed();
        geometry.setAttribute("uv1", geometry.attributes.uv.clone());
        const wide = new THREE.InterleavedBuffer(new Float32Array(6 * alone.attributes.position.count), 6);
        const interleaved = new THREE.InterleavedBufferAttribute(wide, 3, 2);
        for (let i = 0; i < wide.count; i++) interleaved.setXYZ(i, ...new THREE.Vector3().fromBufferAttribute(alone.attributes.position, i));
        alone.setAttribute("position", interleaved);
        for (const each of [geometry, alone]) {
            each.computeBoundsTree();
            objects.push(placed(new THREE.Mesh(each, new THREE.MeshBasicMaterial({ side })), next));
        }
    }
    assert.ok(compare(objects, 300) > 1000);
});

test("materials of groups, overlapping groups and draw ranges", () => {
    const next = numbers(2), geometry = torus(), { count } = geometry.index, sides = [THREE.FrontSide, THREE.BackSide, THREE.DoubleSide];
    for (let i = 0; i < 5; i++) geometry.addGroup(Math.floor((i * count) / 15) * 3, Math.floor(count / 9) * 3, i % 4);
    geometry.computeBoundsTree();
    const materials = sides.map((side) => new THREE.MeshBasicMaterial({ side }));
    const ranged = torus();
    ranged.setDrawRange(300, 900);
    ranged.computeBoundsTree();
    const changed = torus();
    changed.computeBoundsTree();
    changed.setDrawRange(0, 600);
    const objects = [[geometry, materials], [geometry, materials[2]], [ranged, materials[2]], [changed, materials[0]]].map(([of, material]) => placed(new THREE.Mesh(of, material), next));
    // three.js asks a group for the side of a material that is not there; here it shows nothing.
    objects[0].material = [...materials, materials[0]];
    assert.ok(compare(objects, 300) > 500);
});

test("of triangles whose distances three.js rounds to the same, the nearest is found", () => {
    // The middle of a torus without a hole: three.js finds all at 10 and takes the first.
    const mesh = new THREE.Mesh(new THREE.TorusGeometry(5, 5, 40, 10), new THREE.MeshBasicMaterial()), raycaster = new THREE.Raycaster();
    raycaster.set(new THREE.Vector3(0, 0, -10), new THREE.Vector3(0, 0, 1));
    raycaster.firstHitOnly = true;
    mesh.raycast = originals[0];
    const [theirs] = raycaster.intersectObject(mesh), tree = mesh.geometry.computeBoundsTree(), exact = tree.scene.allHits([0, 0, -10, 0, 0, 0, 1, 99], "front");
    mesh.raycast = bth.acceleratedRaycast;
    const [ours] = raycaster.intersectObject(mesh), distanceOf = (face) => exact.t[exact.triangle.indexOf(face)];
    assert.deepEqual([ours.distance, theirs.distance], [10, 10]);
    assert.ok(ours.faceIndex !== theirs.faceIndex && distanceOf(ours.faceIndex) < distanceOf(theirs.faceIndex));
});

test("instances: each by its tree, and a tree over all", () => {
    const next = numbers(3), mesh = placed(new THREE.InstancedMesh(torus(), new THREE.MeshBasicMaterial(), 30), next), one = new THREE.Object3D();
    for (let i = 0; i < 30; i++) mesh.setMatrixAt(i, placed(one, next).matrix);
    mesh.geometry.computeBoundsTree();
    assert.ok(compare([mesh], 40) > 150);
    const tree = bth.computeInstancedBoundsTree.call(mesh);
    assert.ok(compare([mesh], 40) > 150);
    for (let i = 10; i < 20; i++) mesh.setMatrixAt(i, placed(one, next).matrix);
    mesh.computeBoundingSphere();
    tree.update(10, 10);
    assert.ok(compare([mesh], 40) > 150);
});

test("batches: visible instances, with a tree or without", () => {
    const next = numbers(4), parts = [torus(), new THREE.SphereGeometry(1, 24, 16)];
    const size = (name) => parts.reduce((sum, part) => sum + (name ? part.attributes[name] : part.index).count, 0);
    const mesh = placed(new THREE.BatchedMesh(20, size("position"), size(), new THREE.MeshBasicMaterial()), next, true);
    const ids = parts.map((part) => mesh.addGeometry(part)), one = new THREE.Object3D();
    for (let i = 0; i < 20; i++) mesh.setMatrixAt(mesh.addInstance(ids[i % 2]), placed(one, next).matrix);
    mesh.setVisibleAt(3, false);
    bth.computeBatchedBoundsTree.call(mesh, 0);
    assert.ok(compare([mesh], 60) > 200);
    bth.computeBatchedBoundsTree.call(mesh);
    assert.ok(compare([mesh], 60) > 200);
    bth.disposeBatchedBoundsTree.call(mesh);
    assert.deepEqual(mesh.boundsTrees, [null, null]);
});

/** A cylinder that two bones bend. */
function bent() {
    const geometry = new THREE.CylinderGeometry(0.4, 0.4, 3, 24, 24), { position } = geometry.attributes, indices = [], weights = [];
    for (let i = 0; i < position.count; i++) {
        const share = Math.min(1, Math.max(0, position.getY(i) / 3 + 0.5));
        indices.push(0, 1, 0, 0);
        weights.push(1 - share, share, 0, 0);
    }
    geometry.setAttribute("skinIndex", new THREE.Uint16BufferAttribute(indices, 4)).setAttribute("skinWeight", new THREE.Float32BufferAttribute(weights, 4));
    const mesh = new THREE.SkinnedMesh(geometry, new THREE.MeshBasicMaterial()), bones = [new THREE.Bone(), new THREE.Bone()];
    bones[0].add(bones[1]);
    mesh.add(bones[0]);
    mesh.bind(new THREE.Skeleton(bones));
    return { mesh, bones };
}

test("skins and morph targets are followed by refits, and ignored by no tree", async () => {
    const { mesh, bones } = bent();
    bones[1].rotation.z = 0.7;
    mesh.updateMatrixWorld(true);
    mesh.skeleton.update();
    const tree = await computeBoundsTreeAsync(mesh);
    assert.ok(compare([mesh], 100) > 60);
    bones[1].rotation.set(-0.9, 0.2, -0.6);
    mesh.updateMatrixWorld(true);
    mesh.skeleton.update();
    mesh.computeBoundingSphere();
    tree.refit();
    assert.ok(compare([mesh], 100) > 60);
    const morphed = new THREE.Mesh(torus(), new THREE.MeshBasicMaterial());
    const { position } = morphed.geometry.attributes;
    morphed.geometry.morphAttributes.position = [new THREE.Float32BufferAttribute(Array.from(position.array, (x, i) => x * (i % 3 === 2 ? 3 : 1.2)), 3)];
    morphed.updateMorphTargets();
    morphed.geometry.computeBoundsTree();
    assert.ok(compare([morphed], 60) > 20);
    morphed.morphTargetInfluences[0] = 0.8;
    morphed.geometry.computeBoundingSphere();
    assert.ok(compare([morphed], 60) > 20, "where a tree does not follow, three.js answers");
    morphed.boundsTree = new BoundsTree(morphed);
    assert.ok(compare([morphed], 60) > 20);
});

test("new positions of a geometry are followed, whether the tree was made for it or not", () => {
    for (const deformable of [false, true]) {
        const geometry = torus(), mesh = new THREE.Mesh(geometry, new THREE.MeshBasicMaterial());
        geometry.computeBoundsTree({ deformable });
        geometry.scale(1.5, 1.2, 2);
        geometry.computeBoundingSphere();
        assert.equal(geometry.boundsTree.fits(), false);
        assert.ok(compare([mesh], 20) > 10, "three.js answers until the refit");
        geometry.boundsTree.refit();
        assert.equal(geometry.boundsTree.fits(), true);
        assert.ok(compare([mesh], 60) > 60);
        const box = geometry.boundsTree.getBoundingBox();
        geometry.computeBoundingBox();
        assert.ok(box.containsBox(geometry.boundingBox) && geometry.boundingBox.clone().expandByScalar(1e-6).containsBox(box));
    }
});

test("rays of any length in the space of a geometry", () => {
    const tree = torus().computeBoundsTree(), ray = new THREE.Ray(new THREE.Vector3(0, 0.2, 5), new THREE.Vector3(0.2, 0, -1)), all = [1, 0.01, 70].map((length) => {
        ray.direction.set(0.2, 0, -1).setLength(length);
        return [tree.raycastFirst(ray).distance, tree.raycast(ray, THREE.DoubleSide).length, tree.raycastFirst(ray, THREE.DoubleSide, 4.7, 5.2)?.faceIndex, tree.raycastFirst(ray, THREE.DoubleSide, 0, 3)];
    });
    for (const [distance, count, face, near] of all) {
        assert.ok(Math.abs(distance - all[0][0]) < 1e-9);
        assert.deepEqual([count, face, near], [all[0][1], all[0][2], null]);
    }
});

test("closest points, inside, boxes and balls", () => {
    const geometry = new THREE.SphereGeometry(1, 200, 100), tree = geometry.computeBoundsTree(), at = new THREE.Vector3(), next = numbers(5);
    assert.equal(tree.closestPointToPoint(at.set(0, 1, 0)).distance, 0);
    for (let i = 0; i < 300; i++) {
        at.set(next() - 0.5, next() - 0.5, next() - 0.5).normalize().multiplyScalar(2 * next());
        const target = tree.closestPointToPoint(at), triangle = tree.triangle(target.faceIndex), onFace = triangle.closestPointToPoint(at, new THREE.Vector3());
        assert.ok(Math.abs(target.distance - Math.abs(1 - at.length())) < 1e-3);
        assert.ok(onFace.distanceTo(target.point) < 1e-6);
        if (Math.abs(at.length() - 1) > 1e-3) assert.equal(tree.contains(at), at.length() < 1);
        assert.equal(tree.closestPointToPoint(at, {}, 0, target.distance / 2), target.distance === 0 ? target : null);
    }
    const box = new THREE.Box3(new THREE.Vector3(-0.2, -0.2, -0.2), new THREE.Vector3(0.2, 0.2, 0.2)), out = new THREE.Matrix4().makeTranslation(1, 0, 0);
    assert.deepEqual([tree.intersectsBox(box), tree.intersectsBox(box, out)], [false, true]);
    assert.equal(tree.intersectsBox(box, out.clone().multiply(new THREE.Matrix4().makeRotationX(0.5))), true);
    assert.equal(tree.intersectsBox(box, new THREE.Matrix4().makeTranslation(0.6, 0, 0).multiply(new THREE.Matrix4().makeRotationZ(Math.PI / 4))), false);
    const ball = new THREE.Sphere(new THREE.Vector3(1, 0, 0), 0.1), faces = tree.facesInSphere(ball);
    assert.ok(tree.intersectsSphere(ball) && faces.length > 10);
    for (const face of faces) assert.ok(tree.triangle(face).closestPointToPoint(ball.center, at).distanceTo(ball.center) < 0.1 + 1e-9);
    assert.ok(tree.facesInBox(box.clone().translate(new THREE.Vector3(1, 0, 0))).length > 10);
});

test("a file of the same triangles is taken, another is refused, and a tree can be freed", async () => {
    const geometry = torus(), { loadCompiler } = await of("bth/compile.js"), compiler = await loadCompiler();
    const file = compiler.compile(geometry.attributes.position.array, geometry.index.array);
    geometry.boundsTree = new BoundsTree(geometry, { file });
    assert.ok(compare([new THREE.Mesh(geometry, new THREE.MeshBasicMaterial())], 30) > 30);
    assert.throws(() => new BoundsTree(new THREE.BoxGeometry(), { file }), /expected a file of 12 triangles, found 2880 \(compile the file from this geometry\)/);
    const { scene } = geometry.boundsTree;
    geometry.disposeBoundsTree();
    assert.equal(geometry.boundsTree, null);
    assert.throws(() => scene.bounds, /closed/);
});

test("shapecast walks where its calls say", () => {
    const geometry = new THREE.TorusKnotGeometry(1, 0.3, 200, 24), tree = new BoundsTree(geometry, { deformable: true });
    const sphere = new THREE.Sphere(new THREE.Vector3(0.9, 0.3, 0.2), 0.5), point = new THREE.Vector3();
    const within = () => {
        const faces = [], depths = new Set();
        let asked = 0;
        const stopped = tree.shapecast({
            intersectsBounds: (box, isLeaf, score, depth, node) => {
                asked++;
                assert.ok(typeof isLeaf === "boolean" && score === undefined && Number.isInteger(node));
                depths.add(depth);
                return sphere.intersectsBox(box);
            },
            intersectsTriangle: (triangle, face, contained) => {
                assert.ok(!contained && triangle.a.equals(tree.triangle(face).a));
                if (triangle.closestPointToPoint(sphere.center, point).distanceTo(sphere.center) <= sphere.radius) faces.push(face);
            },
        });
        assert.ok(stopped === false && depths.has(0) && depths.has(2), "from the box of all triangles on");
        assert.ok(asked < geometry.index.count / 12, "boxes are passed by");
        return faces.sort((one, other) => one - other);
    };
    const faces = tree.facesInSphere(sphere);
    assert.ok(faces.length > 100);
    assert.deepEqual(within(), faces);
    // With an order the closest triangle is found among few.
    let closest = Infinity, tested = 0;
    tree.shapecast({
        boundsTraverseOrder: (box) => box.distanceToPoint(sphere.center),
        intersectsBounds: (box, isLeaf, score) => score < closest,
        intersectsTriangle: (triangle) => {
            tested++;
            closest = Math.min(closest, triangle.closestPointToPoint(sphere.center, point).distanceTo(sphere.center));
        },
    });
    assert.ok(Math.abs(closest - tree.closestPointToPoint(sphere.center).distance) < 1e-12 && tested < 200, `${closest}, ${tested}`);
    // All triangles once, without asking again; and an end.
    const all = [];
    let asked = 0;
    tree.shapecast({
        intersectsBounds: () => (asked++, bth.CONTAINED),
        intersectsTriangle: (_, face, contained) => (assert.ok(contained), all.push(face), tree.contains(sphere.center), false),
    });
    assert.deepEqual([asked, all.sort((one, other) => one - other)], [1, Array.from({ length: geometry.index.count / 3 }, (_, face) => face)]);
    let calls = 0;
    assert.ok(tree.shapecast({ intersectsBounds: () => bth.INTERSECTED, intersectsTriangle: () => ++calls === 5 }));
    assert.equal(calls, 5);
    assert.ok(!tree.shapecast({ intersectsBounds: () => bth.NOT_INTERSECTED, intersectsTriangle: assert.fail }));
    // Boxes follow new positions; a range has its own faces.
    geometry.translate(0.4, 0, 0);
    tree.refit();
    assert.deepEqual(within(), tree.facesInSphere(sphere));
    assert.notDeepEqual(tree.facesInSphere(sphere), faces);
    const part = new BoundsTree(geometry, { range: { start: 300, count: 600 } }), ids = [];
    part.shapecast({ intersectsBounds: () => true, intersectsTriangle: (_, face) => void ids.push(face) });
    assert.deepEqual(ids.sort((one, other) => one - other), Array.from({ length: 200 }, (_, k) => 100 + k));
    assert.ok(!new BoundsTree(new THREE.BufferGeometry().setAttribute("position", new THREE.BufferAttribute(new Float32Array(0), 3)))
        .shapecast({ intersectsBounds: () => true }));
});
