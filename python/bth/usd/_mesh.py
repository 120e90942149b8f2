"""Meshes and simple shapes of USD as triangles with values at their corners."""

from dataclasses import dataclass, field

import numpy as np
from pxr import UsdGeom  # type: ignore[import-untyped]

from ._subdivide import catmull_clark


@dataclass
class Polygons:
    """Faces, and values (c, 2), (c, 3) or (c, 4) at their corners by name."""

    points: np.ndarray
    counts: np.ndarray
    indices: np.ndarray
    values: dict = field(default_factory=dict)

    def triangles(self):
        """Corners of a fan for each face as rows of three, and the face of each triangle."""
        start = np.cumsum(self.counts) - self.counts
        fans = np.maximum(self.counts - 2, 0)
        face = np.repeat(np.arange(len(fans)), fans)
        place = np.arange(len(face)) - np.repeat(np.cumsum(fans) - fans, fans)
        first = start[face]
        return np.stack([first, first + place + 1, first + place + 2], 1), face


def _array(attribute, time, kind, width=None):
    """The values of an attribute; none where they are of another type than its schema says."""
    return array(attribute.Get(time), kind, width)


def array(values, kind, width=None):
    """Values of USD as numbers, or rows of them; none where they are something else."""
    shape = (0, width) if width else (0,)
    try:
        values = np.array(values if values is not None else np.zeros(shape), kind)
    except (TypeError, ValueError):
        return np.zeros(shape, kind)
    return values if values.ndim == len(shape) and values.shape[1:] == shape[1:] else np.zeros(shape, kind)


def at_corners(primvar, polygons, time, width):
    """A primvar at the faces' corners; None if it has no values, or not as many as it needs."""
    values = primvar.ComputeFlattened(time) if primvar and primvar.HasValue() else None
    if values is None:
        return None
    values = np.array(values, np.float64)
    if values.size % width:
        return None
    values = values.reshape(-1, width)
    corners, faces = len(polygons.indices), np.repeat(np.arange(len(polygons.counts)), polygons.counts)
    rows = {
        "constant": np.zeros(corners, np.int64), "uniform": faces, "vertex": polygons.indices, "varying": polygons.indices,
        "faceVarying": np.arange(corners),
    }.get(str(primvar.GetInterpolation()))
    if rows is None or (len(rows) and rows.max() >= len(values)):
        return None
    return values[rows]


def mesh(prim, points, time, levels, names, dropped):
    """The faces of a Mesh over points (v, 3), with the primvars of these names and normals.

    None without faces that can be used.
    """
    of = UsdGeom.Mesh(prim)
    counts = _array(of.GetFaceVertexCountsAttr(), time, np.int64)
    indices = _array(of.GetFaceVertexIndicesAttr(), time, np.int64)
    if not len(counts) or counts.min() < 0 or counts.sum() != len(indices) or (len(indices) and not (
        0 <= indices.min() and indices.max() < len(points)
    )):
        dropped[f"meshes without usable faces"] += 1
        return None
    polygons = Polygons(points, counts, indices)
    primvars = UsdGeom.PrimvarsAPI(prim)
    for name in names:
        width = {"displayColor": 3}.get(name, 2)
        values = at_corners(primvars.FindPrimvarWithInheritance(name), polygons, time, width)
        if values is not None:
            polygons.values[name] = values
    scheme = of.GetSubdivisionSchemeAttr().Get() or "catmullClark"
    if scheme in ("none", "bilinear"):
        # A primvar `normals` wins over the attribute.
        normals = at_corners(primvars.GetPrimvar("normals"), polygons, time, 3)
        if normals is None:
            normals = _normals(of, polygons, time)
        if normals is not None:
            polygons.values["normals"] = normals
    faces = np.arange(len(counts))
    if scheme == "catmullClark" and levels:
        polygons, faces = _subdivided(of, polygons, time, levels)
    elif scheme not in ("none", "bilinear", "catmullClark"):
        dropped[f"{scheme} subdivision: control cages are shown"] += 1
    return _without_holes(of, polygons, faces, time), scheme


def refined(prim, points, time, levels):
    """The points that `mesh` has for these points of a Mesh."""
    of = UsdGeom.Mesh(prim)
    if not levels or (of.GetSubdivisionSchemeAttr().Get() or "catmullClark") != "catmullClark":
        return points
    counts = _array(of.GetFaceVertexCountsAttr(), time, np.int64)
    indices = _array(of.GetFaceVertexIndicesAttr(), time, np.int64)
    return _subdivided(of, Polygons(points, counts, indices), time, levels)[0].points


def _normals(of, polygons, time):
    values = _array(of.GetNormalsAttr(), time, np.float64, 3)
    rows = {"faceVarying": np.arange(len(polygons.indices)), "vertex": polygons.indices, "varying": polygons.indices}
    rows = rows.get(str(of.GetNormalsInterpolation()))
    return values[rows] if rows is not None and len(values) and len(values) > rows.max(initial=-1) else None


def _subdivided(of, polygons, time, levels):
    lengths = _array(of.GetCreaseLengthsAttr(), time, np.int64)
    sharp = _array(of.GetCreaseSharpnessesAttr(), time, np.float64)
    chain, creases, at, edge = _array(of.GetCreaseIndicesAttr(), time, np.int64).tolist(), {}, 0, 0
    for k, length in enumerate(lengths.tolist()):
        for j in range(length - 1):
            # One sharpness for each crease, or one for each of its edges.
            of_edge = sharp[k] if len(sharp) == len(lengths) else sharp[edge] if edge < len(sharp) else 0.0
            creases[tuple(sorted(chain[at + j:at + j + 2]))] = float(of_edge) if of_edge < 10 else np.inf
            edge += 1
        at += length
    corners = np.zeros(len(polygons.points))
    for vertex, value in zip(_array(of.GetCornerIndicesAttr(), time, np.int64), _array(of.GetCornerSharpnessesAttr(), time, np.float64)):
        corners[vertex] = value if value < 10 else np.inf
    keeps = (of.GetInterpolateBoundaryAttr().Get() or "edgeAndCorner") == "edgeAndCorner"
    names, widths = list(polygons.values), [v.shape[1] for v in polygons.values.values()]
    values = np.concatenate([np.zeros((len(polygons.indices), 0)), *polygons.values.values()], axis=1)
    points, counts, indices = polygons.points, polygons.counts, polygons.indices
    faces = np.arange(len(counts))
    for _ in range(levels):
        faces = np.repeat(faces, counts)
        points, quads, values, creases, corners = catmull_clark(points, counts, indices, values, creases, corners, keeps)
        counts, indices = np.full(len(quads), 4), quads.reshape(-1)
    ends = np.cumsum([0, *widths])
    values = {name: values[:, a:b] for name, a, b in zip(names, ends, ends[1:])}
    return Polygons(points, counts, indices, values), faces


def _without_holes(of, polygons, faces, time):
    """Points, and triangles: rows of points (t, 3), values (t, 3, k), and the source's faces."""
    corners, face = polygons.triangles()
    if (of.GetOrientationAttr().Get() or "rightHanded") == "leftHanded":
        corners = corners[:, ::-1]
    kept = ~np.isin(faces[face], _array(of.GetHoleIndicesAttr(), time, np.int64))
    corners, face = corners[kept], faces[face[kept]]
    values = {n: v[corners] for n, v in polygons.values.items()}
    return polygons.points, polygons.indices[corners], values, face


def shape(prim, time):
    """Triangles (t, 3, 3) of a Cube, Plane or solid of revolution; None for another type."""
    kind = prim.GetTypeName()
    get = lambda name, default: default if prim.GetAttribute(name).Get(time) is None else prim.GetAttribute(name).Get(time)
    if kind == "Cube":
        s = get("size", 2.0) / 2
        corner = np.array([[x, y, z] for x in (-s, s) for y in (-s, s) for z in (-s, s)])
        quads = np.array([[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]])
        return corner[np.concatenate([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]])]
    axes = {"X": [1, 2, 0], "Y": [2, 0, 1], "Z": [0, 1, 2]}
    if kind == "Plane":
        w, l = get("width", 2.0) / 2, get("length", 2.0) / 2
        corner = np.array([[-w, -l, 0], [w, -l, 0], [w, l, 0], [-w, l, 0]])
        turned = np.empty_like(corner)
        turned[:, axes[get("axis", "Z")]] = corner
        return turned[[[0, 1, 2], [0, 2, 3]]]
    radius, half = get("radius", 1.0), get("height", 2.0) / 2
    arc = np.linspace(-np.pi / 2, np.pi / 2, 17)
    if kind == "Sphere":
        profile = radius * np.stack([np.cos(arc), np.sin(arc)], 1)
    elif kind == "Cylinder":
        profile = np.array([[0, -half], [radius, -half], [radius, half], [0, half]])
    elif kind == "Cone":
        profile = np.array([[0, -half], [radius, -half], [0, half]])
    elif kind == "Capsule":
        arc = np.concatenate([arc[:9], arc[8:]])
        shift = np.repeat([-get("height", 1.0) / 2, get("height", 1.0) / 2], [9, 9])
        profile = np.stack([get("radius", 0.5) * np.cos(arc), get("radius", 0.5) * np.sin(arc) + shift], 1)
    else:
        return None
    turn = np.linspace(0, 2 * np.pi, 33)[:-1]
    ring = np.stack([np.cos(turn), np.sin(turn)], 1)
    grid = np.concatenate([profile[:, None, :1] * ring, np.broadcast_to(profile[:, None, 1:], (len(profile), 32, 1))], -1)
    a, b = grid[:-1], grid[1:]
    c, d = np.roll(b, -1, axis=1), np.roll(a, -1, axis=1)
    rows = np.concatenate([np.stack([a, d, c], 2), np.stack([a, c, b], 2)]).reshape(-1, 3, 3)
    turned = np.empty_like(rows)
    turned[..., axes[get("axis", "Z")]] = rows
    return turned
