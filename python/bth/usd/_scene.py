"""A stage of USD as a scene manifest: hierarchy, motion, instances, cameras and lights."""

import collections
import hashlib
import json
import math
import os

import numpy as np
from pxr import Gf, Usd, UsdGeom, UsdLux, UsdShade, UsdSkel  # type: ignore[import-untyped]

from . import _mesh, _move
from ._gltf import Library
from ._look import Looks

_DEPTH = 16
#: Frames of a scene at most: transforms are sampled at each.
_FRAMES = 100_000
_SHAPES = ("Cube", "Plane", "Sphere", "Cylinder", "Cone", "Capsule")
_SILENT = ("", "Xform", "Scope", "SkelRoot", "Skeleton", "SkelAnimation", "Material", "Shader", "NodeGraph", "GeomSubset", "Backdrop")


class Converter:
    """Walks a stage and collects the tables of a manifest."""

    def __init__(self, stage, folder, name, levels):
        self._stage, self._folder, self._levels = stage, folder, levels
        self.dropped = collections.Counter()
        self._library = Library(folder, name)
        self._looks = Looks(self._library, self.dropped)
        self._skins = _move.Skins(self.dropped)
        self.objects, self.nodes, self.tracks, self.cameras, self.lights = [], [], [], [], []
        self._groups, self._object_of = {}, {}
        # Of the world or the group that is walked: its outermost node, and what its nodes' names begin with.
        self._base, self._prefix = None, ""
        start, end = stage.GetStartTimeCode(), stage.GetEndTimeCode()
        if not (stage.HasAuthoredTimeCodeRange() and math.isfinite(start) and math.isfinite(end) and end >= start):
            start = end = 0.0
        self.first, self.last, self.rate = math.floor(start), math.ceil(end), stage.GetTimeCodesPerSecond()
        if not 0 < self.rate < math.inf:
            self.dropped["rates that are not above 0: 24 is taken"] += 1
            self.rate = 24.0
        if self.last - self.first >= _FRAMES:
            self.dropped[f"frames after the first {_FRAMES:,}"] += self.last - self.first + 1 - _FRAMES
            self.last = self.first + _FRAMES - 1
        if not -(2**24) <= self.first <= self.last <= 2**24:
            self.dropped["ranges of time codes beyond 24 bits"] += 1
            self.first = self.last = 0
        self._codes = [Usd.TimeCode(t) for t in range(self.first, self.last + 1)]
        self._time = Usd.TimeCode(start) if stage.HasAuthoredTimeCodeRange() else Usd.TimeCode.EarliestTime()

    def run(self):
        if missing := self._stage.GetCompositionErrors():
            self.dropped["references and layers that are missing or broken"] += len(missing)
        root = None
        if UsdGeom.GetStageUpAxis(self._stage) == UsdGeom.Tokens.z:
            root = "upright"
            self.nodes.append({"name": root, "rotation": {"axis": [1, 0, 0], "degrees": -90}})
        self._base = root
        for prim in self._stage.GetPseudoRoot().GetChildren():
            self._walk(prim, root, None, 0)
        self._library.write()

    def manifest(self):
        """The text of the manifest."""
        text = f"version = 1\nframes = {{ first = {self.first}, last = {self.last}, rate = {self.rate!r} }}\n"
        for table in ("objects", "nodes", "cameras", "lights", "tracks"):
            for row in getattr(self, table):
                text += f"\n[[{table}]]\n" + "".join(f"{key} = {_toml(value)}\n" for key, value in row.items())
        return text

    # The hierarchy. `group` is the set of things in the group that is walked, or None in the world.

    def _walk(self, prim, parent, group, depth, is_root_of_prototype=False):
        """Adds a prim and what is below it."""
        if prim.IsAbstract() or not prim.IsActive() or not prim.IsDefined():
            return
        kind = str(prim.GetTypeName())
        imageable = UsdGeom.Imageable(prim)
        if imageable:
            purpose = imageable.ComputePurpose()
            if purpose in ("guide", "proxy"):
                self.dropped[f"prims of the purpose {purpose}"] += 1
                return
        node = parent
        if not is_root_of_prototype and imageable and UsdGeom.Xformable(prim):
            node = self._node(prim, parent)
        elif imageable and imageable.GetVisibilityAttr().HasAuthoredValue():
            self.nodes.append({"name": self._name(prim), **({"parent": parent} if parent else {})})
            node = self._visibility(imageable)
        if prim.IsA(UsdSkel.Root):
            self._skins.find(prim)
        # A SkelRoot, or what is below one, may have another pose in each instance.
        if prim.IsInstance() and not self._skins.are_in(prim):
            prototype = prim.GetPrototype()
            self._show(node, prototype, group, depth, is_prototype=True)
            return
        if kind == "PointInstancer":
            self._instancer(UsdGeom.PointInstancer(prim), node, group, depth)
            return
        self._content(prim, kind, node, group)
        for child in prim.GetFilteredChildren(Usd.TraverseInstanceProxies()):
            self._walk(child, node, group, depth)

    def _name(self, prim):
        return self._prefix + str(prim.GetPath())

    def _node(self, prim, parent):
        of = UsdGeom.Xformable(prim)
        row = {"name": self._name(prim)}
        parent = self._base if of.GetResetXformStack() else parent
        if parent:
            row["parent"] = parent
        matrix = lambda time: np.array(of.GetLocalTransformation(time)).T
        self.nodes.append(row)
        if of.TransformMightBeTimeVarying() and len(self._codes) > 1:
            self._moves(row, [matrix(code) for code in self._codes])
        else:
            _place(row, matrix(self._time))
        return self._visibility(UsdGeom.Imageable(prim))

    def _moves(self, row, matrices):
        """Tracks of a node, one key for each time code."""
        parts = [_parts(matrix) for matrix in matrices]
        if any(sheared for *_, sheared in parts):
            self.dropped["shears of transforms that move"] += 1
        times = [code.GetValue() / self.rate for code in self._codes]
        for k, name in enumerate(("translation", "rotation", "scale")):
            values = [part[k] for part in parts]
            if all(value == values[0] for value in values):
                row[name] = values[0]
            else:
                self.tracks.append({"node": row["name"], "property": name, "times": times, "values": values})

    def _visibility(self, imageable):
        """Shows or hides the node that was added last; returns its name."""
        attribute, row = imageable.GetVisibilityAttr(), self.nodes[-1]
        name = row["name"]
        if attribute.GetNumTimeSamples() > 1 and len(self._codes) > 1:
            values = [attribute.Get(code) != "invisible" for code in self._codes]
            times = [code.GetValue() / self.rate for code in self._codes]
            self.tracks.append({"node": name, "property": "visible", "times": times, "values": values})
        elif attribute.Get(self._time) == "invisible":
            row["visible"] = False
        return name

    # Instances.

    def _show(self, node, prim, group, depth, is_prototype=False):
        """Shows a prim and what is below it as a group at a node."""
        name = self._group(prim, depth, is_prototype)
        if name is None:
            return
        row = {"name": f"{node}#{len(self.nodes)}", "group": name}
        self.nodes.append(row | ({"parent": node} if node else {}))
        if group is not None:
            group.add("instance")

    def _group(self, prim, depth, is_prototype):
        """The name of a prim's group; None if nothing is in it."""
        key = str(prim.GetPath())
        if depth >= _DEPTH - 1:
            self.dropped[f"instances more than {_DEPTH} deep"] += 1
            return None
        if key not in self._groups:
            name, content = f"group {key}", set()
            at = len(self.nodes)
            self.nodes.append({"name": name})
            self._groups[key] = name
            outside = self._base, self._prefix
            self._base, self._prefix = name, f"{name}: "
            self._walk(prim, name, content, depth + 1, is_root_of_prototype=is_prototype)
            self._base, self._prefix = outside
            if not content:
                del self.nodes[at:]
                self._groups[key] = None
        return self._groups[key]

    def _instancer(self, of, node, group, depth):
        path = self._name(of)
        targets = of.GetPrototypesRel().GetForwardedTargets()
        rows = _mesh._array(of.GetProtoIndicesAttr(), self._time, np.int64)
        if not len(rows):
            return
        time = self._time
        moved = (of.GetPositionsAttr(), of.GetOrientationsAttr(), of.GetScalesAttr(), of.GetProtoIndicesAttr())
        if len(self._codes) > 1 and any(attribute.ValueMightBeTimeVarying() for attribute in moved):
            self.dropped["point instancers that move: shown at the first frame"] += 1
        transforms = of.ComputeInstanceTransformsAtTime(time, time, UsdGeom.PointInstancer.ExcludeProtoXform, UsdGeom.PointInstancer.IgnoreMask)
        mask = of.ComputeMaskAtTime(time)
        if len(transforms) != len(rows) or rows.min() < 0 or rows.max() >= len(targets):
            self.dropped["point instancers with arrays that do not fit together"] += 1
            return
        groups = []
        for target in targets:
            prim = self._stage.GetPrimAtPath(target)
            groups.append(self._group(prim, depth, False) if prim else None)
        for k, (row, matrix) in enumerate(zip(rows.tolist(), np.array(transforms).transpose(0, 2, 1))):
            if groups[row] is None or (len(mask) and not mask[k]):
                continue
            entry = {"name": f"{path}[{k}]", "parent": node, "group": groups[row]}
            _place(entry, matrix)
            self.nodes.append(entry)
            if group is not None:
                group.add("instance")

    # What is at a node.

    def _content(self, prim, kind, node, group):
        if kind == "Mesh" or kind in _SHAPES:
            self._geometry(prim, kind, node, group)
        elif kind == "Camera":
            self._camera(UsdGeom.Camera(prim), node, group)
        elif prim.HasAPI(UsdLux.LightAPI) or kind.endswith("Light"):
            self._light(prim, kind, node, group)
        elif kind not in _SILENT and UsdGeom.Imageable(prim):
            self.dropped[f"prims of the type {kind}"] += 1

    def _object(self, primitives):
        """The name of the object of primitives: (positions, values, material) each. Equal ones are one."""
        made = hashlib.blake2b(digest_size=16)
        for positions, values, material in primitives:
            made.update(positions.tobytes() + repr(material).encode())
            for name in sorted(values):
                made.update(name.encode() + values[name].tobytes())
        key = made.digest()
        if key not in self._object_of:
            row = self._model(primitives)
            self.objects.append(row)
            self._object_of[key] = row["name"]
        return self._object_of[key]

    def _model(self, primitives):
        """Adds a mesh of primitives, which may have indices; returns its object."""
        rows = []
        for positions, values, material, *indices in primitives:
            attributes = {"POSITION": self._library.accessor(positions.reshape(-1, 3))}
            for name, rows_of in values.items():
                attributes[name] = self._library.accessor(rows_of.reshape(-1, rows_of.shape[-1]))
            row = {"attributes": attributes} | ({} if material is None else {"material": material})
            rows.append(row | {"indices": self._library.accessor(of) for of in indices})
        number = len(self._library.meshes)
        self._library.meshes.append({"primitives": rows})
        return {"name": f"mesh {number}", "model": f"{self._library.name}.gltf", "mesh": number}

    def _geometry(self, prim, kind, node, group):
        time = self._time
        binding = UsdShade.MaterialBindingAPI(prim)
        subsets = [s for s in UsdGeom.Subset.GetAllGeomSubsets(UsdGeom.Imageable(prim)) if s.GetElementTypeAttr().Get() in (None, "face")]
        subsets = [s for s in subsets if s.GetFamilyNameAttr().Get() == "materialBind"]
        of_whole = binding.ComputeBoundMaterial()[0]
        parts = [(UsdShade.MaterialBindingAPI(s.GetPrim()).ComputeBoundMaterial()[0], _mesh._array(s.GetIndicesAttr(), time, np.int64))
                 for s in subsets]
        double_sided = bool(UsdGeom.Gprim(prim).GetDoubleSidedAttr().Get())
        color = self._constant_color(prim)
        looks = [(material, *self._looks.of(material, double_sided, color), faces) for material, faces in [(of_whole, None), *parts]]
        if kind != "Mesh":
            if self._skins.is_on(prim):
                self.dropped["skins of simple shapes: shown as they were bound"] += 1
            rows = _mesh.shape(prim, time)
            self._shown(node, self._object([(np.asarray(rows, np.float32), {}, looks[0][1])]), group)
            return
        points = _mesh.array(self._skins.points(prim, time), np.float64, 3)
        names = ["displayColor", *sorted({name for _, _, name, _ in looks if name} - {"displayColor"})]
        found = _mesh.mesh(prim, points, time, self._levels, names, self.dropped)
        if found is None:
            return
        (points, rows, values, face), scheme = found
        if scheme == "catmullClark" and not self._levels:
            self.dropped["subdivision surfaces: control cages are shown (hint: subdivision=2)"] += 1
        owner = np.zeros(int(face.max(initial=-1)) + 1, np.int64)
        for k, (*_, faces) in enumerate(looks[1:], 1):
            owner[faces[(faces >= 0) & (faces < len(owner))]] = k
        is_posed = self._skins.is_on(prim)
        if is_posed and values.pop("normals", None) is not None:
            self.dropped["normals of meshes with skins"] += 1
        primitives = []
        for k, (material, row, uv, _) in enumerate(looks):
            chosen = owner[face] == k
            if chosen.any():
                attributes = self._attributes(values, chosen, uv, material)
                primitives.append((rows[chosen], attributes, row))
        if not primitives:
            return
        moves = is_posed or UsdGeom.Mesh(prim).GetPointsAttr().ValueMightBeTimeVarying()
        name = self._moving(prim, points, primitives) if moves and len(self._codes) > 1 else None
        if name is None:
            place = lambda rows: np.asarray(points[rows], np.float32)
            name = self._object([(place(rows), *others) for rows, *others in primitives])
        self._shown(node, name, group)

    def _moving(self, prim, points, primitives):
        """The name of the object of a mesh that moves; None if it stays, or its faces change."""
        has_normals = any("NORMAL" in values for _, values, _ in primitives)
        without = lambda values: {name: v for name, v in values.items() if name != "NORMAL"}
        primitives = [(rows, without(values), material) for rows, values, material in primitives]
        found = [_move.vertices(rows, values) for rows, values, _ in primitives]
        points_of = [rows.reshape(-1)[first] for (rows, *_), (first, _) in zip(primitives, found)]
        kept = np.concatenate(points_of)
        cache = f"{self._library.name}-{len(self._library.meshes)}.pc2"
        path, frames = os.path.join(self._folder, cache), self._frames(prim, len(points), kept)
        moves = _move.write_cache(path, frames, len(kept), self.first, len(self._codes))
        if moves is None:
            why = "meshes whose faces or number of points change: shown at the first frame"
            self.dropped[why] += 1
        if not moves:
            return None
        self.dropped.update(["normals of meshes that move"] * has_normals)
        indexed = []
        for (_, values, material), (first, vertex), of in zip(primitives, found, points_of):
            values = {name: v.reshape(-1, v.shape[-1])[first] for name, v in values.items()}
            indexed.append((points[of], values, material, vertex))
        row = self._model(indexed) | {"vertex_cache": cache}
        self.objects.append(row)
        return row["name"]

    def _frames(self, prim, count, kept):
        """The kept points of a mesh in each frame; None where faces or the count change."""
        of = UsdGeom.Mesh(prim)
        faces = of.GetFaceVertexCountsAttr(), of.GetFaceVertexIndicesAttr(), of.GetHoleIndicesAttr()
        faces = [attribute for attribute in faces if attribute.ValueMightBeTimeVarying()]
        first = [a.Get(self._time) for a in faces]
        for code in self._codes:
            same = [a.Get(code) for a in faces] == first
            points = _mesh.array(self._skins.points(prim, code), np.float64, 3)
            points = _mesh.refined(prim, points, self._time, self._levels) if same else points
            yield points[kept] if same and len(points) == count else None

    def _constant_color(self, prim):
        primvar = UsdGeom.PrimvarsAPI(prim).FindPrimvarWithInheritance("displayColor")
        if not primvar or not primvar.HasValue():
            return [0.18] * 3
        values = primvar.ComputeFlattened(self._time)
        is_one = primvar.GetInterpolation() == "constant" and values
        return [float(x) for x in values[0]] if is_one else None

    def _attributes(self, values, chosen, uv, material):
        found = {}
        if "normals" in values:
            normals = values["normals"][chosen]
            length = np.linalg.norm(normals, axis=-1, keepdims=True)
            if (length > 0).all():
                found["NORMAL"] = np.asarray(normals / length, np.float32)
        if uv in values:
            found["TEXCOORD_0"] = np.asarray(values[uv][chosen] * [1, -1] + [0, 1], np.float32)
        elif uv:
            self.dropped["textures without texture coordinates"] += 1
        if not material and "displayColor" in values:
            colors = values["displayColor"][chosen]
            if not (colors == colors.reshape(-1, 3)[0]).all():
                found["COLOR_0"] = np.asarray(np.clip(colors, 0, 1), np.float32)
        return found

    def _shown(self, node, name, group):
        self.nodes.append({"name": f"{node}#{len(self.nodes)}", "object": name, **({"parent": node} if node else {})})
        if group is not None:
            group.add("object")

    def _camera(self, of, node, group):
        if group is not None:
            self.dropped["cameras in instances"] += 1
            return
        camera = of.GetCamera(self._time)
        row = {"name": str(of.GetPath()), "node": node}
        wide, high = camera.horizontalAperture * Gf.Camera.APERTURE_UNIT, camera.verticalAperture * Gf.Camera.APERTURE_UNIT
        if not (wide > 0 and high > 0 and camera.focalLength > 0):
            self.dropped["cameras without an opening"] += 1
            return
        if camera.projection == Gf.Camera.Perspective:
            row["fov"] = math.degrees(2 * math.atan(high / 2 / (camera.focalLength * Gf.Camera.FOCAL_LENGTH_UNIT)))
        else:
            row["height"] = float(high)
        row["aspect"] = wide / high
        near, far = camera.clippingRange.min, camera.clippingRange.max
        if 0 <= near < far and math.isfinite(far):
            row |= {"near": float(near), "far": float(far)}
        if len(self._codes) > 1 and any(a.ValueMightBeTimeVarying() for a in (of.GetFocalLengthAttr(), of.GetVerticalApertureAttr())):
            self.dropped["zooms of cameras: shown as at the first frame"] += 1
        self.cameras.append(row)

    def _light(self, prim, kind, node, group):
        if group is not None and kind != "RectLight" and kind != "DiskLight":
            self.dropped["lights in instances"] += 1
            return
        of = UsdLux.LightAPI(prim)
        color = np.array(of.GetColorAttr().Get(self._time) or (1, 1, 1), float)
        if of.GetEnableColorTemperatureAttr().Get(self._time):
            color = color * np.array(UsdLux.BlackbodyTemperatureAsRgb(of.GetColorTemperatureAttr().Get(self._time)))
        strength = float(of.GetIntensityAttr().Get(self._time) or 0) * 2.0 ** float(of.GetExposureAttr().Get(self._time) or 0)
        is_normal = bool(of.GetNormalizeAttr().Get(self._time))
        if len(self._codes) > 1 and of.GetIntensityAttr().ValueMightBeTimeVarying():
            self.dropped["lights whose strength changes: shown as at the first frame"] += 1
        get = lambda name, default: default if prim.GetAttribute(name).Get(self._time) is None else prim.GetAttribute(name).Get(self._time)
        row = {"name": str(prim.GetPath()), "node": node, "color": [float(max(x, 0)) for x in color]}
        if kind == "DistantLight":
            # The solid angle of its disk: radiance becomes lux.
            size = math.pi * math.sin(math.radians(get("inputs:angle", 0.53) / 2)) ** 2
            self.lights.append({**row, "kind": "directional", "intensity": max(strength, 0) * (1 if is_normal or size == 0 else size)})
        elif kind == "SphereLight":
            radius = get("inputs:radius", 0.5)
            # The area that is seen: radiance becomes candela.
            area = 0.25 if is_normal else math.pi * radius * radius
            row |= {"kind": "point", "intensity": max(strength, 0) * area}
            angle = get("inputs:shaping:cone:angle", 90.0)
            if 0 < angle < 90:
                inner = angle * (1 - min(max(get("inputs:shaping:cone:softness", 0.0), 0.0), 1.0))
                row |= {"kind": "spot", "outer": float(angle), "inner": float(min(inner, angle * 0.999))}
            self.lights.append(row)
        elif kind in ("RectLight", "DiskLight"):
            self._area_light(kind, node, group, color * strength, is_normal, get)
        else:
            self.dropped[f"lights of the type {kind}"] += 1

    def _area_light(self, kind, node, group, radiance, is_normal, get):
        """A surface that emits. It shines from both sides."""
        self.dropped["area lights: they shine from both sides"] += 1
        if kind == "RectLight":
            w, h = get("inputs:width", 1.0) / 2, get("inputs:height", 1.0) / 2
            corner, area = np.array([[-w, -h, 0], [-w, h, 0], [w, h, 0], [w, -h, 0]]), 4 * w * h
        else:
            radius, turn = get("inputs:radius", 0.5), np.linspace(0, 2 * np.pi, 33)[:-1]
            corner, area = radius * np.stack([np.cos(turn), -np.sin(turn), 0 * turn], 1), math.pi * radius * radius
        fan = np.array([[0, k, k + 1] for k in range(1, len(corner) - 1)])
        emission = np.clip(radiance / (area if is_normal and area > 0 else 1), 0, 1e6)
        look = {"name": "light", "doubleSided": True, "pbrMetallicRoughness": {"baseColorFactor": [0.0, 0.0, 0.0, 1.0], "metallicFactor": 0.0}}
        strength = float(max(1.0, emission.max()))
        look["emissiveFactor"] = [float(x) / strength for x in emission]
        look["extensions"] = {"KHR_materials_emissive_strength": {"emissiveStrength": strength}}
        material = self._library.once(self._library.materials, ("light", *emission), lambda: look)
        self._shown(node, self._object([(np.asarray(corner[fan], np.float32), {}, material)]), group)


def _place(row, matrix):
    """The transform of a node that does not move."""
    if not np.array_equal(matrix, np.eye(4)):
        # What has no size is not seen.
        if not np.isfinite(matrix).all() or np.linalg.det(matrix[:3, :3]) == 0:
            row["visible"] = False
        else:
            row["matrix"] = matrix[:3].tolist()


def _parts(matrix):
    """Translation, rotation (x, y, z, w), scale, and whether something is left over."""
    linear = matrix[:3, :3]
    scale = np.linalg.norm(linear, axis=0)
    turn = linear / np.where(scale > 0, scale, 1)
    if not (scale > 0).all():
        return matrix[:3, 3].tolist(), [0.0, 0.0, 0.0, 1.0], [0.0, 0.0, 0.0], False
    if np.linalg.det(turn) < 0:
        scale, turn = -scale, -turn
    # What rounding leaves of the products of unit vectors.
    sheared = np.abs(turn.T @ turn - np.eye(3)).max() > 2.0**-20
    if sheared:
        u, _, v = np.linalg.svd(turn)
        turn = u @ v
    q = Gf.Matrix3d(*turn.T.reshape(-1).tolist()).ExtractRotation().GetQuat()
    return matrix[:3, 3].tolist(), [*q.GetImaginary(), q.GetReal()], scale.tolist(), bool(sheared)


def _toml(value):
    """A value of TOML, which is as in JSON but for tables."""
    if isinstance(value, dict):
        return "{ " + ", ".join(f"{key} = {_toml(entry)}" for key, entry in value.items()) + " }"
    if isinstance(value, (list, tuple)):
        return "[" + ", ".join(map(_toml, value)) + "]"
    return json.dumps(value, ensure_ascii=False)


def convert(stage, folder, name, levels):
    """Writes NAME.manifest and what it refers to; returns its path and what was dropped, counted."""
    converter = Converter(stage, folder, name, levels)
    converter.run()
    path = os.path.join(folder, f"{name}.manifest")
    with open(path, "w", encoding="utf-8") as file:
        file.write(converter.manifest())
    return path, dict(converter.dropped)
