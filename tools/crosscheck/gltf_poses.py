#!/usr/bin/env python3
"""World matrices of a glTF scene's nodes at some times, computed independently of the library.

    gltf_poses.py FILE.glb SECONDS...

Prints one JSON object: for each time, by node number, the first three rows of the node's world matrix; nodes that are not in
the default scene are null. All animations play together; of two that move the same property the first counts. Written
from the glTF 2.0 specification alone (§3.11 and appendix C). Needs nothing but Python 3.9.
"""

import bisect
import json
import math
import struct
import sys
from pathlib import Path

COMPONENTS = {5120: ("b", 127), 5121: ("B", 255), 5122: ("h", 32767), 5123: ("H", 65535), 5125: ("I", 0), 5126: ("f", 0)}
WIDTHS = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4}


def load(path):
    data = Path(path).read_bytes()
    document, binary, at = None, b"", 12
    while at < len(data):
        length, kind = struct.unpack_from("<II", data, at)
        chunk = data[at + 8 : at + 8 + length]
        if kind == 0x4E4F534A:
            document = json.loads(chunk)
        elif kind == 0x004E4942:
            binary = chunk
        at += 8 + length
    return document, binary


def rows(document, binary, index):
    """Rows of an accessor as tuples of floats."""
    accessor = document["accessors"][index]
    view = document["bufferViews"][accessor["bufferView"]]
    code, most = COMPONENTS[accessor["componentType"]]
    form = struct.Struct("<" + code * WIDTHS[accessor["type"]])
    start = view.get("byteOffset", 0) + accessor.get("byteOffset", 0)
    stride = view.get("byteStride", form.size)
    found = [form.unpack_from(binary, start + i * stride) for i in range(accessor["count"])]
    if accessor.get("normalized"):
        found = [tuple(max(x / most, -1.0) for x in row) for row in found]
    return found


def normalized(q):
    length = math.sqrt(sum(x * x for x in q))
    return [x / length for x in q]


def slerp(a, b, t):
    a, b = normalized(a), normalized(b)
    cosine = sum(x * y for x, y in zip(a, b))
    if cosine < 0:
        b, cosine = [-x for x in b], -cosine
    angle = math.acos(min(cosine, 1.0))
    if math.sin(angle) == 0:
        return [x + t * (y - x) for x, y in zip(a, b)]
    u, v = math.sin((1 - t) * angle) / math.sin(angle), math.sin(t * angle) / math.sin(angle)
    return [u * x + v * y for x, y in zip(a, b)]


def sample(times, values, interpolation, path, time):
    """The value of a sampler."""
    cubic = interpolation == "CUBICSPLINE"
    value = (lambda k: values[3 * k + 1]) if cubic else (lambda k: values[k])
    if time <= times[0]:
        return value(0)
    if time >= times[-1]:
        return value(len(times) - 1)
    k = bisect.bisect_right(times, time) - 1
    if interpolation == "STEP":
        return value(k)
    d = times[k + 1] - times[k]
    t = (time - times[k]) / d
    if cubic:
        a, out, b, into = value(k), values[3 * k + 2], value(k + 1), values[3 * k + 3]
        h = (2 * t**3 - 3 * t**2 + 1, d * (t**3 - 2 * t**2 + t), 3 * t**2 - 2 * t**3, d * (t**3 - t**2))
        return [h[0] * p + h[1] * m + h[2] * q + h[3] * n for p, m, q, n in zip(a, out, b, into)]
    if path == "rotation":
        return slerp(value(k), value(k + 1), t)
    return [x + t * (y - x) for x, y in zip(value(k), value(k + 1))]


def local(node, moved):
    """Four rows of the node's own matrix."""
    if "matrix" in node:
        m = node["matrix"]
        return [[m[4 * c + r] for c in range(4)] for r in range(4)]
    x, y, z, w = normalized(moved.get("rotation", node.get("rotation", (0, 0, 0, 1))))
    s = moved.get("scale", node.get("scale", (1, 1, 1)))
    t = moved.get("translation", node.get("translation", (0, 0, 0)))
    r = [
        [w * w + x * x - y * y - z * z, 2 * (x * y - w * z), 2 * (x * z + w * y)],
        [2 * (x * y + w * z), w * w - x * x + y * y - z * z, 2 * (y * z - w * x)],
        [2 * (x * z - w * y), 2 * (y * z + w * x), w * w - x * x - y * y + z * z],
    ]
    return [[r[i][j] * s[j] for j in range(3)] + [t[i]] for i in range(3)] + [[0, 0, 0, 1]]


def times_matrix(a, b):
    columns = list(zip(*b))
    return [[p * c[0] + q * c[1] + r * c[2] + s * c[3] for c in columns] for p, q, r, s in a]


def main():
    document, binary = load(sys.argv[1])
    nodes = document.get("nodes", [])
    channels = {}
    for animation in document.get("animations", []):
        for channel in animation["channels"]:
            key = (channel["target"].get("node"), channel["target"]["path"])
            if key[0] is None or key in channels or key[1] == "weights":
                continue
            sampler = animation["samplers"][channel["sampler"]]
            times = [row[0] for row in rows(document, binary, sampler["input"])]
            channels[key] = (times, rows(document, binary, sampler["output"]), sampler.get("interpolation", "LINEAR"), key[1])
    if "scenes" in document:
        roots = document["scenes"][document.get("scene", 0)].get("nodes", [])
    else:
        children = {c for node in nodes for c in node.get("children", [])}
        roots = [i for i in range(len(nodes)) if i not in children]
    identity = [[float(i == j) for j in range(4)] for i in range(4)]
    answer = {}
    for text in sys.argv[2:]:
        moved = {}
        for (node, path), channel in channels.items():
            moved.setdefault(node, {})[path] = sample(*channel, float(text))
        world = [None] * len(nodes)
        stack = [(root, identity) for root in roots]
        while stack:
            index, parent = stack.pop()
            matrix = times_matrix(parent, local(nodes[index], moved.get(index, {})))
            world[index] = matrix[:3]
            stack.extend((child, matrix) for child in nodes[index].get("children", []))
        answer[text] = world
    sys.stdout.write(json.dumps(answer))


if __name__ == "__main__":
    main()
