#!/usr/bin/env python3
"""World positions of a glTF scene's vertices at rest, computed independently of the library.

    gltf_rest.py FILE.glb

Prints one JSON array of positions in world space, after default morph weights and skins: three for each triangle, by node of the
default scene in depth-first order and then by primitive. Primitives that are not lists of triangles are left out. Written from the glTF 2.0 specification alone
(§3.7.2.2 and §3.7.3). Needs nothing but Python 3.9.
"""

import json
import struct
import sys

from gltf_poses import load, local, rows, times_matrix


def matrices(document, binary, index):
    """Rows of a MAT4 accessor as four rows of four."""
    accessor = document["accessors"][index]
    view = document["bufferViews"][accessor["bufferView"]]
    start = view.get("byteOffset", 0) + accessor.get("byteOffset", 0)
    stride = view.get("byteStride", 64)
    found = [struct.unpack_from("<16f", binary, start + i * stride) for i in range(accessor["count"])]
    return [[[m[4 * c + r] for c in range(4)] for r in range(4)] for m in found]


def with_sparse(document, binary, index):
    """Rows of an accessor, zeros where it has no view, with its sparse values."""
    accessor = document["accessors"][index]
    if "bufferView" in accessor:
        found = rows(document, binary, index)
    else:
        found = [(0.0,) * 3] * accessor["count"]
    if "sparse" in accessor:
        sparse = accessor["sparse"]

        def part(spec, component, shape):
            view = document["bufferViews"][spec["bufferView"]]
            part_of = {"asset": {}, "bufferViews": [view], "accessors": [
                {"bufferView": 0, "byteOffset": spec.get("byteOffset", 0), "componentType": component, "type": shape,
                 "count": sparse["count"]}]}
            return rows(part_of, binary, 0)

        places = part(sparse["indices"], sparse["indices"]["componentType"], "SCALAR")
        values = part(sparse["values"], accessor["componentType"], accessor["type"])
        for (place,), value in zip(places, values):
            found[place] = value
    return found


def world_matrices(nodes):
    """The world matrix of every node, in the scene or not."""
    parents = {child: i for i, node in enumerate(nodes) for child in node.get("children", [])}

    def world(index):
        own = local(nodes[index], {})
        return times_matrix(world(parents[index]), own) if index in parents else own

    return [world(i) for i in range(len(nodes))]


def apply(matrix, p):
    return [sum(matrix[i][k] * p[k] for k in range(3)) + matrix[i][3] for i in range(3)]


def at_rest(document, binary, index, world, primitive, mesh):
    node = document["nodes"][index]
    positions = [list(p) for p in with_sparse(document, binary, primitive["attributes"]["POSITION"])]
    weights = node.get("weights", mesh.get("weights", []))
    for weight, target in zip(weights, primitive.get("targets", [])):
        if weight and "POSITION" in target:
            for p, d in zip(positions, with_sparse(document, binary, target["POSITION"])):
                for k in range(3):
                    p[k] += weight * d[k]
    if "skin" not in node:
        return [apply(world[index], p) for p in positions]
    skin = document["skins"][node["skin"]]
    joints = [world[j] for j in skin["joints"]]
    if "inverseBindMatrices" in skin:
        binds = matrices(document, binary, skin["inverseBindMatrices"])
        joints = [times_matrix(joint, bind) for joint, bind in zip(joints, binds)]
    sums = [[0.0] * 3 for _ in positions]
    totals = [0.0] * len(positions)
    number = 0
    while f"JOINTS_{number}" in primitive["attributes"]:
        indices = rows(document, binary, primitive["attributes"][f"JOINTS_{number}"])
        shares = rows(document, binary, primitive["attributes"][f"WEIGHTS_{number}"])
        for v, p in enumerate(positions):
            for index, share in zip(indices[v], shares[v]):
                if share:
                    moved = apply(joints[int(index)], p)
                    sums[v] = [s + share * m for s, m in zip(sums[v], moved)]
                    totals[v] += share
        number += 1
    return [[x / total for x in s] for s, total in zip(sums, totals)]


def main():
    document, binary = load(sys.argv[1])
    nodes = document.get("nodes", [])
    world = world_matrices(nodes)
    stack = list(reversed(document["scenes"][document.get("scene", 0)]["nodes"]))
    answer = []
    while stack:
        index = stack.pop()
        stack.extend(reversed(nodes[index].get("children", [])))
        mesh = document["meshes"][nodes[index]["mesh"]] if "mesh" in nodes[index] else {"primitives": []}
        for primitive in mesh["primitives"]:
            if primitive.get("mode", 4) != 4:
                continue
            positions = at_rest(document, binary, index, world, primitive, mesh)
            if "indices" in primitive:
                positions = [positions[int(row[0])] for row in rows(document, binary, primitive["indices"])]
            answer += positions
    json.dump(answer, sys.stdout)


if __name__ == "__main__":
    main()
