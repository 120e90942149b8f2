"""Engines of PyPI, for `bth-bench truth`. src/truth/process.rs describes commands and files; `setup` installs them."""

import importlib.metadata
import sys
import time
from pathlib import Path

import numpy as np

NONE = 2**32 - 1
NO_QUERY = "has no such query"


class Engine:
    """A set, and how it is asked; each engine overrides what it can."""

    package = ""

    def load(self, folder):
        def read(name, kind, columns):
            return np.fromfile(folder / name, kind).reshape(-1, columns)

        self.folder = folder
        self.query = (folder / "query").read_text()
        self.positions = read("positions", "<f8", 3)
        self.triangles = read("triangles", "<u4", 3)
        self.origins, self.directions = read("origins", "<f8", 3), read("directions", "<f8", 3)
        self.count = len(self.origins)
        if self.query not in self.answers():
            raise NotImplementedError(NO_QUERY)
        self.build()

    def answers(self):
        return {q: getattr(self, q) for q in ("nearest", "inside", "visible") if hasattr(self, q)}

    def run(self):
        """The seconds of processor time of all threads, and t and id."""
        start = time.process_time()
        found = self.answers()[self.query]()
        seconds = time.process_time() - start
        t, ids = (None, found) if self.query != "nearest" else self.convert(found)
        np.asarray(np.zeros(self.count) if t is None else t, "<f8").tofile(self.folder / "t")
        np.asarray(ids).astype("<u4").tofile(self.folder / "id")
        return seconds

    def convert(self, found):
        """t and ids of what `nearest` returns; not timed."""
        return found

    def scattered(self, rows, t, ids):
        """t and ids of all rays, given those of the rays that hit."""
        all_t, all_ids = np.full(self.count, np.inf), np.full(self.count, NONE)
        all_t[rows], all_ids[rows] = t, ids
        return all_t, all_ids


class Trimesh(Engine):
    package = "trimesh"
    use_embree = True

    def build(self):
        import trimesh

        mesh = trimesh.Trimesh(self.positions, self.triangles.astype(np.int64), process=False)
        module = trimesh.ray.ray_pyembree if self.use_embree else trimesh.ray.ray_triangle
        self.tracer = module.RayMeshIntersector(mesh)
        self.tracer.contains_points(self.origins[:1])

    def nearest(self):
        return self.tracer.intersects_id(self.origins, self.directions, multiple_hits=False, return_locations=True)

    def convert(self, found):
        ids, rows, points = found[0], found[1].astype(int), found[2].reshape(-1, 3)
        direction = self.directions[rows]
        along = np.einsum("ij,ij->i", points - self.origins[rows], direction)
        return self.scattered(rows, along / np.einsum("ij,ij->i", direction, direction), ids)

    def inside(self):
        return self.tracer.contains_points(self.origins)

    def visible(self):
        t, ids = self.convert(self.nearest())
        return t >= 1


class TrimeshRtree(Trimesh):
    use_embree = False


class Open3D(Engine):
    package = "open3d"

    def build(self):
        import open3d as o3d

        self.tensor = o3d.core.Tensor
        self.scene = o3d.t.geometry.RaycastingScene(nthreads=1)
        self.scene.add_triangles(self.tensor(self.positions.astype("f4")), self.tensor(self.triangles))
        self.rays = self.tensor(np.hstack([self.origins, self.directions]).astype("f4"))
        self.points = self.tensor(self.origins.astype("f4"))

    def nearest(self):
        return self.scene.cast_rays(self.rays, nthreads=1)

    def convert(self, found):
        return found["t_hit"].numpy(), found["primitive_ids"].numpy()

    def inside(self):
        return self.scene.compute_occupancy(self.points, nthreads=1).numpy() > 0

    def visible(self):
        return ~self.scene.test_occlusions(self.rays, tfar=1.0, nthreads=1).numpy()


class Fcpw(Engine):
    package = "fcpw"

    def build(self):
        import fcpw

        self.scene = fcpw.scene_3D()
        self.scene.set_object_count(1)
        self.scene.set_object_vertices(np.asfortranarray(self.positions, "f4"), 0)
        self.scene.set_object_triangles(np.asfortranarray(self.triangles, "i4"), 0)
        self.scene.build(fcpw.aggregate_type.bvh_surface_area, True)
        # Its t are distances if directions have unit length.
        self.lengths = np.linalg.norm(self.directions, axis=1)
        with np.errstate(invalid="ignore"):
            unit = self.directions / self.lengths[:, None]
        self.starts = np.asfortranarray(self.origins, "f4")
        if self.query != "nearest":
            self.starts = self.origins.astype("f4")
            self.ends = (self.origins + self.directions).astype("f4")
        self.units = np.asfortranarray(unit, "f4")
        self.bounds = np.full(self.count, np.inf, "f4")
        self.hits = fcpw.interaction_3D_list

    def nearest(self):
        hits = self.hits()
        self.scene.intersect(self.starts, self.units, self.bounds, hits)
        return hits

    def convert(self, hits):
        ids = np.array([hit.primitive_index for hit in hits])
        t = np.array([hit.d for hit in hits]) / self.lengths
        missed = (ids < 0) | ~np.isfinite(t) | (ids >= len(self.triangles))
        return np.where(missed, np.inf, t), np.where(missed, NONE, ids)

    # Its calls for arrays of points return nothing (1.2.0).
    def inside(self):
        return [self.scene.contains(point) for point in self.starts]

    def visible(self):
        return [self.scene.has_line_of_sight(a, b) for a, b in zip(self.starts, self.ends)]


class Manifold(Engine):
    package = "manifold3d"

    def build(self):
        import manifold3d

        self.model = manifold3d.Manifold(manifold3d.Mesh64(self.positions.copy(), self.triangles.astype("u8")))
        if self.model.status() != manifold3d.Error.NoError or self.model.is_empty():
            raise ValueError("refuses the mesh, which is not an oriented manifold")
        # It sorts the triangles; hits count in the order of `to_mesh64`.
        mesh = self.model.to_mesh64()
        rows = {row.tobytes(): i for i, row in enumerate(self.corners(self.positions, self.triangles))}
        points = np.array(mesh.vert_properties)[:, :3]
        self.ids = [rows.get(row.tobytes(), NONE - 1) for row in self.corners(points, np.array(mesh.tri_verts))]
        # It casts segments, so they end beyond the model.
        size = np.linalg.norm(np.ptp(self.positions, axis=0)) + np.abs(self.origins - self.positions[0]).max()
        far = 1 if self.query == "visible" else 4 * size / np.linalg.norm(self.directions, axis=1)[:, None].clip(1e-300)
        self.ends, self.far = self.origins + far * self.directions, far

    @staticmethod
    def corners(positions, triangles):
        """A row for each triangle that does not depend on which corner is the first."""
        triangles = np.asarray(triangles)
        found = positions[triangles]
        first = np.lexsort(found.transpose(2, 0, 1), axis=1)[:, :1]
        return np.ascontiguousarray(np.take_along_axis(found, ((first + np.arange(3)) % 3)[:, :, None], 1))

    def nearest(self):
        cast = self.model.ray_cast
        return [cast(a, b) for a, b in zip(self.origins, self.ends)]

    def convert(self, found):
        rows = [i for i, hits in enumerate(found) if hits]
        points = np.array([found[i][0].position for i in rows]).reshape(-1, 3)
        direction = self.directions[rows]
        along = np.einsum("ij,ij->i", points - self.origins[rows], direction)
        ids = [self.ids[found[i][0].face_id] for i in rows]
        return self.scattered(rows, along / np.einsum("ij,ij->i", direction, direction), ids)

    def visible(self):
        return [not hits for hits in self.nearest()]


class Libigl(Engine):
    package = "libigl"

    def build(self):
        import igl

        self.igl, self.faces = igl, self.triangles.astype(np.int64)
        self.tree = igl.AABB()
        self.tree.init(self.positions, self.faces)

    def nearest(self):
        return self.tree.intersect_ray_first(self.positions, self.faces, self.origins, self.directions, np.inf)

    def convert(self, found):
        ids, t, _ = found
        return np.where(ids < 0, np.inf, t), np.where(ids < 0, NONE, ids)

    def inside(self):
        return self.igl.fast_winding_number(self.positions, self.faces, self.origins) > 0.5

    def visible(self):
        t, _ = self.convert(self.nearest())
        return t >= 1


ENGINES = {
    "trimesh": Trimesh,
    "trimesh rtree": TrimeshRtree,
    "Open3D": Open3D,
    "fcpw": Fcpw,
    "manifold3d": Manifold,
    "libigl": Libigl,
}


def main():
    # Libraries print, too.
    out, sys.stdout = sys.stdout, sys.stderr

    def say(*words):
        print(*words, file=out, flush=True)

    engine = ENGINES[sys.argv[1]]()
    try:
        say("ok", importlib.metadata.version(engine.package))
    except importlib.metadata.PackageNotFoundError:
        say("no not installed (run tools/bench/truth/setup)")
        return
    for line in sys.stdin:
        try:
            start = time.process_time()
            if line.startswith("load "):
                engine.load(Path(line[5:].strip()))
                say("ok", time.process_time() - start)
            else:
                say("ok", engine.run())
        except Exception as error:  # an engine that fails is a row that says so
            say("no", " ".join(str(error).split())[:200] or type(error).__name__)


main()
