"""The drop-ins for trimesh, embreex and Open3D."""

import copy
import pickle
from types import SimpleNamespace

import numpy as np
import pytest
from conftest import hits_by_force
from processes import exits

import bth
from bth.embreex.mesh_construction import ElementMesh, TriangleMesh
from bth.embreex.rtcore import EmbreeDevice
from bth.embreex.rtcore_scene import EmbreeScene
from bth.open3d import RaycastingScene


@pytest.fixture(scope="module")
def trimesh_mesh(mesh):
    trimesh = pytest.importorskip("trimesh")
    return trimesh.Trimesh(*mesh, process=False)


def test_trimesh(trimesh_mesh, mesh, rays):
    import bth.trimesh

    ray = bth.trimesh.RayMeshIntersector(trimesh_mesh)
    origins, directions = rays
    expected = [hits_by_force(*mesh, o, d) for o, d in zip(origins, directions)]
    triangles, of_ray, locations = ray.intersects_id(origins, directions, return_locations=True)
    assert triangles.tolist() == [f for hits in expected for _, f in hits]
    assert of_ray.tolist() == [i for i, hits in enumerate(expected) for _ in hits]
    t = np.array([t for hits in expected for t, _ in hits])
    np.testing.assert_allclose(locations, origins[of_ray] + t[:, None] * directions[of_ray], atol=1e-9)
    first = [hits[0][1] if hits else -1 for hits in expected]
    assert ray.intersects_first(origins, directions).tolist() == first
    assert ray.intersects_any(origins, directions).tolist() == [f >= 0 for f in first]
    assert ray.intersects_location(origins, directions, multiple_hits=False)[2].tolist() == [f for f in first if f >= 0]
    assert ray.contains_points([[0, 0, 0], [0, 0, 2]]).tolist() == [True, False]
    for other in (copy.copy(ray), copy.deepcopy(ray), pickle.loads(pickle.dumps(ray))):
        assert other.intersects_first(origins, directions).tolist() == first
    with pytest.raises(ValueError):
        ray.intersects_any(origins, directions[:5])


@pytest.mark.parametrize("size", [1e-5, 1e45])
def test_trimesh_of_any_size(size):
    trimesh = pytest.importorskip("trimesh")
    import bth.trimesh

    small, large = (bth.trimesh.RayMeshIntersector(trimesh.creation.box([length] * 3)) for length in (1, size))
    origins, directions = np.random.default_rng(8).normal(size=(2, 50, 3))
    expected, found = (ray.intersects_id(size * origins, size * directions, return_locations=True) for ray, size in ((small, 1), (large, size)))
    assert len(expected[0]) > 10 and all((a == b).all() for a, b in zip(expected[:2], found))
    np.testing.assert_allclose(found[2] / size, expected[2], atol=1e-5)
    assert (large.intersects_any(size * origins, size * directions) == small.intersects_any(origins, directions)).all()


def test_trimesh_takes_so_many_hits_of_each_ray():
    trimesh = pytest.importorskip("trimesh")
    import bth.trimesh

    ray = bth.trimesh.RayMeshIntersector(trimesh.creation.box())
    for most in (1, 2, 3):
        hits = min(most, 2)
        assert ray.intersects_id([[0.1, 0.2, 5]] * 2, [[0, 0, -1]] * 2, max_hits=most)[1].tolist() == [0] * hits + [1] * hits


def test_trimesh_counts_an_edge_once(mesh, trimesh_mesh):
    import bth.trimesh

    ray = bth.trimesh.RayMeshIntersector(trimesh_mesh, scale_to_box=False)
    targets = mesh[0].astype(float)
    triangles, of_ray = ray.intersects_id(np.zeros_like(targets), targets)
    assert of_ray.tolist() == list(range(len(targets)))


def test_trimesh_counts_a_vertex_once_for_each_side():
    """A ray that touches the tip of two wedges, whose triangles are met from the front and from behind in turn."""
    trimesh = pytest.importorskip("trimesh")
    import bth.trimesh

    corners = [[0, 0, 0], [1, 1, 0], [-1, 1, 0], [0, 1, 1], [0, 1, -1]]
    mesh = trimesh.Trimesh(corners, [[0, 1, 3], [0, 4, 1], [0, 3, 2], [0, 2, 4]], process=False)
    facing = mesh.face_normals[:, 2] > 0
    assert facing.tolist() == [True, False, True, False]
    triangles, of_ray = bth.trimesh.RayMeshIntersector(mesh).intersects_id([[0, 0, -5], [9, 9, 9], [0, 0, -5]], [[0, 0, 1]] * 3)
    assert of_ray.tolist() == [0, 0, 2, 2] and facing[triangles].sum() == 2


def test_embreex(mesh, rays):
    scene = EmbreeScene(EmbreeDevice())
    TriangleMesh(scene, *mesh)
    TriangleMesh(scene, mesh[0][mesh[1]] * 0.5)
    both = bth.compile((np.concatenate([mesh[0], mesh[0] * 0.5]), np.concatenate([mesh[1], mesh[1] + len(mesh[0])])))
    hits = both.nearest(*rays)
    out = scene.run(*rays, output=1)
    assert (out["primID"] == np.where(hits.hit, hits.triangle.astype(int) % len(mesh[1]), -1)).all()
    assert (out["geomID"] == np.where(hits.hit, hits.triangle.astype(int) // len(mesh[1]), -1)).all()
    assert (out["tfar"] == np.where(hits.hit, hits.t, np.float32(1e37))).all()
    assert not out["Ng"][~hits.hit].any() and not out["u"][~hits.hit].any()
    assert (scene.run(*rays) == out["primID"]).all()
    assert (scene.run(*rays, query="DISTANCE") == out["tfar"]).all()
    assert ((scene.run(*rays, query="OCCLUDED") >= 0) == hits.hit).all()
    assert (scene.run(*rays, dists=0.01, query="OCCLUDED") >= 0).sum() < hits.hit.sum()
    with pytest.raises(ValueError):
        scene.run(*rays, query="COLOUR")


# embreex publishes its tests only in its repository, so `python/upstream/run` runs them only where somebody put them. These are the cases
# of theirs, in our words: a square across the x axis, a tetrahedron and a box, three rays that hit and one that does not.
SQUARE = np.array([[7, -1, -1], [7, 1, -1], [7, -1, 1], [7, 1, 1]], np.float32)
HALVES = np.array([[0, 1, 2], [1, 3, 2]], np.uint32)
BOX = np.array([[1, 0, 0], [1, 1, 0], [0, 1, 0], [0, 0, 0], [1, 0, 1], [1, 1, 1], [0, 1, 1], [0, 0, 1]], np.float32)
CORNER = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]], np.float32)


def along_x(*starts):
    origins = np.array(starts, np.float32)
    return origins, np.broadcast_to(np.float32([1, 0, 0]), origins.shape)


FOUR = along_x([0.1, -0.2, 0], [0.1, 0.2, 0], [0.1, 0.3, 0], [0.1, -8.2, 0])


def square(indexed, device=None):
    scene = EmbreeScene(device)
    TriangleMesh(scene, SQUARE, HALVES) if indexed else TriangleMesh(scene, SQUARE[HALVES])
    return scene


@pytest.mark.parametrize("indexed", [False, True])
def test_embreex_square(indexed):
    device = EmbreeDevice()
    assert str(device)
    square(indexed, device)
    scene = square(indexed, device)
    assert scene.run(*FOUR).tolist() == [0, 1, 1, -1]
    assert scene.run(*FOUR, query="DISTANCE") == pytest.approx([6.9, 6.9, 6.9, 1e37])
    occluded = scene.run(*FOUR, query="OCCLUDED")
    assert (occluded[:3] >= 0).all() and occluded[3] == -1
    out = scene.run(*FOUR, output=1, dists=100)
    assert out["geomID"].tolist() == [0, 0, 0, -1] and out["primID"].tolist() == [0, 1, 1, -1]
    assert out["tfar"] == pytest.approx([6.9, 6.9, 6.9, 100])
    assert out["u"] == pytest.approx([0.4, 0.1, 0.15, 0]) and out["v"] == pytest.approx([0.5, 0.4, 0.35, 0])
    assert not out["Ng"][3].any() and out["Ng"][:3].any(axis=1).all()


def test_embreex_answers_do_not_depend_on_the_order_of_rays():
    order = np.array([3, 0, 3, 1, 3, 2, 3])
    scene = square(False)
    straight, mixed = scene.run(*FOUR, output=1), scene.run(FOUR[0][order], FOUR[1][order], output=1)
    for key in ("primID", "geomID", "u", "v", "tfar", "Ng"):
        np.testing.assert_array_equal(straight[key][order], mixed[key])


@pytest.mark.parametrize("corners, starts, faces, u, v", [
    (CORNER, ([-0.1, 0.1, 0.1], [-0.1, 0.2, 0.2]), 4, [0.1, 0.2], [0.1, 0.2]),
    (BOX, ([-0.1, 0.9, 0.1], [-0.1, 0.8, 0.2]), 12, [0.1, 0.2], [0.8, 0.6]),
])
def test_embreex_hits_of_elements(corners, starts, faces, u, v):
    scene = EmbreeScene(EmbreeDevice())
    ElementMesh(scene, corners, np.arange(len(corners), dtype=np.uint32)[None])
    primitives = scene.run(*along_x(*starts))
    assert primitives[0] == primitives[1] and 0 <= primitives[0] < faces
    out = scene.run(*along_x(*starts), output=1)
    assert out["geomID"].tolist() == [0, 0] and (out["primID"] == primitives).all()
    assert out["tfar"] == pytest.approx([0.1, 0.1])
    assert out["u"] == pytest.approx(u) and out["v"] == pytest.approx(v)


@pytest.mark.parametrize("corners, element", [
    ([(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1)], [0, 1, 2, 3]),
    ([(1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0, 0), (1, 0, 1), (1, 1, 1), (0, 1, 1), (0, 0, 1)], list(range(8))),
])
def test_embreex_elements_are_closed(corners, element):
    scene = EmbreeScene()
    ElementMesh(scene, np.array(corners, np.float32), np.array([element]))
    compiled, _ = scene._assembly.scene()
    assert compiled.contains([[0.1, 0.1, 0.1], [-0.1, 0.1, 0.1], [0.1, 0.1, 1.5]]).tolist() == [True, False, False]
    assert scene.run(np.array([[-0.1, 0.1, 0.2]]), np.array([[1.0, 0, 0]]), query="DISTANCE") == pytest.approx(0.1)


def test_open3d(mesh, rays):
    scene = RaycastingScene()
    assert scene.add_triangles(*mesh) == 0 and scene.add_triangles((mesh[0] + [5, 0, 0], mesh[1])) == 1
    named = RaycastingScene()
    assert named.add_triangles(vertex_positions=mesh[0], triangle_indices=mesh[1]) == 0 and named.add_triangles(mesh=mesh) == 1
    for wrong in ({}, {"mesh": mesh, "vertex_positions": mesh[0]}):
        with pytest.raises(TypeError):
            named.add_triangles(**wrong)
    packed = np.concatenate(rays, axis=-1).reshape(20, 20, 6)
    single = bth.compile((np.concatenate([mesh[0], mesh[0] + np.float32([5, 0, 0])]), np.concatenate([mesh[1], mesh[1] + len(mesh[0])])))
    hits, out = single.nearest(*rays), scene.cast_rays(packed)
    assert out["t_hit"].shape == (20, 20) and (out["t_hit"].ravel() == hits.t).all()
    assert (out["geometry_ids"].ravel() == np.where(hits.hit, hits.triangle // len(mesh[1]), scene.INVALID_ID)).all()
    assert (out["primitive_ids"].ravel() == np.where(hits.hit, hits.triangle % len(mesh[1]), scene.INVALID_ID)).all()
    assert out["primitive_normals"].shape == (20, 20, 3) and out["primitive_uvs"].shape == (20, 20, 2)
    assert (scene.test_occlusions(packed).ravel() == hits.hit).all()
    listed = scene.list_intersections(packed)
    assert (np.diff(listed["ray_splits"]) == scene.count_intersections(packed).ravel()).all()
    points = np.array([[0, 0, 0], [5, 0, 0], [2.5, 0, 0]], np.float32)
    assert scene.compute_occupancy(points).tolist() == [1, 1, 0]
    assert (np.sign(scene.compute_signed_distance(points)) == [-1, -1, 1]).all()
    assert (np.abs(scene.compute_signed_distance(points)) == scene.compute_distance(points)).all()
    assert scene.compute_closest_points(points)["points"].shape == (3, 3)
    with pytest.raises(ValueError):
        scene.cast_rays(np.zeros((4, 3)))
    with pytest.raises(ValueError):
        scene.compute_occupancy(points, nsamples=2)


def test_open3d_ranges():
    scene, ray = RaycastingScene(), np.array([[0.2, 0.2, 2, 0, 0, -1]], np.float32)
    scene.add_triangles(CORNER[:3], np.array([[0, 1, 2]]))
    assert [scene.test_occlusions(ray, *ends).item() for ends in [(0, 3), (0, 1), (2.5, 3), (2, 2)]] == [True, False, False, True]
    assert scene.compute_occupancy(ray[:, :3]).dtype == np.float32


def test_meshes_are_those_of_the_call():
    """A buffer that is used for one mesh after the other, as Embree and Open3D allow."""
    corners, face = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0]], np.float32), np.array([[0, 1, 2]], np.uint32)
    embree, open3d, down = EmbreeScene(), RaycastingScene(), np.array([[0.2, 0.2, 9, 0, 0, -1]], np.float32)
    for height in (0, 5, 7):
        corners[:, 2] = height
        TriangleMesh(embree, corners, face)
        TriangleMesh(embree, corners[face])
        open3d.add_triangles(corners, face)
    corners[:], face[:] = 0, 99
    assert open3d.list_intersections(down)["t_hit"].tolist() == [2, 4, 9]
    assert embree.run(down[:, :3], down[:, 3:], query="DISTANCE").tolist() == [2]


def test_open3d_camera():
    rays = RaycastingScene.create_rays_pinhole(fov_deg=60, center=[0, 0, 0], eye=[0, 0, 4], up=[0, 1, 0], width_px=8, height_px=4)
    assert rays.shape == (4, 8, 6) and rays.dtype == np.float32
    np.testing.assert_allclose(rays[..., :3], np.broadcast_to([0, 0, 4], (4, 8, 3)), atol=1e-6)
    np.testing.assert_allclose(rays[..., 5], -1, atol=1e-6)
    # Columns go left, rows go up, as in Open3D; half a pixel from the border is seen under nearly half of the angle.
    np.testing.assert_allclose(rays[0, :, 3], (3.5 - np.arange(8)) / 4 * np.tan(np.pi / 6), atol=1e-6)
    np.testing.assert_allclose(rays[:, 0, 4], (np.arange(4) - 1.5) / 4 * np.tan(np.pi / 6), atol=1e-6)
    # The first and the last ray of Open3D 0.20.
    askew = {"fov_deg": 75, "center": [0.3, -2, 1], "eye": [1, 2, 4], "up": [0.2, -1, 0.4], "width_px": 5, "height_px": 7}
    expected = [[1, 2, 4, -0.982773, -0.274244, -1.087949], [1, 2, 4, 0.705477, -1.310303, -0.100461]]
    np.testing.assert_allclose(RaycastingScene.create_rays_pinhole(**askew)[[0, -1], [0, -1]], expected, rtol=1e-5)
    by_place = RaycastingScene.create_rays_pinhole(75, [0.3, -2, 1], [1, 2, 4], [0.2, -1, 0.4], 5, 7)
    assert (by_place == RaycastingScene.create_rays_pinhole(**askew)).all()
    intrinsic = [[1, 0, 0], [0, 1, 0], [0, 0, 1]]
    assert RaycastingScene.create_rays_pinhole(intrinsic, np.eye(4), 2, height_px=1).tolist() == [[[0, 0, 0, 0.5, 0.5, 1], [0, 0, 0, 1.5, 0.5, 1]]]
    with pytest.raises(TypeError):
        RaycastingScene.create_rays_pinhole(intrinsic, np.eye(4), 2)
    for center, up in [([0, 0, 0], [0, 0, 1]), ([0.1, 0.2, 4.3], [-1, -2, -3]), ([0, 0, 4], [0, 1, 0]), ([0, 0, 0], [0, 0, 0])]:
        with pytest.raises(ValueError, match="up: expected"):
            RaycastingScene.create_rays_pinhole(fov_deg=60, center=center, eye=[0, 0, 4], up=up, width_px=8, height_px=4)


# Open3D's tests of its class (test_raycasting_scene.py) run by `python/upstream/run` where open3d is installed. Their cases, in our words.
SLANT = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0]], np.float32)
CUBE = np.array([[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)], np.float64)
SIDES = np.array([
    [0, 1, 3], [0, 3, 2], [4, 6, 7], [4, 7, 5], [0, 4, 5], [0, 5, 1], [2, 3, 7], [2, 7, 6], [0, 2, 6], [0, 6, 4], [1, 5, 7], [1, 7, 3],
])


class Foreign:
    """A tensor of another package on another device, with no more than what the drop-in may use."""

    device = "elsewhere"

    def __init__(self, array, here=False):
        self._array, self._here = np.asarray(array), here

    @classmethod
    def from_numpy(cls, array):
        assert type(array) is np.ndarray and array.flags.c_contiguous
        return cls(array, True)

    def to(self, device):
        return Foreign(self._array, device == "here")

    def cpu(self):
        return self.to("here")

    def numpy(self):
        assert self._here, "a tensor that has not been fetched"
        return self._array

    def __array__(self, *_):
        raise TypeError("no implicit conversion")


class Packed:
    """A tensor that has nothing but DLPack."""

    def __init__(self, array):
        self.__dlpack__, self.__dlpack_device__ = array.__dlpack__, array.__dlpack_device__


def tensor(rows):
    return Foreign(np.array(rows, np.float32))


def open3d_scene(*meshes):
    scene = RaycastingScene(device="elsewhere")
    assert [scene.add_triangles(*mesh) for mesh in meshes] == list(range(len(meshes)))
    return scene


def test_open3d_tensors_of_hits():
    scene = open3d_scene([Foreign(SLANT), Foreign(np.array([[0, 1, 2]], np.uint32))])
    rays = tensor([[0.2, 0.1, 1, 0, 0, -1], [10, 10, 10, 1, 0, 0]])
    hits = scene.cast_rays(rays)
    assert all(isinstance(part, Foreign) and not part._here for part in hits.values())
    assert hits["geometry_ids"].cpu().numpy().tolist() == [0, scene.INVALID_ID] and hits["t_hit"].cpu().numpy().tolist() == [1, np.inf]
    occluded = lambda **ends: scene.test_occlusions(rays, **ends).cpu().numpy().tolist()
    assert occluded() == [True, False] and occluded(tfar=0.5) == occluded(tnear=1.5) == [False, False]
    packed = scene.cast_rays(Packed(np.array([[0.2, 0.1, 1, 0, 0, -1]])))["t_hit"]
    assert packed.numpy().tolist() == packed.cpu().clone().tolist() == [1] and packed[0].item() == 1 and packed.isfinite().all()
    assert packed[0].cpu().numpy().shape == () and not packed.isinf().any() and not packed.isnan().any()


def test_open3d_counts_and_lists():
    mesh = SimpleNamespace(vertex={"positions": Foreign(CUBE)}, triangle={"indices": Foreign(SIDES)})
    legacy = SimpleNamespace(vertices=CUBE, triangles=SIDES)
    # Through the diagonals of sides, where two triangles are hit.
    rays = tensor([[0.5, 0.5, -1, 0, 0, 1], [0.5, 0.5, 0.5, 0, 0, 1], [10, 10, 10, 1, 0, 0]])
    for scene in (open3d_scene([mesh]), open3d_scene([legacy]), open3d_scene([Foreign(CUBE), Foreign(SIDES)])):
        assert scene.count_intersections(rays).cpu().numpy().tolist() == [2, 1, 0]
        np.testing.assert_allclose(scene.list_intersections(rays)["t_hit"].cpu().numpy(), [1, 2, 0.5], rtol=1e-6)


def test_open3d_counts_each_surface_and_side():
    scene = open3d_scene([CUBE, SIDES], [CUBE, SIDES], [SLANT, [[0, 1, 2], [0, 2, 1]]])
    found = scene.list_intersections([[0.25, 0.25, -1, 0, 0, 1]])
    assert found["t_hit"].tolist() == [1] * 4 + [2] * 2 and sorted(found["geometry_ids"][:4].tolist()) == [0, 1, 2, 2]
    assert found["geometry_ids"][4:].tolist() == [0, 1] and found["ray_splits"].tolist() == [0, 6]


def test_open3d_points():
    scene = open3d_scene([SLANT, [[0, 1, 2]]])
    closest = scene.compute_closest_points(tensor([[0.2, 0.1, 1], [10, 10, 10]]))
    for name in ("geometry_ids", "primitive_ids"):
        assert closest[name].cpu().numpy().tolist() == [0, 0]
    np.testing.assert_allclose(closest["points"].cpu().numpy(), [[0.2, 0.1, 0], [1, 1, 0]], rtol=1e-6)
    cube, points = open3d_scene([CUBE, SIDES]), tensor([[0.5, 0.5, 0.5], [-0.5, -0.5, -0.5], [0, 0, 0]])
    np.testing.assert_allclose(cube.compute_distance(points).cpu().numpy(), [0.5, np.sqrt(0.75), 0])
    np.testing.assert_allclose(cube.compute_signed_distance(points).cpu().numpy(), [-0.5, np.sqrt(0.75), 0])
    assert cube.compute_occupancy(points).cpu().numpy().tolist()[:2] == [1, 0]


@pytest.mark.parametrize("shape", [(11,), (1, 2, 3), (32, 14)])
def test_open3d_shapes(shape):
    scene, random = open3d_scene([CUBE, SIDES]), np.random.default_rng(1)
    rays, points = (random.uniform(size=(*shape, count)).astype(np.float32) for count in (6, 3))
    for found in (scene.count_intersections(rays), scene.compute_distance(points), scene.compute_signed_distance(points), scene.compute_occupancy(points)):
        assert found.shape == shape
    last = {"primitive_uvs": (2,), "primitive_normals": (3,), "points": (3,)}
    for name, part in [*scene.cast_rays(rays).items(), *scene.compute_closest_points(points).items()]:
        assert part.shape == (*shape, *last.get(name, ())), name
    total = int(scene.count_intersections(rays).numpy().sum())
    for name, part in scene.list_intersections(rays).items():
        assert part.shape == ((np.prod(shape) + 1,) if name == "ray_splits" else (total, *last.get(name, ()))), name


def test_open3d_occupancy_next_to_vertices(mesh):
    """Points whose rays along the axes meet vertices and edges of a sphere."""
    scene = open3d_scene([mesh[0] * np.float32(0.8), mesh[1]])
    axis = np.linspace(-0.88, 0.88, 6)
    points = np.stack(np.meshgrid(axis, axis, axis), axis=-1)
    radius = np.linalg.norm(points, axis=-1)
    inside = scene.compute_occupancy(points)
    assert inside[radius < 0.75].all() and not inside[radius > 0.8].any()


def test_open3d_many_rays():
    scene, random = open3d_scene([CUBE, SIDES]), np.random.default_rng(2)
    rays = tensor(random.uniform(size=(200_000, 6)))
    hits, count = scene.cast_rays(rays), scene.count_intersections(rays).cpu().numpy()
    assert ((count > 0) == scene.test_occlusions(rays).cpu().numpy()).all() and count.all()
    assert np.isfinite(hits["t_hit"].cpu().numpy()).all() and len(scene.list_intersections(rays)["t_hit"].cpu().numpy()) == count.sum()


def test_modules_are_attributes():
    code = """
        import sys, bth
        assert not {"bth.open3d", "bth.embreex", "bth.trimesh", "bth.bake"} & set(sys.modules)
        assert {"bake", "embreex", "open3d"} <= set(dir(bth))
        assert bth.open3d.RaycastingScene and bth.embreex.rtcore_scene.EmbreeScene and bth.bake.sdf
        assert "trimesh" not in dir(bth) or bth.trimesh.RayMeshIntersector
        try: bth.embree
        except AttributeError as error: assert "embree" in str(error)
        else: sys.exit("no error")
        sys.modules["trimesh"] = None
        for name in [name for name in sys.modules if name.startswith("bth.trimesh")]: del sys.modules[name]
        vars(bth).pop("trimesh", None)
        try: bth.trimesh
        except ImportError as error: assert "pip install trimesh" in str(error)
        else: sys.exit("no error")
    """
    assert exits(code) == 0
