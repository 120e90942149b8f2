"""What a scene consists of: geometry, places, names, masks."""

import operator

import numpy as np

from . import _arrays, _materials, _native, _threads
from ._hits import FIELDS, NONE, SurfacePoints
from ._ray_queries import mask_bits


def _index(index, name):
    """One index as the native module takes it, which knows how many there are."""
    number = operator.index(index)
    if not 0 <= number <= NONE:
        raise IndexError(f"{name}: expected an index from 0, got {number}")
    return number


class Contents:
    """What a Scene consists of. `obj` is the index of an object, and may be left out in files of one object."""

    __slots__ = ()

    # At points of triangles.

    def _points(self, u, v, instance, triangle):
        points = _arrays.weights(u, "u"), _arrays.weights(v, "v"), _arrays.indices(instance, "instance"), _arrays.indices(triangle, "triangle")
        try:
            points = np.broadcast_arrays(*points)
        except ValueError:
            shapes = ", ".join(str(a.shape) for a in points)
            raise ValueError(f"u, v, instance and triangle: the shapes {shapes} do not fit together") from None
        return tuple(np.require(a.reshape(-1), None, "A") for a in points), points[0].shape

    def _surface(self, points, names):
        """The fields of these names at points (u, v, instance, triangle)."""
        points, shape = self._points(*points)
        arrays = dict.fromkeys(FIELDS)
        for name in names:
            kind, of_one, nothing = FIELDS[name]
            arrays[name] = np.full((len(points[0]), *of_one), nothing, kind)
        flat = {name: None if a is None else a.reshape(-1) for name, a in arrays.items()}
        _native.surface(self._native, points, flat, _threads.count(None))
        return {name: arrays[name].reshape((*shape, *FIELDS[name][1])) for name in names}

    def surface(self, instance, triangle, u=0.0, v=0.0):
        """The surface at points of triangles, given by the weights of their second and third vertices, as SurfacePoints. All four are broadcast."""
        return SurfacePoints(self._surface((u, v, instance, triangle), tuple(FIELDS)))

    def normals(self, instance, triangle):
        """Unit normals of triangles in world space, (..., 3) float64; zeros for bth.NONE, for triangles without area and in hidden instances."""
        return self._surface((0.0, 0.0, instance, triangle), ("geometric_normal",))["geometric_normal"]

    def triangle_positions(self, instance, triangle):
        """The vertices of triangles in world space at the scene's time, (..., 3, 3) float64; NaN for bth.NONE."""
        points, shape = self._points(0.0, 0.0, instance, triangle)
        out = np.full(len(points[0]) * 9, np.nan)
        _native.triangle_positions(self._native, points, out, _threads.count(None))
        return out.reshape(*shape, 3, 3)

    # Geometry of objects.

    def vertices(self, obj=0):
        """Distinct positions of an object, (n, 3) in the space of the object: float32, or float64 where the file keeps that."""
        return _arrays.read_only(self._native.geometry(_index(obj, "obj"))[0])

    def triangles(self, obj=0):
        """For each triangle of an object its rows of `vertices`, (m, 3) uint32."""
        return _arrays.read_only(self._native.geometry(_index(obj, "obj"))[1])

    def texture_coordinates(self, obj=0):
        """Texture coordinates of the corners of an object's triangles, (m, 3, 2) float32 as the source has them; None where the scene
        keeps none (`attributes='all'` of `bth.compile` keeps them)."""
        coordinates = _native.texture_coordinates(self._native, _index(obj, "obj"))
        return None if coordinates is None else _arrays.read_only(coordinates)

    @property
    def triangle_counts(self):
        """For each object its number of triangles."""
        return _arrays.read_only(np.array(self._native.facts()["triangles"], np.int64))

    # Closed surfaces.

    @property
    def is_closed(self):
        """Whether all visible objects are closed; None where the file keeps no triangles."""
        closed = [self.is_object_closed(obj) for obj in self._visible_objects()]
        return False if False in closed else None if None in closed else True

    def is_object_closed(self, obj=0):
        """Whether an object's surface has no boundary, so that it has an inside: whether each edge has as many triangles in one direction
        as in the other. Vertices at one place count as one. None where the file keeps no triangles. Answers are kept, except for deformable
        objects."""
        obj = _index(obj, "obj")
        if obj not in self._closed:
            closed = self._native.is_closed(obj)
            if self._native.vertex_count(obj) is not None:
                return closed
            self._closed[obj] = closed
        return self._closed[obj]

    def _visible_objects(self):
        _, objects, visible = self._native.placements()
        return sorted({obj for obj, seen in zip(objects, visible) if seen})

    # Bounds: lower and upper end of a box, (2, 3) float32; None where there is nothing that can be hit.

    @property
    def bounds(self):
        """Lower and upper end of a box in world space around all that can be hit, (2, 3) float32; None if there is nothing."""
        return _box(self._native.bounds())

    def instance_bounds(self, instance):
        """Lower and upper end of a box in world space around an instance, (2, 3) float32; None if it is hidden."""
        return _box(self._native.instance_bounds(_index(instance, "instance")))

    def instance_path(self, instance):
        """Rows of the file's instances on the way to an instance, that in the world first; `(instance,)` in a scene without groups."""
        return tuple(self._native.instance_path(_index(instance, "instance")))

    def object_bounds(self, obj=0):
        """Lower and upper end of a box around an object, in the space of the object, (2, 3) float32; None if nothing of it can be hit."""
        return _box(self._native.object_bounds(_index(obj, "obj")))

    # Instances.

    @property
    def transforms(self):
        """For each instance the transform from its object's space to world space at the scene's time, (n, 4, 4) float64. `set_transforms`
        sets them."""
        rows = self._native.placements()[0]
        matrices = np.zeros((len(rows), 4, 4))
        matrices[:, :3] = rows
        matrices[:, 3, 3] = 1
        return _arrays.read_only(matrices)

    @property
    def objects_of_instances(self):
        """For each instance the index of its object; bth.NONE for a removed one."""
        return _arrays.read_only(np.array(self._native.placements()[1], np.uint32))

    @property
    def visible(self):
        """For each instance whether rays can hit it at the scene's time. `set_visible` hides and shows instances."""
        return _arrays.read_only(np.array(self._native.placements()[2], bool))

    # Names.

    @property
    def object_names(self):
        """For each object its name, that of the scene manifest or of the glTF mesh; empty if the file keeps none (see the option `names`)."""
        return _native.object_names(self._native)

    @property
    def instance_names(self):
        """For each instance the name of its node; empty in files without scene."""
        return _native.instance_names(self._native)

    def group_names(self, obj=0):
        """For each group of an object's triangles its name; one group without a name if the file keeps none (see the option `names`)."""
        return _native.groups(self._native, _index(obj, "obj"))[0]

    def material_names(self, obj=0):
        """For each material of an object its name; none if the file keeps none (see the option `names`)."""
        return _native.groups(self._native, _index(obj, "obj"))[2]

    def group_materials(self, obj=0):
        """For each group of an object's triangles the index of its material, or None."""
        return _native.groups(self._native, _index(obj, "obj"))[1]

    # How surfaces look.

    def materials(self, obj=0):
        """For each material of an object how it looks, as Material; None where the file keeps no more than its name (see the option `materials`)."""
        return [_materials.material(row) for row in _native.materials(self._native, _index(obj, "obj"))]

    def textures(self, obj=0):
        """For each texture of an object its image file and how it lies on the surface, as Texture."""
        return [_materials.texture(row) for row in _native.textures(self._native, _index(obj, "obj"))]

    # Masks.

    @property
    def instance_masks(self):
        """For each instance its mask, uint32: all bits are set unless `set_instance_mask` was called."""
        return _arrays.read_only(np.array(_native.instance_masks(self._native), np.uint32))

    def group_masks(self, obj=0):
        """For each group of an object's triangles its mask, uint32: all bits are set unless `set_group_mask` was called."""
        return _arrays.read_only(np.array(_native.group_masks(self._native, _index(obj, "obj")), np.uint32))

    def set_instance_mask(self, instance, mask):
        """Sets the mask of an instance, 32 bits: rays whose `mask` has no bit in common with it pass. Waits for the queries of other threads."""
        _native.set_instance_mask(self._native, _index(instance, "instance"), mask_bits(mask))

    def set_group_mask(self, group, mask, obj=0):
        """Sets the mask of a group of an object's triangles, in all its instances, by index, or of all groups of a name. A ray must have a bit in common with the instance and one with the group."""
        if isinstance(group, str):
            groups = [index for index, name in enumerate(self.group_names(obj)) if name == group]
            if not groups:
                raise LookupError(f"group: object {obj} has none that is called {group!r}")
        else:
            groups = [_index(group, "group")]
        _native.set_group_masks(self._native, _index(obj, "obj"), groups, mask_bits(mask))


def _box(bounds):
    return None if bounds is None else _arrays.read_only(np.array(bounds, np.float32))
