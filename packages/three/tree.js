// A tree over the triangles of a geometry, of a mesh in its pose, or of instances.

import { Box3, DoubleSide, FrontSide, Matrix4, Ray, Triangle, Vector3 } from "three";
import { compile, engine } from "./engine.js";
import { cornersOf, positionsOf, rangeOf, sourceOf, vertexOf } from "./geometry.js";
import { intersectionOf, sideOf } from "./intersection.js";

/** What `intersectsBounds` of `shapecast` says of a box. */
export const NOT_INTERSECTED = 0, INTERSECTED = 1, CONTAINED = 2;

const inverse = new Matrix4(), instanceMatrix = new Matrix4();
const localRay = new Ray(), instanceRay = new Ray();
const numbers = new Float64Array(8);
const hit = { t: 0, u: 0, v: 0, instance: 0, triangle: 0 };

/** Closes the scenes of trees that nobody holds any more. */
const forgotten = new FinalizationRegistry((scene) => scene.close());

/** Eight numbers of a ray. */
function rowOf(ray, near, far) {
    ray.origin.toArray(numbers, 0);
    numbers[3] = near;
    ray.direction.toArray(numbers, 4);
    numbers[7] = far;
    return numbers;
}

/** A tree of a geometry, or of a mesh whose skin or morph targets pose it. */
export class BoundsTree {
    /**
     * @param source A BufferGeometry, or a Mesh, whose present pose is taken.
     * @param options See index.d.ts.
     */
    constructor(source, { deformable = false, range, file, onWarning } = {}) {
        const isMesh = source.isMesh === true;
        this.geometry = isMesh ? source.geometry : source;
        if (!this.geometry?.isBufferGeometry) throw new TypeError("@bth/three: expected a BufferGeometry or a Mesh");
        /** The mesh that poses the vertices, if there is one. */
        this.mesh = isMesh ? source : null;
        this.range = rangeOf(this.geometry, range);
        /** True if the range is that of the geometry, which may be changed. */
        this.followsDrawRange = range === undefined;
        const bytes = file ?? compile(this.source(), { deformable: deformable || isMesh, ...(onWarning && { onWarning }) });
        this.#open(bytes, file !== undefined);
    }

    /** The arrays that the compiler takes. */
    source() {
        return sourceOf(this.geometry, this.mesh, this.range);
    }

    #open(bytes, isFile) {
        const scene = engine().open(bytes), expected = this.range.count / 3;
        if (scene.triangles !== expected) {
            scene.close();
            const hint = isFile ? "compile the file from this geometry" : "this is a defect";
            throw new Error(`@bth/three: expected a file of ${expected} triangles, found ${scene.triangles} (${hint})`);
        }
        if (this.scene) this.dispose();
        /** The open file, for queries of many rays and points. */
        this.scene = scene;
        this.version = versionOf(this.geometry);
        forgotten.register(this, scene, this);
    }

    /** True while the tree has the triangles that three.js would test. */
    fits() {
        if (this.version !== versionOf(this.geometry)) return false;
        if (!this.followsDrawRange) return true;
        const { first, count } = rangeOf(this.geometry);
        return first === this.range.first && count === this.range.count;
    }

    /** Intersections of one object with a raycaster's ray, as `Mesh.raycast` finds them. */
    raycastObject3D(object, raycaster, intersects = []) {
        const { material, matrixWorld } = object;
        if (material === undefined) return intersects;
        inverse.copy(matrixWorld).invert();
        localRay.copy(raycaster.ray).applyMatrix4(inverse);
        // The length here of one in the world.
        const scale = stretch(raycaster.ray.direction, inverse), { near, far } = raycaster;
        const frame = { origin: raycaster.ray.origin, matrixWorld, near, far };
        const found = this.#find(localRay, material, near * scale, far * scale, frame, raycaster.firstHitOnly === true);
        for (const intersection of found) {
            intersection.object = object;
            intersects.push(intersection);
        }
        return intersects;
    }

    /** All intersections in the space of the geometry, by ascending face. */
    raycast(ray, materialOrSide = FrontSide, near = 0, far = Infinity) {
        return this.#findHere(ray, materialOrSide, near, far, false);
    }

    /** The nearest intersection in the space of the geometry, or null. */
    raycastFirst(ray, materialOrSide = FrontSide, near = 0, far = Infinity) {
        return this.#findHere(ray, materialOrSide, near, far, true)[0] ?? null;
    }

    #findHere(ray, materialOrSide, near, far, isFirst) {
        const length = ray.direction.length(), frame = { origin: ray.origin, near, far };
        return this.#find(ray, materialOf(materialOrSide), near / length, far / length, frame, isFirst);
    }

    /** Intersections of a ray with a material, or with the materials of the geometry's groups. */
    #find(ray, material, near, far, frame, isFirst) {
        const isArray = Array.isArray(material), side = sideOf(isArray ? DoubleSide : material.side);
        const row = rowOf(ray, near, far);
        if (isFirst) {
            if (!this.scene.nearestOne(row, hit, side)) return [];
            const found = this.#intersections([hit], material, ray, frame);
            if (found.length > 0) return found.slice(0, 1);
        }
        const hits = [];
        if (this.scene.eachHit(row, (t, u, v, instance, triangle) => hits.push({ u, v, triangle }), side) === 0) return hits;
        // In the order of three.js, which tests one face after the other.
        hits.sort((one, other) => one.triangle - other.triangle);
        const found = this.#intersections(hits, material, ray, frame);
        if (!isFirst || found.length === 0) return found;
        // The nearest triangle has no material that shows it, or is nearer than `near` after rounding; what is behind counts.
        return [found.reduce((nearest, one) => (one.distance < nearest.distance ? one : nearest))];
    }

    /** The intersections of hits: with materials one for each group that has the triangle. */
    #intersections(hits, material, ray, frame) {
        const found = [], offset = this.range.first / 3;
        const add = (face, side, hit, materialIndex) => {
            const one = intersectionOf(this, face, side, ray, hit, frame);
            if (!one) return;
            one.face.materialIndex = materialIndex;
            found.push(one);
        };
        if (!Array.isArray(material)) {
            for (const hit of hits) add(offset + hit.triangle, material.side, hit, 0);
            return found;
        }
        for (const { start, count, materialIndex } of this.geometry.groups) {
            const { side } = material[materialIndex] ?? {};
            if (side === undefined) continue;
            for (const hit of hits) {
                const face = offset + hit.triangle;
                const isOfGroup = 3 * face >= start && 3 * face < start + count;
                if (isOfGroup && shows(this, face, side, ray)) add(face, side, hit, materialIndex);
            }
        }
        return found;
    }

    /** The closest point of the surface; null if none is within `maxThreshold`. */
    closestPointToPoint(point, target = {}, minThreshold = 0, maxThreshold = Infinity) {
        const { distance, point: at, triangle } = this.scene.closest(Float64Array.of(point.x, point.y, point.z), maxThreshold);
        if (distance[0] === Infinity) return null;
        target.point = (target.point ?? new Vector3()).fromArray(at);
        target.distance = distance[0];
        target.faceIndex = this.range.first / 3 + triangle[0];
        return target;
    }

    /** True if a point is inside of a closed surface, decided exactly. */
    contains(point) {
        return this.scene.winding(Float64Array.of(point.x, point.y, point.z))[0] !== 0;
    }

    /** True if a triangle overlaps a box; `boxToTree` may turn it. */
    intersectsBox(box, boxToTree) {
        if (!boxToTree || keepsAxes(boxToTree)) {
            const { min, max } = boxToTree ? turned.copy(box).applyMatrix4(boxToTree) : box;
            return this.scene.overlapsBox([min.x, min.y, min.z], [max.x, max.y, max.z]);
        }
        inverse.copy(boxToTree).invert();
        const near = this.facesInBox(turned.copy(box).applyMatrix4(boxToTree));
        return near.some((face) => box.intersectsTriangle(moved(this.triangle(face, triangle), inverse)));
    }

    /** True if a triangle overlaps a ball. */
    intersectsSphere({ center, radius }) {
        return this.scene.overlapsSphere([center.x, center.y, center.z], radius);
    }

    /** The faces that overlap a box, ascending. */
    facesInBox({ min, max }) {
        const { triangle } = this.scene.trianglesInBox([min.x, min.y, min.z], [max.x, max.y, max.z]);
        return Array.from(triangle, (face) => this.range.first / 3 + face);
    }

    /** The faces that overlap a ball, ascending. */
    facesInSphere({ center, radius }) {
        const { triangle } = this.scene.trianglesInSphere([center.x, center.y, center.z], radius);
        return Array.from(triangle, (face) => this.range.first / 3 + face);
    }

    /** Walks through the tree as the calls decide; see index.d.ts. */
    shapecast({ intersectsBounds, intersectsTriangle, boundsTraverseOrder }) {
        const offset = this.range.first / 3, box = new Box3(), ordered = new Box3(), face = new Triangle();
        const boxOf = (numbers, target) => {
            target.min.fromArray(numbers, 0);
            target.max.fromArray(numbers, 3);
            return target;
        };
        const whole = this.getBoundingBox(box);
        if (whole.isEmpty()) return false;
        const first = Number(intersectsBounds(whole, false, boundsTraverseOrder?.(whole), 0, 0));
        if (first === NOT_INTERSECTED) return false;
        return this.scene.shapecast({
            bounds: (numbers, ...rest) => (first === CONTAINED ? CONTAINED : intersectsBounds(boxOf(numbers, box), ...rest)),
            triangle: (id, isContained, depth) => {
                const index = offset + id;
                return intersectsTriangle?.(this.triangle(index, face), index, isContained, depth) === true;
            },
            ...(boundsTraverseOrder && { order: (numbers) => boundsTraverseOrder(boxOf(numbers, ordered)) }),
        });
    }

    /** The triangle of a face. */
    triangle(face, target = new Triangle()) {
        const { position } = this.geometry.attributes;
        const [i, j, k] = cornersOf(this.geometry, face, [0, 0, 0]);
        vertexOf(i, position, this.mesh, target.a);
        vertexOf(j, position, this.mesh, target.b);
        vertexOf(k, position, this.mesh, target.c);
        return target;
    }

    /**
     * Follows new positions of the geometry, or a new pose of the mesh. A tree that was not compiled
     * as `deformable` is compiled again the first time.
     */
    refit() {
        if (this.scene.vertices() === null) return this.#open(compile(this.source(), { deformable: true }), false);
        this.scene.setPositions(Float32Array.from(positionsOf(this.geometry, this.mesh)));
        this.version = versionOf(this.geometry);
    }

    /** The box around all triangles. */
    getBoundingBox(target = new Box3()) {
        const { bounds } = this.scene;
        if (!bounds) return target.makeEmpty();
        target.min.fromArray(bounds.lower);
        target.max.fromArray(bounds.upper);
        return target;
    }

    /** Frees the memory of the tree; it answers nothing any more. */
    dispose() {
        forgotten.unregister(this);
        this.scene.close();
    }
}

/** A tree over the instances of an InstancedMesh, whose geometry has a tree. */
export class InstancedTree {
    constructor(mesh, tree) {
        this.mesh = mesh;
        this.tree = tree;
        this.scene = engine().instances(tree.scene, this.#matrices());
        forgotten.register(this, this.scene, this);
    }

    #matrices() {
        return this.mesh.instanceMatrix.array.subarray(0, 16 * this.mesh.count);
    }

    /** Follows the matrices of the instances, or only of some from `first` on. */
    update(first = 0, count = this.mesh.count - first) {
        this.scene.setTransforms(this.#matrices().subarray(16 * first, 16 * (first + count)), first);
    }

    raycastObject3D(mesh, raycaster, intersects = []) {
        const { material, matrixWorld } = mesh;
        if (material === undefined) return intersects;
        inverse.copy(matrixWorld).invert();
        localRay.copy(raycaster.ray).applyMatrix4(inverse);
        const scale = stretch(raycaster.ray.direction, inverse), { near, far, ray } = raycaster;
        const row = rowOf(localRay, near * scale, far * scale), side = sideOf(material.side);
        const found = [];
        if (raycaster.firstHitOnly) {
            if (this.scene.nearestOne(row, hit, side)) found.push({ ...hit });
        } else {
            this.scene.eachHit(row, (t, u, v, instance, triangle) => found.push({ instance, triangle, u, v }), side);
            found.sort((one, other) => one.instance - other.instance || one.triangle - other.triangle);
        }
        for (const one of found) {
            mesh.getMatrixAt(one.instance, instanceMatrix);
            instanceMatrix.premultiply(matrixWorld);
            instanceRay.copy(ray).applyMatrix4(inverse.copy(instanceMatrix).invert());
            const frame = { origin: ray.origin, matrixWorld: instanceMatrix, near, far };
            const face = this.tree.range.first / 3 + one.triangle;
            const intersection = intersectionOf(this.tree, face, material.side, instanceRay, one, frame);
            if (!intersection) continue;
            intersection.instanceId = one.instance;
            intersection.object = mesh;
            intersects.push(intersection);
        }
        return intersects;
    }

    dispose() {
        forgotten.unregister(this);
        this.scene.close();
    }
}

const turned = new Box3(), triangle = new Triangle(), edge = new Vector3(), normal = new Vector3();

/** How many times as long a direction is after a matrix. */
function stretch(direction, { elements: e }) {
    const { x, y, z } = direction;
    return Math.hypot(e[0] * x + e[4] * y + e[8] * z, e[1] * x + e[5] * y + e[9] * z, e[2] * x + e[6] * y + e[10] * z) / direction.length();
}

/** What changes when positions or indices are marked as changed (`needsUpdate`). */
function versionOf({ attributes: { position }, index }) {
    return `${(position.data ?? position).version} ${index?.version}`;
}

/** True if a matrix moves and scales along the axes only. */
function keepsAxes({ elements: e }) {
    return [1, 2, 4, 6, 8, 9].every((i) => e[i] === 0);
}

/** A triangle after a matrix. */
function moved(triangle, matrix) {
    for (const corner of [triangle.a, triangle.b, triangle.c]) corner.applyMatrix4(matrix);
    return triangle;
}

/** True if a side of a triangle can be seen along a ray, as three.js decides it. */
function shows(tree, face, side, ray) {
    if (side === DoubleSide) return true;
    const { a, b, c } = tree.triangle(face, triangle);
    normal.copy(b).sub(a).cross(edge.copy(c).sub(a));
    const towards = ray.direction.dot(normal);
    return side === FrontSide ? towards < 0 : towards > 0;
}

/** A material of a side, or the material itself, or materials. */
function materialOf(materialOrSide) {
    return typeof materialOrSide === "number" ? { side: materialOrSide } : materialOrSide;
}
