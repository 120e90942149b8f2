#!/usr/bin/env python3
"""Compares the deformed vertices of compiled scenes with an evaluation that is independent of the library.

    gltf_positions.py [--rigid-parts] BTHC FILE.glb...

Each file is compiled by the program BTHC; `bthc positions` says where its vertices are at 16 times. This script computes the same
from the glTF 2.0 specification alone (§3.7.2.2, §3.7.3, §3.11 and appendix C), in float64: morph targets first, then the skin,
whose joints take all their ancestors, whatever the transform of the skinned node is. The first animation plays; then all is
compared once more at rest. Positions of all triangles' corners have to be equal to 1e-5 of the model's size. With --rigid-parts files are
compiled with that option, and which triangles are in which part is computed here once more. Needs numpy.
"""

import json
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np
from gltf_poses import load, local, sample

TIMES = 16
TOLERANCE = 1e-5
TYPES = {5120: np.int8, 5121: np.uint8, 5122: np.int16, 5123: np.uint16, 5125: np.uint32, 5126: np.float32}
WIDTHS = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4, "MAT4": 16}


class Model:
    """A glTF document with its binary chunk."""

    def __init__(self, path, animated):
        self.document, self.binary = load(path)
        self.nodes = self.document.get("nodes", [])
        self.parents = {c: i for i, node in enumerate(self.nodes) for c in node.get("children", [])}
        self.channels = {}
        for animation in self.document.get("animations", [])[:1] if animated else []:
            for channel in animation["channels"]:
                target = channel["target"]
                key = (target.get("node"), target["path"])
                if key[0] is None or key in self.channels:
                    continue
                sampler = animation["samplers"][channel["sampler"]]
                times = [float(t) for t in self.rows(sampler["input"])[:, 0]]
                values = self.rows(sampler["output"])
                kind = sampler.get("interpolation", "LINEAR")
                if key[1] == "weights":
                    values = values.reshape(len(times) * (3 if kind == "CUBICSPLINE" else 1), -1)
                self.channels[key] = (times, [row.tolist() for row in values], kind, key[1])

    def view(self, view, offset, component, width, count):
        """Rows of a buffer view."""
        spec, kind = self.document["bufferViews"][view], np.dtype(TYPES[component]).newbyteorder("<")
        start, stride = spec.get("byteOffset", 0) + offset, spec.get("byteStride", kind.itemsize * width)
        found = np.ndarray((count, width), kind, self.binary, start, (stride, kind.itemsize))
        return found.astype(np.float64)

    def rows(self, index):
        """Rows of an accessor as float64, with its sparse values."""
        a = self.document["accessors"][index]
        component, width = a["componentType"], WIDTHS[a["type"]]
        found = np.zeros((a["count"], width))
        if "bufferView" in a:
            found = self.view(a["bufferView"], a.get("byteOffset", 0), component, width, a["count"])
        if "sparse" in a:
            count, at, new = a["sparse"]["count"], a["sparse"]["indices"], a["sparse"]["values"]
            places = self.view(at["bufferView"], at.get("byteOffset", 0), at["componentType"], 1, count)
            found[places[:, 0].astype(int)] = self.view(new["bufferView"], new.get("byteOffset", 0), component, width, count)
        if a.get("normalized"):
            found = np.maximum(found / np.iinfo(TYPES[component]).max, -1.0)
        return found

    def moved(self, time):
        """For each node the properties that the animation gives it."""
        moved = {}
        for (node, path), channel in self.channels.items():
            moved.setdefault(node, {})[path] = sample(*channel, time)
        return moved

    def world(self, index, moved):
        """World matrix of a node, by all its ancestors."""
        own = np.array(local(self.nodes[index], moved.get(index, {})), np.float64)
        return self.world(self.parents[index], moved) @ own if index in self.parents else own

    def corners(self, index, moved):
        """World positions of the corners of the triangles of a node's mesh."""
        node = self.nodes[index]
        mesh = self.document["meshes"][node["mesh"]]
        default = node.get("weights", mesh.get("weights", []))
        weights = moved.get(index, {}).get("weights", default)
        found = []
        for primitive in mesh["primitives"]:
            if primitive.get("mode", 4) != 4:
                continue
            positions = self.rows(primitive["attributes"]["POSITION"])
            for weight, target in zip(weights, primitive.get("targets", [])):
                if "POSITION" in target:
                    positions = positions + weight * self.rows(target["POSITION"])
            homogeneous = np.hstack([positions, np.ones((len(positions), 1))])
            if "skin" in node:
                matrices = self.joints(node["skin"], moved)
                total, blended = np.zeros(len(positions)), np.zeros((len(positions), 4, 4))
                number = 0
                while f"JOINTS_{number}" in primitive["attributes"]:
                    joints = self.rows(primitive["attributes"][f"JOINTS_{number}"]).astype(int)
                    shares = self.rows(primitive["attributes"][f"WEIGHTS_{number}"])
                    blended += np.einsum("vj,vjab->vab", shares, matrices[joints])
                    total += shares.sum(axis=1)
                    number += 1
                placed = np.einsum("vab,vb->va", blended / total[:, None, None], homogeneous)[:, :3]
            else:
                placed = (homogeneous @ self.world(index, moved).T)[:, :3]
            if "indices" in primitive:
                placed = placed[self.rows(primitive["indices"])[:, 0].astype(int)]
            found.append(placed[: len(placed) // 3 * 3])
        return np.vstack(found) if found else np.zeros((0, 3))

    def joints(self, skin, moved):
        """For each joint the matrix from the mesh in its bind pose to the world."""
        spec = self.document["skins"][skin]
        worlds = np.array([self.world(joint, moved) for joint in spec["joints"]])
        if "inverseBindMatrices" in spec:
            binds = self.rows(spec["inverseBindMatrices"]).reshape(-1, 4, 4).transpose(0, 2, 1)
            worlds = worlds @ binds[: len(worlds)]
        return worlds

    def name(self, index):
        return self.nodes[index].get("name") or f"node {index}"

    def rigid_joints(self, index):
        """For each triangle of a node's mesh the joint that alone moves its connected component, or -1."""
        mesh, joint_of, places, triangles, numbers = self.document["meshes"][self.nodes[index]["mesh"]], [], [], [], {}
        for primitive in mesh["primitives"]:
            attributes = primitive["attributes"]
            if primitive.get("mode", 4) != 4:
                continue
            positions = self.rows(attributes["POSITION"])
            joints, shares = self.rows(attributes["JOINTS_0"]).astype(int), self.rows(attributes["WEIGHTS_0"])
            own = [set(j[s > 0]) for j, s in zip(joints, shares)]
            still = np.ones(len(positions), bool)
            for target in primitive.get("targets", []):
                for name in {"POSITION", "NORMAL"} & target.keys():
                    still &= ~self.rows(target[name]).any(axis=1)
            rows = self.rows(primitive["indices"])[:, 0].astype(int) if "indices" in primitive else np.arange(len(positions))
            triangles += (rows[: len(rows) // 3 * 3].reshape(-1, 3) + len(joint_of)).tolist()
            joint_of += [own[i].copy().pop() if len(own[i]) == 1 and still[i] else -1 for i in range(len(positions))]
            places += [numbers.setdefault(tuple(p + 0.0), len(numbers)) for p in positions]
        neighbours = [[] for _ in numbers]
        for a, b, c in triangles:
            for i, j in (a, b), (b, c):
                neighbours[places[i]].append(places[j])
                neighbours[places[j]].append(places[i])
        component, count = [-1] * len(numbers), 0
        for start in range(len(numbers)):
            stack = [start] if component[start] < 0 else []
            count += len(stack)
            while stack:
                at = stack.pop()
                if component[at] < 0:
                    component[at] = count - 1
                    stack += neighbours[at]
        moved_by = [set() for _ in range(count)]
        for triangle in triangles:
            moved_by[component[places[triangle[0]]]].update(joint_of[row] for row in triangle)
        own = [moved_by[component[places[t[0]]]] for t in triangles]
        return np.array([next(iter(s)) if len(s) == 1 else -1 for s in own], int)

    def placed_nodes(self):
        """The nodes of the default scene with a mesh, depth first."""
        stack = list(reversed(self.document["scenes"][self.document.get("scene", 0)]["nodes"]))
        found = []
        while stack:
            index = stack.pop()
            stack.extend(reversed(self.nodes[index].get("children", [])))
            if "mesh" in self.nodes[index]:
                found.append(index)
        return found


def compiled(bthc, path, options, times):
    """What `bthc positions` says of a file."""
    with tempfile.TemporaryDirectory() as folder:
        out = Path(folder) / "scene.bth"
        command = [bthc, "compile", path, "-o", out, "--structure", "bvh", "--no-cache", "-q"]
        subprocess.run(command + options, check=True)
        command = [bthc, "positions", out, "--seconds", *map(str, times)]
        return json.loads(subprocess.run(command, check=True, stdout=subprocess.PIPE).stdout)


def placed_corners(said, at, row):
    """World positions of the corners of an instance."""
    positions = np.array(at["positions"][row["object"]], np.float64).reshape(-1, 3)
    triangles = np.array(said["objects"][row["object"]]["triangles"], int).reshape(-1)
    matrix = np.array(row["to_world"], np.float64)
    return positions[triangles] @ matrix[:, :3].T + matrix[:, 3]


def with_parts(said, at, model, index, row, parts):
    """The corners of a node's mesh, some of whose parts are instances of their own, in the order of the mesh."""
    joints = model.rigid_joints(index)
    names = {model.name(joint): j for j, joint in enumerate(model.document["skins"][model.nodes[index]["skin"]]["joints"])}
    found, left = np.full((len(joints), 3, 3), np.nan), np.ones(len(joints), bool)
    for part in parts:
        own = joints == names[part["node"].removeprefix(f"{model.name(index)}/")]
        found[own] = placed_corners(said, at, part).reshape(-1, 3, 3)
        left &= ~own
    if row is not None:
        found[left] = placed_corners(said, at, row).reshape(-1, 3, 3)
    return found.reshape(-1, 3)


def check(bthc, path, animated, rigid_parts):
    """Compares a file, with its first animation or at rest; returns whether it agrees."""
    model = Model(path, animated)
    if "EXT_mesh_gpu_instancing" in model.document.get("extensionsUsed", []):
        print(f"skipped {path.name}: its instances are of an extension")
        return True
    last = max([channel[0][-1] for channel in model.channels.values()], default=1.0)
    # Before the first key and behind the last too.
    count = TIMES if animated else 1
    times = [(i + 0.37) / (TIMES - 2) * last - 0.06 * last for i in range(count)]
    options = ["--rigid-parts"] if rigid_parts else []
    said = compiled(bthc, path, options + ([] if animated else ["--animation", "none"]), times)
    placed, worst, corners, divided = model.placed_nodes(), 0.0, 0, 0
    skinned = [index for index in placed if "skin" in model.nodes[index]]
    part_names = {index: {f"{model.name(index)}/{model.name(j)}" for j in model.document["skins"][model.nodes[index]["skin"]]["joints"]} for index in skinned}
    all_parts = set().union(*part_names.values()) if rigid_parts else set()
    for time, at in zip(times, said["times"]):
        moved = model.moved(time)
        # Nodes at rest whose skin is not animated have instances of their own, behind all nodes.
        rows = [x for x in at["instances"] if not x["node"].endswith("/at rest") and x["node"] not in all_parts]
        resting = [x for x in at["instances"] if x["node"].endswith("/at rest")]
        for index in placed:
            rests = "skin" in model.nodes[index] and bool(resting) and not is_moved(model, index)
            parts = [x for x in at["instances"] if rigid_parts and index in part_names and x["node"] in part_names[index]]
            whole = parts and not any(x["node"] == model.name(index) for x in rows)
            row = None if whole else (resting if rests else rows).pop(0)
            expected = model.corners(index, moved)
            found = with_parts(said, at, model, index, row, parts) if parts else placed_corners(said, at, row)
            divided = max(divided, len(parts))
            if found.shape != expected.shape:
                print(f"{path.name}: node {index} has {len(found) // 3} triangles, not {len(expected) // 3}")
                return False
            size = max(np.ptp(expected, axis=0).max(initial=0.0), 1e-30) if len(expected) else 1.0
            # Mirrored nodes turn their triangles here and there: corners are compared as they stand in the file.
            difference = np.abs(found - expected).max(initial=0.0) / size
            worst = max(worst, np.inf if np.isnan(difference) else difference)
            corners += len(expected)
    agrees = worst <= TOLERANCE
    when = (f"at {count} times" if animated else "at rest") + (f", in {divided} parts" if divided else "")
    print(f"{path.name}: {corners} corners {when}, worst {worst:.1e} of the size{'' if agrees else ': TOO FAR'}")
    return agrees


def is_moved(model, index):
    """Whether the animation moves a joint of a node's skin or the weights of its mesh."""
    if (index, "weights") in model.channels:
        return True
    moving = {node for node, path in model.channels if path != "weights"}
    for joint in model.document["skins"][model.nodes[index]["skin"]]["joints"]:
        while joint is not None:
            if joint in moving:
                return True
            joint = model.parents.get(joint)
    return False


def main():
    rigid_parts, (bthc, *names) = "--rigid-parts" in sys.argv, [x for x in sys.argv[1:] if x != "--rigid-parts"]
    results = [check(bthc, Path(name), animated, rigid_parts) for name in names for animated in (True, False)]
    sys.exit(0 if all(results) else 1)


if __name__ == "__main__":
    main()
