"""Files that tests write: an OBJ with everything that one can have, and a glTF with a texture that has holes."""

import base64
import json
import struct
import zlib

import numpy as np


def parts(count=60, seed=3):
    """Separate triangles: corners (n, 3, 3), normals (n, 3, 3), texture coordinates (n, 3, 2), and (group, material) of each."""
    random = np.random.default_rng(seed)
    corners = random.normal(size=(count, 1, 3)) * 2 + random.normal(size=(count, 3, 3))
    normals = random.normal(size=(count, 3, 3))
    texcoords = random.uniform(-2, 2, (count, 3, 2))
    names = [(f"part {i // 7 % 4}", f"material {i // 3 % 3}") for i in range(count)]
    return corners.astype(np.float32), normals.astype(np.float32), texcoords.astype(np.float32), names


def write_obj(path, corners, normals, texcoords, names):
    lines = []
    for corner, normal, texcoord, (group, material) in zip(corners, normals, texcoords, names):
        for kind, rows in (("v", corner), ("vn", normal), ("vt", texcoord)):
            lines += [" ".join([kind, *(repr(float(x)) for x in row)]) for row in rows]
        lines += [f"g {group}", f"usemtl {material}", "f -3/-3/-3 -2/-2/-2 -1/-1/-1"]
    path.write_text("\n".join(lines))


def png(alpha):
    """A white PNG with this alpha, (height, width) uint8."""
    height, width = alpha.shape
    pixels = np.full((height, width, 4), 255, np.uint8)
    pixels[..., 3] = alpha
    raw = b"".join(b"\0" + row.tobytes() for row in pixels)
    chunk = lambda kind, data: struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))
    header = struct.pack(">IIBBBBB", width, height, 8, 6, 0, 0, 0)
    return b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", header) + chunk(b"IDAT", zlib.compress(raw)) + chunk(b"IEND", b"")


def write_leaf(path, alpha):
    """A square from (0, 0, 0) to (1, 1, 0) in front of another at z = -1, as glTF: the texture of the first has this alpha, its rows from y = 0."""
    square = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], np.float32)
    positions = np.concatenate([square, square - [0, 0, 1]]).astype(np.float32)
    texcoords = np.concatenate([square[:, :2], square[:, :2]])
    indices = np.array([0, 1, 2, 0, 2, 3, 4, 5, 6, 4, 6, 7], np.uint32)
    blobs = [positions.tobytes(), texcoords.tobytes(), indices.tobytes()]
    uri = lambda kind, data: f"data:{kind};base64," + base64.b64encode(data).decode()
    views = [{"buffer": i, "byteLength": len(blob)} for i, blob in enumerate(blobs)]
    attributes = {"POSITION": 0, "TEXCOORD_0": 1}
    document = {
        "asset": {"version": "2.0"}, "scenes": [{"nodes": [0]}], "nodes": [{"mesh": 0, "name": "tree"}],
        "meshes": [{"name": "leaf", "primitives": [
            {"attributes": attributes, "indices": 2, "material": 0}, {"attributes": attributes, "indices": 3, "material": 1}]}],
        "materials": [{"name": "holes", "alphaMode": "MASK", "pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}}, {"name": "wall"}],
        "textures": [{"source": 0, "sampler": 0}], "samplers": [{"magFilter": 9728, "minFilter": 9728, "wrapS": 33071, "wrapT": 33071}],
        "images": [{"uri": uri("image/png", png(alpha))}],
        "accessors": [
            {"bufferView": 0, "componentType": 5126, "count": 8, "type": "VEC3", "min": positions.min(0).tolist(), "max": positions.max(0).tolist()},
            {"bufferView": 1, "componentType": 5126, "count": 8, "type": "VEC2"},
            {"bufferView": 2, "componentType": 5125, "count": 6, "type": "SCALAR"},
            {"bufferView": 2, "byteOffset": 24, "componentType": 5125, "count": 6, "type": "SCALAR"}],
        "bufferViews": views,
        "buffers": [{"byteLength": len(blob), "uri": uri("application/octet-stream", blob)} for blob in blobs],
    }
    path.write_text(json.dumps(document))
