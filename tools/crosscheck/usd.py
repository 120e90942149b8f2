"""Compares scenes that bth.usd makes with what USD itself says: usd.py FOLDER

Of each stage in the folder (usd, usda, usdc, usdz) the triangles of all meshes are placed by USD, instance by instance, without groups.
Their box and number have to be those of the compiled scene, at the first frame and one in the middle.
USD bakes skins for that. Other prims, point instancers and subdivision are not compared.
"""

import collections
import sys
import tempfile
import warnings
from pathlib import Path

import numpy as np
from pxr import Gf, Tf, Usd, UsdGeom, UsdSkel

import bth
import bth.usd


def baked(file, time):
    """A stage without instances, with its skins applied, also at this time."""
    stage = Usd.Stage.Open(str(file))
    stage.SetEditTarget(stage.GetSessionLayer())
    # Else times would be scaled.
    stage.SetTimeCodesPerSecond(stage.GetTimeCodesPerSecond())
    while instances := [prim for prim in stage.Traverse() if prim.IsInstance()]:
        for prim in instances:
            prim.SetInstanceable(False)
    # Samples are where animations have some, and at the frames of the stage.
    stage.SetStartTimeCode(time)
    stage.SetEndTimeCode(time)
    assert UsdSkel.BakeSkinning(Usd.PrimRange(stage.GetPseudoRoot()), Gf.Interval.GetFullInterval())
    return stage


def placed(stage, time):
    """The box around the faces of all visible meshes, and the number of their triangles; None with what is not compared."""
    lower, upper, triangles = np.full(3, np.inf), np.full(3, -np.inf), 0
    for prim in Usd.PrimRange(stage.GetPseudoRoot(), Usd.TraverseInstanceProxies()):
        kind, imageable = str(prim.GetTypeName()), UsdGeom.Imageable(prim)
        if kind in ("PointInstancer", "Cube", "Plane", "Sphere", "Cylinder", "Cone", "Capsule", "RectLight", "DiskLight"):
            return None
        if kind != "Mesh" or imageable.ComputePurpose() in ("guide", "proxy") or imageable.ComputeVisibility(time) == "invisible":
            continue
        mesh = UsdGeom.Mesh(prim)
        points = np.array(mesh.GetPointsAttr().Get(time) or [], np.float64)
        if points.ndim != 2 or points.shape[1] != 3:
            continue
        counts, indices = (np.array(a.Get(time) or [], int) for a in (mesh.GetFaceVertexCountsAttr(), mesh.GetFaceVertexIndicesAttr()))
        if counts.sum() != len(indices) or len(indices) and indices.max() >= len(points):
            continue
        holes = set(mesh.GetHoleIndicesAttr().Get(time) or [])
        faces = [f for f, count in enumerate(counts) if f not in holes and count > 2]
        ends = np.cumsum(counts)
        used = np.concatenate([np.zeros(0, int), *(indices[ends[f] - counts[f]:ends[f]] for f in faces)])
        world = np.array(UsdGeom.Xformable(prim).ComputeLocalToWorldTransform(time))
        if np.linalg.det(world[:3, :3]) == 0:
            continue
        triangles += int(sum(counts[f] - 2 for f in faces))
        if len(used):
            at = points[used] @ world[:3, :3] + world[3, :3]
            lower, upper = np.minimum(lower, at.min(axis=0)), np.maximum(upper, at.max(axis=0))
    if UsdGeom.GetStageUpAxis(stage) == UsdGeom.Tokens.z and triangles:
        lower, upper = np.array([lower[0], lower[2], -upper[1]]), np.array([upper[0], upper[2], -lower[1]])
    return np.stack([lower, upper]), triangles


def shown(scene):
    """The number of the scene's triangles, and the box around them."""
    count, lower, upper = 0, np.full(3, np.inf), np.full(3, -np.inf)
    for instance in np.nonzero(scene.visible)[0]:
        triangles = scene.triangle_counts[scene.objects_of_instances[instance]]
        at = scene.triangle_positions(instance, np.arange(triangles)).reshape(-1, 3)
        lower, upper = np.fmin(lower, at.min(axis=0)), np.fmax(upper, at.max(axis=0))
        count += int(triangles)
    return count, np.stack([lower, upper])


def main(folder):
    files = sorted(f for f in Path(folder).rglob("*.usd*") if f.suffix in (".usd", ".usda", ".usdc", ".usdz"))
    counts = collections.Counter()
    for file in files:
        try:
            stage = Usd.Stage.Open(str(file))
        except Tf.ErrorException:
            counts["refused by USD"] += 1
            continue
        with tempfile.TemporaryDirectory() as made, warnings.catch_warnings():
            warnings.simplefilter("ignore")
            scene = bth.compile(bth.usd.convert(stage, made).manifest, quality="fast", materials=True, cache=False)
        everything = stage.Traverse(Usd.TraverseInstanceProxies())
        is_skinned = any(prim.IsA(UsdSkel.Root) for prim in everything)
        first, last, _ = scene.frames
        times = [Usd.TimeCode.EarliestTime()]
        if stage.HasAuthoredTimeCodeRange():
            times = [Usd.TimeCode(stage.GetStartTimeCode())]
        if last > first:
            times = [Usd.TimeCode(first), Usd.TimeCode((first + last + 1) // 2)]
        for time in times:
            if last > first:
                scene.set_frame(int(time.GetValue()))
            expected = placed(baked(file, time.GetValue()) if is_skinned else stage, time)
            if expected is None:
                counts["compiled without a comparison"] += 1
                break
            box, triangles = expected
            found, within = shown(scene)
            # Positions are rounded to float32 before they are placed.
            fits = not triangles or np.abs(within - box).max() <= 2.0**-20 * np.abs(box).max()
            if found != triangles or not fits:
                counts["different"] += 1
                print(f"{file}, {time}: {found} triangles in {within.tolist()}")
                print(f"    expected {triangles} in {box.tolist()}")
                break
        else:
            counts["the same"] += 1
            counts["of them at two frames"] += last > first
            counts["of them with skins"] += is_skinned
    print(f"{len(files)} stages: " + ", ".join(f"{count} {what}" for what, count in counts.items()))
    return counts["different"] > 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1]))
