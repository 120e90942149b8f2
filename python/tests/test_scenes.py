"""Scenes of instances, animated scenes, and meshes of other packages."""

import copy
import pickle
import types

import models
import numpy as np
import pytest
from conftest import sphere

import bth

MANIFEST = """
version = 1
frames = { first = 10, last = 30, rate = 10 }
[[objects]]
name = "ball"
model = "ball.obj"
[[nodes]]
name = "mover"
object = "ball"
[[nodes]]
name = "still"
object = "ball"
translation = [0, 10, 0]
[[tracks]]
node = "mover"
property = "translation"
times = [1, 3]
values = [[0, 0, 0], [20, 0, 0]]
[[tracks]]
node = "still"
property = "visible"
times = [1, 2.5]
values = [true, false]
"""


def _matrices(count, seed=1):
    """Matrices that turn, scale, shear and mirror, (n, 4, 4)."""
    random = np.random.default_rng(seed)
    matrices = np.broadcast_to(np.eye(4), (count, 4, 4)).copy()
    matrices[:, :3, :3] = np.eye(3) + random.normal(size=(count, 3, 3)) * 0.2
    matrices[::2, 0] *= -1
    matrices[:, :3, 3] = random.normal(size=(count, 3)) * 5
    return matrices


def test_instances(mesh):
    matrices, tetrahedron = _matrices(7), ([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]], [[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]])
    of = [0, 1, 0, 0, 1, 0, 1]
    scene = bth.compile_scene([mesh, tetrahedron], of, matrices, quality="fast")
    assert (scene.instance_count, scene.object_count) == (7, 2)
    np.testing.assert_allclose(scene.transforms, matrices, atol=1e-12)
    assert scene.triangle_counts[scene.objects_of_instances].tolist() == [len(mesh[1]) if m == 0 else 4 for m in of]
    # Each instance alone: rays, taken to its space, hit the same.
    random = np.random.default_rng(3)
    origins = (random.normal(size=(600, 3)) * 9).astype(np.float32)
    directions = (matrices[random.integers(7, size=600), :3, 3] + random.normal(size=(600, 3)) * 0.3 - origins).astype(np.float32)
    parts = [bth.compile(mesh), bth.compile(tetrahedron)]
    t = np.full((7, 600), np.inf)
    for i, (matrix, part) in enumerate(zip(matrices, of)):
        inverse = np.linalg.inv(matrix)
        t[i] = parts[part].nearest(origins @ inverse[:3, :3].T + inverse[:3, 3], directions @ inverse[:3, :3].T).t
    hits = scene.nearest(origins, directions)
    best = t.min(axis=0)
    sure = np.isfinite(best)
    assert 300 < sure.sum() and (hits.hit[sure] == sure[sure]).mean() > 0.99
    both = sure & hits.hit
    np.testing.assert_allclose(hits.t[both], best[both], rtol=1e-4)
    assert (hits.instance[both] == t.argmin(axis=0)[both]).mean() > 0.99
    # The surface in world space: points lie on the triangles, normals stand on them.
    corners, surface = scene.triangle_positions(hits.instance, hits.triangle)[both], hits.surface()
    np.testing.assert_allclose(surface.position[both], hits.position[both], atol=1e-3)
    for edge in (corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]):
        assert (np.abs(np.einsum("ij,ij->i", hits.normal[both], edge)) < 1e-9).all()
    local = np.einsum("nij,nj->ni", matrices[hits.instance[both]][:, :3, :3], surface.object_position[both]) + matrices[hits.instance[both], :3, 3]
    np.testing.assert_allclose(local, surface.position[both], atol=1e-9)
    lower, upper = zip(*(scene.instance_bounds(i) for i in range(7)))
    np.testing.assert_allclose(scene.bounds, [np.min(lower, axis=0), np.max(upper, axis=0)])
    np.testing.assert_allclose(scene.object_bounds(scene.objects_of_instances[1]), [[0, 0, 0], [1, 1, 1]])


def test_instances_by_default(mesh):
    scene = bth.compile_scene([mesh, ([[9, 0, 0], [10, 0, 0], [9, 1, 0]], [[0, 1, 2]])])
    assert scene.instance_count == 2 and (scene.transforms == np.eye(4)).all()
    assert bth.compile_scene([mesh], [0, 0, 0], np.eye(4)[:3]).object_count == 1
    nothing = bth.compile_scene([], [])
    assert nothing.instance_count == 0 and not nothing.any([0, 0, 0], [0, 0, 1])
    assert bth.compile_scene([mesh, mesh]).object_count == 1


def test_scenes_are_written_and_cached(mesh, tmp_path):
    options = {"cache": tmp_path / "cache", "output": tmp_path / "scene.bth"}
    scene = bth.compile_scene([mesh], [0, 0], _matrices(2), **options)
    assert (tmp_path / "scene.bth").read_bytes() == scene.to_bytes() == bth.compile_scene([mesh], [0, 0], _matrices(2), **options).to_bytes()
    assert bth.compile_scene([mesh], [0, 0], _matrices(2)).content_id == scene.content_id


@pytest.mark.parametrize("arguments, error", [
    (([0], [1]), ValueError), (([0], [-1]), ValueError), (([0], [0.5]), TypeError), (([0], [[0]]), ValueError),
    (([0], [0], np.eye(3)), ValueError), (([0], [0], np.zeros((2, 4, 4))), ValueError), (([0], [0, 0], np.zeros((3, 3, 4))), ValueError),
    (([0], [0], np.ones((4, 4))), ValueError), (([0], [0], np.eye(4) * np.nan), ValueError), (([0], [0], "moved"), TypeError),
    (([0], [0], np.zeros((1, 3, 4))), None), (([0], [0], np.array([np.diag([1.0, 1, 0, 1])])), bth.Error),
    ((3,), TypeError), (([3],), TypeError), ((["ball.obj"],), TypeError), (([0], [0], np.full((3, 4), np.inf)), bth.Error),
])
def test_wrong_instances(mesh, arguments, error):
    arguments = ([mesh if m == 0 else m for m in arguments[0]] if arguments[0] != 3 else 3, *arguments[1:])
    if error is None:
        assert not bth.compile_scene(*arguments).visible.any()
        return
    with pytest.raises(error):
        bth.compile_scene(*arguments)


def test_wrong_options_of_scenes(mesh):
    for options in ({"colour": 1}, {"scene": "x"}, {"model": mesh}):
        with pytest.raises(TypeError, match="unexpected"):
            bth.compile_scene([mesh], **options)
    with pytest.raises(ValueError, match="quality"):
        bth.compile_scene([mesh], quality="superb")
    with pytest.raises(TypeError, match="list of meshes"):
        bth.compile_scene(types.SimpleNamespace(vertices=mesh[0], faces=mesh[1]))


@pytest.fixture
def animated(tmp_path, mesh):
    """A ball that moves along x from second 1 to 3, and one that vanishes at 2.5."""
    lines = [f"v {x} {y} {z}" for x, y, z in mesh[0].tolist()] + [f"f {a + 1} {b + 1} {c + 1}" for a, b, c in mesh[1].tolist()]
    (tmp_path / "ball.obj").write_text("\n".join(lines))
    (tmp_path / "scene.manifest").write_text(MANIFEST)
    return bth.compile(tmp_path / "scene.manifest", names=True)


def test_animated_scenes(animated):
    assert animated.frames == (10, 30, 10.0) and animated.seconds == 1.0
    assert animated.object_names == ["ball"] and animated.instance_names == ["mover", "still"]
    at = lambda x: animated.nearest([x, 0.01, 5], [0, 0, -1])
    for seconds, x in ((1.0, 0.0), (2.0, 10.0), (2.25, 12.5), (3.0, 20.0), (99.0, 20.0), (-5.0, 0.0)):
        animated.seconds = seconds
        assert animated.seconds == seconds and at(x).hit and not at(x + 3).hit
        assert at(x).instance == 0 and animated.transforms[0, 0, 3] == pytest.approx(x)
        assert at(x).position[2] == pytest.approx(1, abs=0.05) and at(x).group_name == ""
        assert animated.visible.tolist() == [True, seconds < 2.5]
    for frame, x in ((10, 0), (15, 5), (30, 20)):
        animated.set_frame(frame)
        assert animated.seconds == frame / 10 and at(x).hit and not at(x + 3).hit
    for wrong, error in ((np.nan, ValueError), (np.inf, ValueError), ("1", TypeError), (None, TypeError)):
        with pytest.raises(error):
            animated.seconds = wrong
    with pytest.raises(TypeError):
        animated.set_frame(1.5)
    with pytest.raises(ValueError):
        animated.set_frame(1 << 40)
    assert animated.seconds == 3.0


def test_hidden_instances(animated):
    hits = animated.nearest([0, 10.01, 5], [0, 0, -1])
    assert hits.instance == 1 and hits.normal[2] > 0.9
    animated.seconds = 3.0
    assert not animated.any([0, 10.01, 5], [0, 0, -1]) and animated.instance_bounds(1) is None
    # Hits are described at the scene's time.
    assert (hits.normal == 0).all() and np.isnan(hits.surface().position).all() and hits.object == 0


@pytest.mark.parametrize("change", [copy.copy, copy.deepcopy, lambda s: pickle.loads(pickle.dumps(s))])
def test_copies_have_the_time(animated, change):
    for seconds in (0.0, 1.0, 2.0):
        animated.seconds = seconds
        other = change(animated)
        assert other.seconds == seconds and (other.transforms == animated.transforms).all()
        other.seconds = 2.5
        assert animated.seconds == seconds


def test_time_of_models(scene):
    assert scene.frames is None and scene.seconds == 0.0


# Meshes of other packages.


def _same(mesh, model):
    assert bth.compile(model).to_bytes() == bth.compile(mesh).to_bytes()


def test_trimesh(mesh):
    trimesh = pytest.importorskip("trimesh")
    _same(mesh, trimesh.Trimesh(*mesh, process=False))
    scene = trimesh.Scene()
    matrices = _matrices(3)
    scene.add_geometry(trimesh.Trimesh(*mesh, process=False), geom_name="ball", node_name="a", transform=matrices[0])
    scene.graph.update("b", geometry="ball", matrix=matrices[1])
    scene.graph.update("c", "a", geometry="ball", matrix=matrices[2])
    compiled = bth.compile(scene)
    assert (compiled.instance_count, compiled.object_count) == (3, 1)
    expected = [matrices[0], matrices[1], matrices[0] @ matrices[2]]
    assert sorted(map(tuple, compiled.transforms.reshape(3, 16).round(9))) == sorted(map(tuple, np.reshape(expected, (3, 16)).round(9)))
    assert sorted(compiled.instance_names) == ["a", "b", "c"] and compiled.object_names == ["ball"]
    for name, matrix in zip("abc", expected):
        row = compiled.instance_names.index(name)
        np.testing.assert_allclose(compiled.transforms[row], matrix, atol=1e-9)
        hits = compiled.nearest(matrix[:3, 3] + [[0, 0, 1e-3], [1e9, 0, 0]], [0, 0, 1], mask=0xFFFFFFFF)
        assert set(hits.instance_name.tolist()) <= {"a", "b", "c", ""} and hits.object_name.tolist() == ["ball", ""]
    named = bth.load(compiled.to_bytes())
    assert named.instance_names == compiled.instance_names and named.object_names == ["ball"]
    with pytest.raises(ValueError, match="flatten"):
        bth.compile(scene, flatten=True)


@pytest.mark.parametrize("names, error", [
    ({"instance_names": ["a"]}, "instance_names: expected 2 str, got 1"), ({"mesh_names": [3]}, "mesh_names: expected 1 str, got 1 of int"),
    ({"mesh_names": ["x" * 4097]}, "at most 4096 bytes"),
])
def test_names_that_do_not_fit(mesh, names, error):
    with pytest.raises(ValueError, match=error):
        bth.compile_scene([mesh], [0, 0], np.eye(4), **names)


def test_meshio(mesh):
    meshio = lambda **cells: types.SimpleNamespace(points=mesh[0].astype(np.float64), cells_dict=cells)
    _same(mesh, meshio(triangle=mesh[1]))
    _same(mesh, meshio(vertex=np.array([[0]]), triangle=mesh[1], line=np.array([[0, 1]])))
    _same((mesh[0], np.concatenate([mesh[1], [[0, 1, 2], [0, 2, 3]]])), meshio(quad=np.array([[0, 1, 2, 3]]), triangle=mesh[1]))
    assert bth.compile(meshio()).triangle_counts.tolist() == [0]
    # A boundary that goes with solids is their surface; solids alone have none.
    _same(mesh, meshio(triangle=mesh[1], tetra=np.array([[0, 1, 2, 3]])))
    for cells in ({"tetra": np.array([[0, 1, 2, 3]])}, {"triangle": mesh[1], "triangle6": np.zeros((1, 6), int)}):
        with pytest.raises(ValueError, match="cells"):
            bth.compile(meshio(**cells))


def test_meshio_itself(mesh, tmp_path):
    meshio = pytest.importorskip("meshio")
    model = meshio.Mesh(mesh[0], [("triangle", mesh[1].astype(np.int64)), ("line", np.array([[0, 1]]))])
    _same(mesh, model)


class PolyData:
    """As those of pyvista: faces are preceded by their numbers of corners."""

    is_all_triangles = True

    def __init__(self, points, faces):
        self.points, self.faces = points, np.concatenate([[len(f), *f] for f in faces])
        self.regular_faces = None

    def triangulate(self):
        rows, at = [], 0
        while at < len(self.faces):
            corners = self.faces[at + 1:at + 1 + self.faces[at]]
            rows += [[corners[0], corners[k], corners[k + 1]] for k in range(1, len(corners) - 1)]
            at += 1 + len(corners)
        return PolyData(self.points, rows)


class Grid:
    """As the grids of pyvista, which have a surface."""

    def __init__(self, surface):
        self._surface = surface

    def extract_surface(self):
        return self._surface


def test_pyvista(mesh):
    _same(mesh, PolyData(*mesh))
    _same(mesh, Grid(PolyData(*mesh)))
    square = [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [0, 0, 1]]
    _same((square, [[0, 1, 2], [0, 2, 3], [0, 1, 4]]), PolyData(np.array(square, float), [[0, 1, 2, 3], [0, 1, 4]]))


def test_pyvista_itself(mesh):
    pyvista = pytest.importorskip("pyvista")
    faces = np.concatenate([np.full((len(mesh[1]), 1), 3), mesh[1]], axis=1)
    _same(mesh, pyvista.PolyData(mesh[0], faces.ravel()))
    box = bth.compile(pyvista.ImageData(dimensions=(3, 3, 3)))
    assert box.contains([[1.1, 1.2, 1.3], [3, 1, 1]]).tolist() == [True, False]


def test_open3d_meshes(mesh):
    _same(mesh, types.SimpleNamespace(vertices=mesh[0].astype(np.float64), triangles=mesh[1].astype(np.int32)))


def test_open3d_meshes_of_tensors(mesh):
    class Tensor:
        """Is no array for numpy until it is asked for one, on the processor."""

        def __init__(self, array, device):
            self._array, self._device = array, device

        def cpu(self):
            return Tensor(self._array, "CPU:0")

        def numpy(self):
            assert self._device == "CPU:0"
            return self._array

    parts = {"positions": Tensor(mesh[0], "CUDA:0")}, {"indices": Tensor(mesh[1].astype(np.int64), "CUDA:0")}
    _same(mesh, types.SimpleNamespace(vertex=parts[0], triangle=parts[1]))
    assert bth.compile(types.SimpleNamespace(vertex={}, triangle={})).triangle_counts.tolist() == [0]


def test_names_in_memory(mesh):
    scene = bth.compile_scene([mesh, sphere(3, 5)], names=True)
    assert scene.instance_names == ["instance 0", "instance 1"] and scene.object_names == ["mesh 0", "mesh 1"]
    assert (scene.nearest([0, 0, 5], [0.01, 0.01, -1]).object_name == "mesh 0").all()


def _twisted(vertices, by):
    """Vertices, turned about the last axis by an angle that grows along it."""
    x, y, z = vertices.T
    sin, cos = np.sin(by * z), np.cos(by * z)
    return np.stack([x * cos - y * sin, x * sin + y * cos, z], axis=1).astype(np.float32)


def test_new_positions(mesh, rays):
    vertices, faces = np.asarray(mesh[0], np.float32), mesh[1]
    scene = bth.compile(mesh, deformable=True)
    assert scene.vertex_count() == len(vertices) and (scene.vertices() == vertices).all()
    for by in (0.5, 2.0):
        moved = _twisted(vertices, by)
        assert scene.set_positions(moved.astype(float)) > 0
        fresh = bth.compile((moved, faces))
        for name in ("t", "u", "v", "triangle"):
            assert getattr(scene.nearest(*rays), name).tobytes() == getattr(fresh.nearest(*rays), name).tobytes()
        assert (scene.vertices() == moved).all() and (scene.bounds == fresh.bounds).all()
        for again in (copy.copy(scene), copy.deepcopy(scene), pickle.loads(pickle.dumps(scene))):
            assert again.nearest(*rays).t.tobytes() == scene.nearest(*rays).t.tobytes()
    # What is refused changes nothing.
    before = scene.nearest(*rays).t.tobytes()
    bad = moved.copy()
    bad[3, 1] = np.nan
    for positions, error, obj in [
        (bad, bth.Error, 0), (moved[1:], bth.Error, 0), (moved * 1e300, bth.Error, 0), (moved[:, :2], ValueError, 0), (moved[None], ValueError, 0),
        (moved[0], ValueError, 0), (["a"], TypeError, 0), (moved, IndexError, 1), (moved, IndexError, -1),
    ]:
        with pytest.raises(error):
            scene.set_positions(positions, obj)
    assert scene.nearest(*rays).t.tobytes() == before
    assert scene.set_positions(np.asfortranarray(vertices)[::1]) == pytest.approx(1)
    for share in (0, 0.3, 1):
        assert scene.set_positions_between(vertices, moved, share) > 0
        assert (scene.vertices() == ((1 - share) * vertices.astype(float) + share * moved.astype(float)).astype(np.float32)).all()
    for given, error in [((vertices, moved, 1.1), bth.Error), ((vertices, moved, np.nan), bth.Error), ((vertices, moved[1:], 1), bth.Error), ((bad, moved, 1), bth.Error), ((vertices, moved[0], 0), ValueError)]:
        with pytest.raises(error):
            scene.set_positions_between(*given)
    assert (scene.vertices() == moved).all()
    still = bth.compile(mesh)
    assert still.vertex_count() is None
    with pytest.raises(bth.Error, match="BTH-S006"):
        still.set_positions(vertices)
    with pytest.raises(bth.Error, match="BTH-L033"):
        bth.compile(mesh, deformable=True, free_directions="all")


def test_new_positions_of_one_object_of_a_scene(mesh):
    vertices = np.asarray(mesh[0], np.float32)
    scene = bth.compile_scene([mesh, (vertices * 2, mesh[1])], [0, 1], [np.eye(4)] * 2, deformable=True)
    boxes = [scene.object_bounds(obj).copy() for obj in (0, 1)]
    scene.set_positions(scene.vertices(1) + 5, 1)
    assert (scene.object_bounds(0) == boxes[0]).all() and (scene.object_bounds(1) == boxes[1] + 5).all()
    assert (pickle.loads(pickle.dumps(scene)).object_bounds(1) == boxes[1] + 5).all()
