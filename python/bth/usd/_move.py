"""Meshes that move: points in each frame as USD computes them, in a vertex cache of a model."""

import os
import struct

import numpy as np
from pxr import Tf, Usd, UsdGeom, UsdSkel, Vt  # type: ignore[import-untyped]


class Skins:
    """The skins of a stage, found where its SkelRoots are walked."""

    def __init__(self, dropped):
        self._dropped, self._failed = dropped, set()
        self._cache, self._of_path, self._around = UsdSkel.Cache(), {}, set()

    def find(self, root):
        """Finds the skins below a SkelRoot, also in instances."""
        everything = Usd.TraverseInstanceProxies()
        self._cache.Populate(UsdSkel.Root(root), everything)
        for binding in self._cache.ComputeSkelBindings(UsdSkel.Root(root), everything):
            skeleton = self._cache.GetSkelQuery(binding.GetSkeleton())
            for skin in binding.GetSkinningTargets():
                path = skin.GetPrim().GetPath()
                if skeleton and path not in self._of_path:
                    # The skeleton's query is about the prototype of an instance.
                    bones = binding.GetSkeleton().GetPrim()
                    self._of_path[path] = skeleton, bones, skin, _shapes(skeleton, skin)
                    self._around.update(path.GetPrefixes())

    def are_in(self, prim):
        """True if a prim, or one below it, has a skin."""
        return prim.GetPath() in self._around

    def is_on(self, prim):
        """True if a prim has a skin or blend shapes."""
        return prim.GetPath() in self._of_path

    def points(self, prim, time):
        """The points of a Mesh in its space at a time, moved by blend shapes and its skin."""
        points, path = UsdGeom.Mesh(prim).GetPointsAttr().Get(time), prim.GetPath()
        if path not in self._of_path:
            if any(map(prim.HasProperty, ("skel:skeleton", "primvars:skel:jointIndices"))):
                self._fails(path)
            return points
        skeleton, bones, skin, shapes = self._of_path[path]
        try:
            posed, done = Vt.Vec3fArray(points), True
            if shapes:
                query, *offsets = shapes
                weights = skeleton.GetAnimQuery().ComputeBlendShapeWeights(time)
                weights = skin.GetBlendShapeMapper().Remap(weights)
                weights = query.ComputeSubShapeWeights(weights)
                done = query.ComputeDeformedPoints(*weights, *offsets, posed)
            if done and skin.HasJointInfluences():
                transforms = skeleton.ComputeSkinningTransforms(time)
                done = skeleton.HasBindPose() and skin.ComputeSkinnedPoints(transforms, posed, time)
                place = UsdGeom.XformCache(time).GetLocalToWorldTransform
                posed = _transformed(posed, place(bones) * place(prim).GetInverse())
            if done:
                return posed
        except (Tf.ErrorException, TypeError):
            pass
        self._fails(path)
        return points

    def _fails(self, path):
        if path not in self._failed:
            self._failed.add(path)
            self._dropped["skins that USD does not apply: shown as they were bound"] += 1


def _shapes(skeleton, skin):
    """The blend shapes of a skin, and the points and offsets of each; None without weights."""
    if not (skin.HasBlendShapes() and skeleton.GetAnimQuery()):
        return None
    query = UsdSkel.BlendShapeQuery(UsdSkel.BindingAPI(skin.GetPrim()))
    return query, query.ComputeBlendShapePointIndices(), query.ComputeSubShapePointOffsets()


def _transformed(points, matrix):
    """Points times a matrix, in the order in which USD adds."""
    (x, y, z), m = np.array(points, np.float64).T[..., None], np.array(matrix)[:, :3]
    return (x * m[0] + y * m[1] + z * m[2] + m[3]).astype(np.float32)


def write_cache(path, frames, count, first, length):
    """Writes `length` frames of `count` points as a PC2 file, one by one.

    Returns True if points move, False if not, and None if they cannot, since faces or the number
    of points change. Without motion there is no file.
    """
    before, moves = None, False
    with open(path, "wb") as file:
        file.write(struct.pack("<12siiffi", b"POINTCACHE2", 1, count, first, 1.0, length))
        for points in frames:
            if points is None or len(points) != count:
                moves = None
                break
            points = np.asarray(points, "<f4").tobytes()
            moves |= before is not None and points != before
            before = points
            file.write(points)
    if not moves:
        os.remove(path)
    return moves


def write_model(path, points, primitives, library, dropped):
    """Writes a mesh as an OBJ file, with a material library or, if that is enough, without.

    Returns the keys that an object without one has.
    """
    looks = [library.materials[row] for *_, row in primitives]
    base = looks[0]["pbrMetallicRoughness"]
    is_plain = len(looks) == 1 and not any(
        key == "alphaMode" or key.endswith("Texture") for key in (*looks[0], *base)
    )
    for what, lost in {
        "vertex colors": any("COLOR_0" in values for _, values, _ in primitives),
        "normals": any("NORMAL" in values for _, values, _ in primitives),
        "sides": not looks[0]["doubleSided"],
        "gloss, normals and wraps of materials": not is_plain,
    }.items():
        if lost:
            dropped[f"{what} of meshes that move"] += 1
    with open(f"{path}.obj", "w", encoding="utf-8") as file:
        file.write("" if is_plain else f"mtllib {os.path.basename(path)}.mtl\n")
        np.savetxt(file, points, "v %.9g %.9g %.9g")
        at = 1
        for (rows, values, _), look in zip(primitives, looks):
            file.write("" if is_plain else f"usemtl {look['name']}\n")
            if "TEXCOORD_0" not in values:
                np.savetxt(file, rows + 1, "f %d %d %d")
                continue
            # In OBJ the second coordinate grows upwards.
            uv = values["TEXCOORD_0"].reshape(-1, 2) * [1.0, -1.0] + [0.0, 1.0]
            np.savetxt(file, uv, "vt %.9g %.9g")
            corners = np.stack([rows + 1, at + np.arange(rows.size).reshape(-1, 3)], 2)
            np.savetxt(file, corners.reshape(-1, 6), "f %d/%d %d/%d %d/%d")
            at += rows.size
    if is_plain:
        look = {"metallic": base["metallicFactor"], "roughness": base["roughnessFactor"]}
        look["emission"] = _emission(looks[0])
        return {"color": base["baseColorFactor"][:3], "material": look}
    with open(f"{path}.mtl", "w", encoding="utf-8") as file:
        file.writelines(_statements(look, library) for look in looks)
    return {}


def _emission(look):
    strength = look.get("extensions", {}).get("KHR_materials_emissive_strength", {})
    factor = strength.get("emissiveStrength", 1.0)
    return [min(factor * x, 1e6) for x in look.get("emissiveFactor", [0.0] * 3)]


def _statements(look, library):
    """A material of glTF as statements of MTL."""
    base, mode = look["pbrMetallicRoughness"], look.get("alphaMode")
    *color, alpha = base["baseColorFactor"]
    numbers = {"Kd": color, "Ke": _emission(look)} | ({"d": [alpha]} if mode == "BLEND" else {})
    texture = lambda key, of: [(key, of["index"])] if of else []
    images = texture("map_Kd", base.get("baseColorTexture"))
    images += texture("map_d", mode == "MASK" and base.get("baseColorTexture"))
    images += texture("map_Ke", look.get("emissiveTexture"))
    text = f"newmtl {look['name']}\n"
    for key, values in numbers.items():
        text += " ".join([key, *map(repr, values)]) + "\n"
    for key, index in images:
        text += f"{key} {library.images[library.textures[index]['source']]['uri']}\n"
    return text
