"""What queries return."""

import enum

import numpy as np

#: The index of no triangle, no instance and so on, as of those that a ray hits which hits nothing.
NONE = 0xFFFFFFFF


class Opacity(enum.IntEnum):
    """Whether there is a surface at a point of a triangle, by the alpha of its texture (`bth.compile(…, alpha="mask")`)."""

    OPAQUE = 0
    #: Never that of a hit: rays pass.
    TRANSPARENT = 1
    #: At the edge of a hole: a surface, unless a filter decides otherwise.
    UNKNOWN = 2


class _OnTriangles:
    """What there is at points of triangles, asked of the scene when it is needed, at the scene's time then.

    Needs the attributes u, v, instance, triangle and _scene.
    """

    __slots__ = ()

    def _field(self, name):
        return self._scene._surface((self.u, self.v, self.instance, self.triangle), (name,))[name]

    def surface(self):
        """Everything that the file says about the points, as SurfacePoints."""
        return self._scene.surface(self.instance, self.triangle, self.u, self.v)

    @property
    def normal(self):
        """Unit normals of the triangles, in world space and float64, on the side from which their vertices are counter-clockwise; zeros for a miss."""
        return self._field("geometric_normal")

    @property
    def shading_normal(self):
        """The source's normals interpolated, of length 1, in world space and float64; zeros for a miss. `normal` where the file keeps none (see the option `attributes`)."""
        return self._field("shading_normal")

    @property
    def texcoord(self):
        """Interpolated texture coordinates, (..., 2) float32; NaN for a miss and where the file keeps none (see the option `attributes`)."""
        return self._field("texcoord")

    @property
    def second_texcoord(self):
        """The same for a second set of texture coordinates, that of textures whose `uv_set` is 1; NaN for a miss and where the file keeps none (see the option `materials`)."""
        return self._field("second_texcoord")

    @property
    def vertex_color(self):
        """Vertex colors interpolated, (..., 4) float32: linear red, green, blue and alpha; NaN for a miss and where the file keeps none (see the option `materials`)."""
        return self._field("vertex_color")

    @property
    def object(self):
        """Indices of objects; NONE for a miss."""
        return self._field("object")

    @property
    def group(self):
        """Indices of the triangles' groups in their objects: 0 where the file keeps no groups (see the option `names`); NONE for a miss."""
        return self._field("group")

    @property
    def material(self):
        """Indices of the objects' materials; NONE for a miss, and where there is none."""
        return self._field("material")

    @property
    def opacity(self):
        """Opacity at the points, uint8 as in `bth.Opacity`; OPAQUE for a miss."""
        return self._field("opacity")

    @property
    def object_name(self):
        """Names of the objects, an array of str; empty for a miss and where there is none."""
        return _named(self._scene.object_names, self.object)

    @property
    def instance_name(self):
        """Names of the instances, an array of str; empty for a miss and where there is none."""
        return _named(self._scene.instance_names, self.instance)

    @property
    def group_name(self):
        """Names of the groups, an array of str; empty for a miss and where there is none."""
        return self._named_in_objects(self._scene.group_names, self.group)

    @property
    def material_name(self):
        """Names of the materials, an array of str; empty for a miss and where there is none."""
        return self._named_in_objects(self._scene.material_names, self.material)

    def _named_in_objects(self, names_of, index):
        objects = np.asarray(self.object)
        names = np.full(objects.shape, "", object)
        for obj in np.unique(objects[objects != NONE]):
            there = objects == obj
            names[there] = _named(names_of(int(obj)), np.asarray(index)[there])
        return names


def _named(names, index):
    """The names at indices; empty at NONE."""
    table, index = np.array([*names, ""], object), np.asarray(index)
    return table[np.where(index == NONE, len(names), index).reshape(-1)].reshape(index.shape)


class Hits(_OnTriangles):
    """Nearest hits of rays, each an array of the rays' leading shape.

    t: distance in units of the direction's length, infinite for a miss; float64 for rays in float64, else float32.
    u, v: weights of the triangle's second and third vertex, float32 (not texture coordinates: see `texcoord`).
    triangle, instance: indices; bth.NONE for a miss.
    """

    __slots__ = ("t", "u", "v", "instance", "triangle", "_scene", "_rays", "_position")

    def __init__(self, columns, scene, rays):
        self.t, self.u, self.v, self.instance, self.triangle = columns
        self._scene, self._rays, self._position = scene, rays, None

    @property
    def hit(self):
        """Whether the ray hits anything."""
        return self.triangle != NONE

    @property
    def position(self):
        """The points hit in world space, in float64, computed from t; NaN for a miss. `surface().position` is nearer to the triangle.

        They are computed once, when they are first asked for, from the arrays of origins and directions that the query was given.
        For rays with starts they are `surface().position`.
        """
        if self._position is not None:
            return self._position.copy()
        origins, directions = self._rays
        if origins is None:
            self._position, self._rays = self._field("position"), None
            return self._position.copy()
        t = np.where(self.hit, self.t, np.nan).astype(np.float64)
        points = np.asarray(origins, np.float64) + t.reshape(-1)[:, None] * np.asarray(directions, np.float64)
        self._position, self._rays = points.reshape(*t.shape, 3), None
        return self._position.copy()

    def __len__(self):
        return len(self.t)

    def __repr__(self):
        return f"<bth.Hits of shape {self.t.shape}, {int(self.hit.sum())} hit>"


class AllHits(_OnTriangles):
    """All hits of rays: those of ray i are the rows offsets[i] to offsets[i + 1] of the arrays t, u, v, instance and triangle.

    They ascend by t, and by instance and triangle where t is the same; those of one instance by t before it was rounded to float32.
    `most` compares t of several instances in float32. Rays of several axes count in C order.
    """

    __slots__ = ("offsets", "t", "u", "v", "instance", "triangle", "_scene")

    def __init__(self, offsets, columns, scene):
        self.offsets = offsets
        self.t, self.u, self.v, self.instance, self.triangle = columns
        self._scene = scene

    @property
    def ray(self):
        """For each hit the index of its ray."""
        return _owners(self.offsets)

    def __len__(self):
        return len(self.t)

    def __repr__(self):
        return f"<bth.AllHits of {len(self.offsets) - 1} rays, {len(self)} hits>"


class Overlaps:
    """Triangles that overlap regions: those of region i are the rows offsets[i] to offsets[i + 1] of the arrays instance and triangle.

    They ascend by instance and triangle. Regions of several axes count in C order.
    """

    __slots__ = ("offsets", "instance", "triangle")

    def __init__(self, offsets, instance, triangle):
        self.offsets, self.instance, self.triangle = offsets, instance, triangle

    @property
    def region(self):
        """For each triangle the index of its region."""
        return _owners(self.offsets)

    def __len__(self):
        return len(self.triangle)

    def __repr__(self):
        return f"<bth.Overlaps of {len(self.offsets) - 1} regions, {len(self)} triangles>"


def _owners(offsets):
    return np.repeat(np.arange(len(offsets) - 1), np.diff(offsets))


class Closest(_OnTriangles):
    """Closest points, each an array of the points' leading shape.

    distance: infinite where nothing is within the radius. point: in world space, NaN there. Both are of the type of the points.
    u, v: weights of the triangle's second and third vertex. triangle, instance: indices; bth.NONE where there is none.
    feature: where on the triangle, uint8: 0 inside, 1 to 3 on the edge from the first, second or third vertex to the next, 4 to 6 at that vertex.
    """

    __slots__ = ("distance", "point", "u", "v", "instance", "triangle", "feature", "_scene")

    def __init__(self, columns, point, feature, scene):
        self.distance, self.u, self.v, self.instance, self.triangle = columns
        self.point, self.feature, self._scene = point, feature, scene

    @property
    def found(self):
        """Whether there is anything within the radius."""
        return self.triangle != NONE

    def __len__(self):
        return len(self.distance)

    def __repr__(self):
        return f"<bth.Closest of shape {self.distance.shape}>"


#: The arrays of SurfacePoints and opacity: type, shape of one, and what stands where there is nothing.
FIELDS = {
    "position": (np.float64, (3,), np.nan),
    "object_position": (np.float64, (3,), np.nan),
    "geometric_normal": (np.float64, (3,), 0),
    "object_geometric_normal": (np.float64, (3,), 0),
    "shading_normal": (np.float64, (3,), 0),
    "object_shading_normal": (np.float64, (3,), 0),
    "texcoord": (np.float32, (2,), np.nan),
    "second_texcoord": (np.float32, (2,), np.nan),
    "vertex_color": (np.float32, (4,), np.nan),
    "object": (np.uint32, (), NONE),
    "group": (np.uint32, (), NONE),
    "material": (np.uint32, (), NONE),
    "opacity": (np.uint8, (), Opacity.OPAQUE),
}


class SurfacePoints:
    """The surface at points of triangles, each an array of their leading shape. Where nothing was hit, positions and texture coordinates are NaN, normals zeros, and indices bth.NONE.

    position, object_position: the points on the triangles, float64, in world space and in the space of the object.
    geometric_normal, object_geometric_normal: unit normals of the triangles' planes, float64.
    shading_normal, object_shading_normal: the source's normals interpolated, float64; the geometric ones where the file keeps none.
    texcoord: texture coordinates interpolated, float32; NaN where the file keeps none.
    second_texcoord: the same for a second set, that of textures whose `uv_set` is 1.
    vertex_color: linear red, green, blue and alpha interpolated, float32; NaN where the file keeps none.
    object, group, material: indices; material is bth.NONE where there is none.
    opacity: as in bth.Opacity.
    """

    __slots__ = tuple(FIELDS)

    def __init__(self, fields):
        self.position = fields["position"]
        self.object_position = fields["object_position"]
        self.geometric_normal = fields["geometric_normal"]
        self.object_geometric_normal = fields["object_geometric_normal"]
        self.shading_normal = fields["shading_normal"]
        self.object_shading_normal = fields["object_shading_normal"]
        self.texcoord = fields["texcoord"]
        self.second_texcoord = fields["second_texcoord"]
        self.vertex_color = fields["vertex_color"]
        self.object = fields["object"]
        self.group = fields["group"]
        self.material = fields["material"]
        self.opacity = fields["opacity"]

    def __len__(self):
        return len(self.object)

    def __repr__(self):
        return f"<bth.SurfacePoints of shape {self.object.shape}>"


def hit_columns(count, kind):
    """Arrays for t, of this type, u, v, instance and triangle."""
    return tuple(np.empty(count, kind) for kind in (kind, np.float32, np.float32, np.uint32, np.uint32))


def offsets_of(counts):
    """The first row of each, and the end of the last."""
    offsets = np.zeros(len(counts) + 1, np.int64)
    np.cumsum(counts.astype(np.int64), out=offsets[1:])
    return offsets
