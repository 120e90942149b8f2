"""Masks, culling, filters and holes: what rays may hit."""

import copy
import pickle

import models
import numpy as np
import pytest

import bth

PARTS = models.parts(count=120, seed=9)


@pytest.fixture
def grouped(tmp_path):
    """A scene whose masks a test may change."""
    models.write_obj(tmp_path / "parts.obj", *PARTS)
    return bth.compile(tmp_path / "parts.obj", names=True)


@pytest.fixture(scope="module")
def aimed():
    random = np.random.default_rng(2)
    origins = random.normal(size=(300, 3)) * 6
    return origins.astype(np.float32), (random.normal(size=(300, 3)) * 2 - origins).astype(np.float32)


def _equal_to(found, everything, keep, scene, rays, **conditions):
    """Checks all queries under conditions against the hits that `keep`, an array of bool, leaves of all."""
    assert (found.triangle == everything.triangle[keep]).all() and (found.t == everything.t[keep]).all()
    rows = everything.ray[keep]
    counts = np.bincount(rows, minlength=len(rays[0]))
    assert (np.diff(found.offsets) == counts).all()
    assert (scene.count(*rays, **conditions) == counts).all()
    assert (scene.any(*rays, **conditions) == (counts > 0)).all()
    first = found.offsets[:-1][counts > 0]
    hits = scene.nearest(*rays, **conditions)
    assert (hits.hit == (counts > 0)).all()
    for name in ("t", "u", "v", "instance", "triangle"):
        assert (getattr(hits, name)[hits.hit] == getattr(found, name)[first]).all()
    two = scene.all_hits(*rays, most=2, **conditions)
    assert (np.diff(two.offsets) == np.minimum(counts, 2)).all()


def test_masks_of_groups(grouped, aimed):
    everything = grouped.all_hits(*aimed)
    groups = np.array(grouped.group_names(), object)
    hidden = groups[everything.group] == "part 2"
    assert 0 < hidden.sum() < len(hidden)
    grouped.set_group_mask("part 2", 0b10)
    assert (grouped.group_masks() == np.where(groups == "part 2", 2, bth.NONE)).all()
    for mask, keep in ((1, ~hidden), (2, ~hidden | hidden), (3, ~hidden | hidden), (0, hidden & ~hidden)):
        _equal_to(grouped.all_hits(*aimed, mask=mask), everything, keep, grouped, aimed, mask=mask)
    grouped.set_group_mask(0, 0)
    gone = everything.group == 0
    # Without a mask of its own a ray has all bits set, and still meets nothing of a group that has none.
    _equal_to(grouped.all_hits(*aimed), everything, ~gone, grouped, aimed)
    grouped.set_group_mask(0, bth.NONE)
    grouped.set_group_mask("part 2", bth.NONE)
    assert (grouped.nearest(*aimed, mask=1).t == grouped.nearest(*aimed).t).all()


def test_masks_of_instances(mesh):
    shift = np.broadcast_to(np.eye(4), (3, 4, 4)).copy()
    shift[:, 0, 3] = [0, 3, 6]
    scene = bth.compile_scene([mesh], [0, 0, 0], shift)
    rays = np.array([[-5.0, 0.01, 0.02]]), np.array([[1.0, 0, 0]])
    instances = lambda **conditions: scene.all_hits(*rays, **conditions).instance.tolist()
    assert instances() == [0, 0, 1, 1, 2, 2]
    scene.set_instance_mask(1, 4)
    scene.set_instance_mask(0, 0)
    assert scene.instance_masks.tolist() == [0, 4, bth.NONE] and scene.instance_masks.dtype == np.uint32
    assert instances() == [1, 1, 2, 2] and instances(mask=4) == [1, 1, 2, 2] and instances(mask=3) == [2, 2]
    assert scene.nearest(*rays, mask=3).instance == 2 and scene.nearest(*rays).instance == 1
    assert scene.any([2.5, 0.01, 0.02], [1, 0, 0], tmax=2) and not scene.any([2.5, 0.01, 0.02], [1, 0, 0], tmax=2, mask=1)
    scene.set_group_mask(0, 8)
    assert instances() == [1, 1, 2, 2] and instances(mask=4) == [] and instances(mask=12) == [1, 1, 2, 2]
    # Points are about the surface itself.
    assert scene.contains([[0, 0, 0]]).all()


def test_masks_are_copied(grouped, aimed):
    grouped.set_group_mask(3, 6)
    grouped.set_instance_mask(0, 2)
    for change in (copy.copy, copy.deepcopy, lambda s: pickle.loads(pickle.dumps(s))):
        other = change(grouped)
        assert (other.group_masks() == grouped.group_masks()).all() and other.instance_masks.tolist() == [2]
        for mask in (1, 2, 4):
            assert (other.nearest(*aimed, mask=mask).t == grouped.nearest(*aimed, mask=mask).t).all()
        other.set_instance_mask(0, 1)
        assert grouped.instance_masks.tolist() == [2]


def test_conditions_hold_for_rays_that_start_on_surfaces(grouped, aimed):
    hits, directions = grouped.nearest(*aimed), aimed[1]
    every = grouped.all_hits(None, directions, start=hits)
    grouped.set_group_mask("part 1", 1)
    groups, seen = every.group, []
    for condition, accepted in (
        ({"mask": 1}, np.ones(len(every), bool)), ({"mask": 2}, np.array(every.group_name) != "part 1"),
        ({"cull": "back"}, np.einsum("ij,ij->i", every.normal, directions[every.ray].astype(float)) < 0),
        ({"filter": lambda candidate: candidate.triangle % 2 == 0}, every.triangle % 2 == 0),
    ):
        found = grouped.all_hits(None, directions, start=hits, **condition)
        assert (found.triangle == every.triangle[accepted]).all() and (found.t == every.t[accepted]).all()
        first = np.full(len(directions), np.inf, np.float32)
        np.minimum.at(first, every.ray[accepted], every.t[accepted])
        assert (grouped.nearest(None, directions, start=hits, **condition).t == first).all()
        assert (grouped.any(None, directions, start=hits, **condition) == np.isfinite(first)).all()
        assert (grouped.count(None, directions, start=hits, **condition) == np.bincount(every.ray[accepted], minlength=len(first))).all()
        seen.append(int(accepted.sum()))
    assert len(set(seen)) > 2 and len(set(groups)) > 1


@pytest.mark.parametrize("call, error", [
    (lambda s: s.set_instance_mask(1, 1), IndexError), (lambda s: s.set_instance_mask(-1, 1), IndexError),
    (lambda s: s.set_instance_mask(0, 1 << 32), ValueError), (lambda s: s.set_instance_mask(0, -1), ValueError),
    (lambda s: s.set_instance_mask("a", 1), TypeError), (lambda s: s.set_instance_mask(0.5, 1), TypeError),
    (lambda s: s.set_group_mask(99, 1), IndexError), (lambda s: s.set_group_mask(-1, 1), IndexError), (lambda s: s.set_group_mask(0, 1, -1), IndexError),
    (lambda s: s.set_group_mask(0, 1, 5), IndexError),
    (lambda s: s.set_group_mask("part 7", 1), LookupError), (lambda s: s.set_group_mask(None, 1), TypeError),
    (lambda s: s.any([0, 0, 0], [0, 0, 1], mask=-1), ValueError), (lambda s: s.any([0, 0, 0], [0, 0, 1], cull="left"), ValueError),
    (lambda s: s.any([0, 0, 0], [0, 0, 1], cull=1), TypeError), (lambda s: s.any([0, 0, 0], [0, 0, 1], filter=3), TypeError),
])
def test_wrong_conditions(grouped, call, error):
    before = grouped.group_masks().tolist()
    with pytest.raises(error):
        call(grouped)
    assert grouped.group_masks().tolist() == before and grouped.instance_masks.tolist() == [bth.NONE]


def test_culling(scene, rays):
    everything = scene.all_hits(*rays)
    front = np.einsum("ij,ij->i", everything.normal, rays[1][everything.ray].astype(float)) < 0
    for cull, keep in (("back", front), ("front", ~front)):
        _equal_to(scene.all_hits(*rays, cull=cull), everything, keep, scene, rays, cull=cull)


def test_filter(scene, rays):
    everything = scene.all_hits(*rays)
    seen = []

    def accepts(candidate):
        assert isinstance(candidate, bth.Candidate) and candidate.opacity == bth.Opacity.OPAQUE
        seen.append((candidate.ray, candidate.triangle, candidate.t, candidate.u, candidate.v, candidate.instance))
        return candidate.triangle % 3 != 0

    found = scene.all_hits(*rays, filter=accepts)
    rows = zip(everything.ray, everything.triangle, everything.t, everything.u, everything.v, everything.instance)
    assert sorted(seen) == sorted((int(r), int(f), float(t), float(u), float(v), int(i)) for r, f, t, u, v, i in rows)
    _equal_to(found, everything, everything.triangle % 3 != 0, scene, rays, filter=lambda c: c.triangle % 3 != 0)
    culled = scene.all_hits(*rays, cull="back").triangle
    assert (scene.all_hits(*rays, cull="back", filter=lambda c: np.bool_(c.u > c.v)).triangle == culled[_wider(scene, rays)]).all()
    assert "triangle" in repr(_first_candidate(scene, rays))


def _wider(scene, rays):
    hits = scene.all_hits(*rays, cull="back")
    return hits.u > hits.v


def _first_candidate(scene, rays):
    kept = []
    scene.any(*rays, filter=lambda candidate: kept.append(candidate) or True)
    return kept[0]


def test_rays_of_filters_count_in_c_order(scene, rays):
    origins, directions = (a.reshape(20, 20, 3) for a in rays)
    wanted = int(np.nonzero(scene.any(*rays))[0][7])
    hits = scene.nearest(origins, directions, filter=lambda candidate: candidate.ray == wanted)
    assert np.nonzero(hits.hit.ravel())[0].tolist() == [wanted]


class Stop(Exception):
    pass


@pytest.mark.parametrize("query", ["nearest", "any", "all_hits", "count"])
def test_filters_that_fail(scene, rays, query):
    called = []

    def fails(candidate):
        called.append(candidate)
        raise Stop("enough")

    origins, directions = (np.tile(a, (30, 1)) for a in rays)
    with pytest.raises(Stop, match="enough"):
        getattr(scene, query)(origins, directions, filter=fails)
    assert len(called) == 1
    with pytest.raises(TypeError, match="None"):
        getattr(scene, query)(*rays, filter=lambda candidate: None)
    with pytest.raises(TypeError):
        getattr(scene, query)(*rays, filter=lambda: True)
    with pytest.raises(ValueError, match="ambiguous"):
        getattr(scene, query)(*rays, filter=lambda candidate: np.array([True, False]))
    with pytest.raises(KeyboardInterrupt):
        getattr(scene, query)(*rays, filter=lambda candidate: (_ for _ in ()).throw(KeyboardInterrupt))
    # The scene is as it was.
    assert scene.any(*rays).any()
    scene.set_instance_mask(0, 2**32 - 1)


def test_filters_may_query_but_not_change(grouped, aimed):
    other = bth.compile(([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]]))
    expected = grouped.nearest(*aimed)

    def accepts(candidate):
        assert grouped.nearest(*aimed, threads=2).hit.any() and grouped.group_names() and other.bounds is not None
        with pytest.raises(RuntimeError, match="filter"):
            grouped.set_instance_mask(0, 0)
        with pytest.raises(RuntimeError, match="filter"):
            grouped.seconds = 1.0
        return True

    hits = grouped.nearest(aimed[0][:20], aimed[1][:20], filter=accepts)
    assert (hits.t == expected.t[:20]).all() and hits.hit.any()


def test_a_filter_may_close_the_scene(scene, rays):
    other = bth.load(scene.to_bytes())

    def closes(candidate):
        other.close()
        return True

    assert (other.nearest(*rays, filter=closes).t == scene.nearest(*rays).t).all()
    with pytest.raises(ValueError, match="closed"):
        other.any(*rays)


def test_holes(tmp_path):
    # Opaque where x < 0.5, a hole where x > 0.5; the wall behind is whole.
    alpha = np.zeros((16, 16), np.uint8)
    alpha[:, :8] = 255
    models.write_leaf(tmp_path / "leaf.gltf", alpha)
    random = np.random.default_rng(1)
    points = random.uniform(0.01, 0.99, (400, 3))
    points[:, 2] = 1
    # Micro-triangles are as wide as some texels; those at the edge are unknown.
    clear = np.abs(points[:, 0] - 0.5) > 0.13
    opaque = bth.compile(tmp_path / "leaf.gltf")
    assert (opaque.nearest(points, [0, 0, -1]).t == 1).all()
    scene = bth.compile(tmp_path / "leaf.gltf", alpha="mask", names=True, attributes="all")
    hits = scene.nearest(points, [0, 0, -1])
    through = points[:, 0] > 0.5
    assert (hits.t[clear] == np.where(through, 2, 1)[clear]).all()
    assert (scene.any(points, [0, 0, -1], tmax=1.5)[clear] == ~through[clear]).all()
    assert (scene.count(points, [0, 0, -1])[clear] == np.where(through, 1, 2)[clear]).all()
    assert (hits.material_name == np.where(hits.t == 1, "holes", "wall")).all() and (hits.object_name == "leaf").all()
    assert scene.instance_names == ["tree"]
    np.testing.assert_allclose(hits.texcoord, points[:, :2], atol=1e-6)
    assert (hits.opacity[clear] == bth.Opacity.OPAQUE).all() and (scene.surface(0, [0, 1], 0.6, 0.2).opacity == bth.Opacity.TRANSPARENT).any()
    # A filter may decide at the edges.
    edge = np.stack([np.linspace(0.35, 0.65, 2001), np.full(2001, 0.31), np.ones(2001)], 1)
    unknown = scene.nearest(edge, [0, 0, -1]).opacity == bth.Opacity.UNKNOWN
    seen = set()
    filtered = scene.nearest(edge, [0, 0, -1], filter=lambda c: seen.add(c.opacity) or c.opacity != bth.Opacity.UNKNOWN)
    assert (filtered.t[unknown] == 2).all() and not (filtered.opacity == bth.Opacity.UNKNOWN).any()
    assert unknown.any() and seen == {bth.Opacity.OPAQUE, bth.Opacity.UNKNOWN}
