"""What hits lead to: normals, texture coordinates, groups, materials and names, against plain numpy."""

import copy
import pickle

import models
import numpy as np
import pytest

import bth

PARTS = models.parts()


@pytest.fixture(scope="module")
def path(tmp_path_factory):
    path = tmp_path_factory.mktemp("surface") / "parts.obj"
    models.write_obj(path, *PARTS)
    return path


@pytest.fixture(scope="module")
def kept(path):
    return bth.compile(path, attributes="all", names=True)


@pytest.fixture(scope="module")
def bare(path):
    return bth.compile(path)


@pytest.fixture(scope="module")
def aimed():
    """Rays at random points of the triangles."""
    random = np.random.default_rng(4)
    weights = random.dirichlet([1, 1, 1], len(PARTS[0]))
    targets = np.einsum("nk,nkd->nd", weights, PARTS[0])
    origins = targets + random.normal(size=targets.shape)
    return origins.astype(np.float32), (targets - origins).astype(np.float32)


def _unit(vectors):
    return vectors / np.linalg.norm(vectors, axis=-1, keepdims=True)


def _check(found, names, kept):
    """`found`: Hits, AllHits or Closest, all of whose rows are on a triangle."""
    corners, normals, texcoords, parts = (p[found.triangle] for p in (*PARTS[:3], np.array(PARTS[3], object)))
    u, v = found.u.astype(float)[:, None], found.v.astype(float)[:, None]
    at = lambda values: (1 - u - v) * values[:, 0] + u * values[:, 1] + v * values[:, 2]
    a, b, c = (corners[:, k].astype(float) for k in range(3))
    geometric = _unit(np.cross(b - a, c - a))
    np.testing.assert_allclose(found.normal, geometric, atol=1e-12)
    surface = found.surface()
    np.testing.assert_allclose(surface.position, at(corners), atol=1e-6)
    assert (surface.position == surface.object_position).all() and (surface.geometric_normal == found.normal).all()
    assert (surface.group == found.group).all() and (surface.material == found.material).all()
    assert found.texcoord.dtype == np.float32 and found.shading_normal.dtype == np.float64
    if kept:
        np.testing.assert_allclose(found.shading_normal, _unit(at(normals)), atol=1e-12)
        np.testing.assert_allclose(found.texcoord, at(texcoords), atol=1e-6)
        assert found.group_name.tolist() == parts[:, 0].tolist()
        assert found.material_name.tolist() == parts[:, 1].tolist()
    else:
        assert (found.shading_normal == found.normal).all() and np.isnan(found.texcoord).all()
        assert not found.group.any() and (found.material == bth.NONE).all()
        assert found.group_name.tolist() == found.material_name.tolist() == [""] * len(found)
    assert (found.object == 0).all() and not found.opacity.any()


@pytest.mark.parametrize("name", ["kept", "bare"])
def test_surface(name, aimed, request):
    scene = request.getfixturevalue(name)
    hits, every = scene.nearest(*aimed), scene.all_hits(*aimed)
    assert hits.hit.all() and len(every) > len(hits)
    random = np.random.default_rng(8).normal(size=(100, 3)) * 2
    for found in (hits, every, scene.closest(random)):
        _check(found, name, name == "kept")


def test_misses(kept):
    hits = kept.nearest([[100.0, 0, 0], [0, 0, 100]], [1, 0, 0])
    assert not hits.hit.any()
    for field in ("normal", "shading_normal"):
        assert (getattr(hits, field) == 0).all()
    for field in ("object", "group", "material"):
        assert getattr(hits, field).tolist() == [bth.NONE] * 2
    assert np.isnan(hits.texcoord).all() and np.isnan(hits.surface().position).all()
    assert hits.group_name.tolist() == hits.object_name.tolist() == ["", ""] and hits.opacity.tolist() == [0, 0]


def test_shapes(kept, aimed):
    hits = kept.nearest(*(a[:60].reshape(3, 4, 5, 3) for a in aimed))
    flat = kept.nearest(*aimed)
    for field, shape in (("normal", (3,)), ("shading_normal", (3,)), ("texcoord", (2,)), ("group", ()), ("position", (3,)), ("group_name", ())):
        values = getattr(hits, field)
        assert values.shape == (3, 4, 5, *shape)
        assert (values.reshape(-1, *shape) == getattr(flat, field)).all()
    single = kept.nearest(aimed[0][0], aimed[1][0])
    assert single.normal.shape == (3,) and single.group_name == flat.group_name[0] and single.position.shape == (3,)
    assert kept.surface(0, [[1, 2], [3, 4]], 0.25).texcoord.shape == (2, 2, 2)
    backwards = kept.surface(flat.instance[::-1], flat.triangle[::-1], flat.u[::-1], flat.v[::-1])
    assert (backwards.shading_normal == flat.shading_normal[::-1]).all()


def test_triangle_positions(kept):
    triangles = np.arange(len(PARTS[0]))
    assert (kept.triangle_positions(0, triangles) == PARTS[0]).all()
    corners = kept.triangle_positions(np.array([[0, bth.NONE]]), np.array([[3, bth.NONE]]))
    assert corners.shape == (1, 2, 3, 3) and np.isnan(corners[0, 1]).all() and (corners[0, 0] == PARTS[0][3]).all()


def test_names(kept, bare):
    groups = [(name, kept.material_names()[m]) for name, m in zip(kept.group_names(), kept.group_materials())]
    assert groups == list(dict.fromkeys(PARTS[3]))
    assert bare.group_names() == [""] and bare.material_names() == [] and bare.group_materials() == [None]
    assert kept.object_names == kept.instance_names == [""]
    for wrong in (kept.group_names, kept.material_names, kept.group_materials, kept.group_masks, kept.object_bounds, kept.instance_bounds):
        with pytest.raises(IndexError, match="of 1"):
            wrong(1)
        for index in (-1, 1 << 32):
            with pytest.raises(IndexError, match="from 0"):
                wrong(index)
        with pytest.raises(TypeError):
            wrong("first")


def test_without_geometry(path, aimed):
    whole = bth.compile(path, names=True)
    scene = bth.compile(path, geometry=False, names=True)
    hits, of_whole = scene.nearest(*aimed), whole.nearest(*aimed)
    assert hits.group_name[0] == PARTS[3][hits.triangle[0]][0]
    # The corners of triangles are read from their leaves.
    np.testing.assert_array_equal(hits.normal, of_whole.normal)
    np.testing.assert_array_equal(hits.surface().position, of_whole.surface().position)
    np.testing.assert_array_equal(scene.triangle_positions(0, 0), whole.triangle_positions(0, 0))
    with pytest.raises(LookupError, match="geometry"):
        scene.vertices()


def test_triangles_that_do_not_exist(kept):
    hits = kept.nearest([0, 0, 9], [[0, 0, -1]])
    for instance, triangle, error in (
        (0, 10**6, IndexError), (1, 0, IndexError), (bth.NONE, 0, IndexError), (0, bth.NONE, IndexError), (0, -1, IndexError),
        (0, 2**40, IndexError), (0.0, 0, TypeError), ("x", 0, TypeError), ([0, 0], [0, 0, 0], ValueError),
    ):
        with pytest.raises(error):
            kept.surface(instance, triangle)
        with pytest.raises(error):
            kept.triangle_positions(instance, triangle)
    hits.triangle = np.array([77], np.uint32)
    for field in ("normal", "group", "opacity", "group_name"):
        with pytest.raises(IndexError, match="77 of 60"):
            getattr(hits, field)
    with pytest.raises(TypeError, match="u:"):
        kept.surface(0, 0, "half")


def test_results_are_pickled_with_their_scene(kept, aimed):
    hits, every = kept.nearest(*aimed), kept.all_hits(*aimed)
    for change in (copy.copy, copy.deepcopy, lambda x: pickle.loads(pickle.dumps(x))):
        assert (change(hits).shading_normal == hits.shading_normal).all() and (change(hits).position == hits.position).all()
        assert (change(every).group_name == every.group_name).all()


def test_features_of_closest_points():
    scene = bth.compile(([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]]))
    points = [[0.2, 0.2, 1], [0.5, -1, 0], [1, 1, 0], [-1, 0.5, 0], [-1, -1, 0], [2, 0, 0], [0, 2, 0], [np.nan, 0, 0]]
    assert scene.closest(points).feature.tolist() == [0, 1, 2, 3, 4, 5, 6, 0]
