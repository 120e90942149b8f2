"""Meshes that move: points in each frame as USD computes them, in a vertex cache."""

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


def vertices(rows, values):
    """The first corner of each vertex, and the vertex of each corner: equal corners are one."""
    table = [rows.reshape(-1, 1), *(v.reshape(rows.size, -1).view("<u4") for v in values.values())]
    table = np.concatenate(table, axis=1)
    _, first, vertex = np.unique(table, axis=0, return_index=True, return_inverse=True)
    return first, vertex.reshape(-1)


def write_cache(path, frames, count, first, length):
    """Writes `length` frames of `count` points as a PC2 file, one by one.

    Returns True if points move, False if not, and None if they cannot: a frame is None. Without
    motion there is no file.
    """
    before, moves = None, False
    with open(path, "wb") as file:
        file.write(struct.pack("<12siiffi", b"POINTCACHE2", 1, count, first, 1.0, length))
        for points in frames:
            if points is None:
                moves = None
                break
            points = np.asarray(points, "<f4").tobytes()
            moves |= before is not None and points != before
            before = points
            file.write(points)
    if not moves:
        os.remove(path)
    return moves
