"""Whether surfaces are closed, and the warning where insides are asked of others."""

import warnings

import numpy as np
import pytest
from conftest import sphere

import bth
import bth.bake
from bth.open3d import RaycastingScene

BALL = sphere(6, 8)
OPEN = BALL[0], BALL[1][1:]
POINT = [[0.1, 0.2, 0.3]]
QUERIES = {
    "contains": lambda scene: scene.contains(POINT), "winding": lambda scene: scene.winding(POINT),
    "signed_distance": lambda scene: scene.signed_distance(POINT), "sdf": lambda scene: bth.bake.sdf(scene, 4),
}


def test_of_objects_and_scenes():
    scene = bth.compile_scene([BALL, OPEN], [0, 1, 0], np.eye(4))
    assert [scene.is_object_closed(obj) for obj in range(2)] == [True, False] and scene.is_object_closed(1) is False
    assert scene.is_closed is False
    scene.set_visible(1, False)
    assert scene.is_closed is True
    with pytest.raises(IndexError):
        scene.is_object_closed(2)
    assert bth.compile(BALL, geometry=False).is_closed is None
    assert bth.compile(BALL).is_closed is True and bth.compile(OPEN).is_closed is False


def test_of_new_positions():
    corners = BALL[0][BALL[1]].reshape(-1, 3)
    scene = bth.compile((corners, np.arange(len(corners)).reshape(-1, 3)), deformable=True)
    assert scene.is_closed
    torn = corners.copy()
    torn[:3] *= 2
    scene.set_positions(torn)
    assert not scene.is_closed
    scene.set_positions(corners)
    assert scene.is_closed


@pytest.mark.parametrize("query", QUERIES.values(), ids=QUERIES)
def test_one_warning_for_a_scene(query):
    scene = bth.compile_scene([BALL, OPEN], mesh_names=["ball", "bowl"])
    with pytest.warns(bth.OpenMeshWarning, match=r"object 1 \(bowl\) is not closed") as told:
        query(scene)
    assert len(told) == 1 and issubclass(bth.OpenMeshWarning, UserWarning) and told[0].filename == __file__
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        for other in QUERIES.values():
            other(scene)
        query(bth.compile(BALL))
        query(bth.compile(OPEN, geometry=False)) if query is not QUERIES["sdf"] else None


def test_objects_that_appear_later():
    scene = bth.compile_scene([BALL, OPEN])
    scene.set_visible(1, False)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        scene.contains(POINT)
    scene.set_visible(1)
    with pytest.warns(bth.OpenMeshWarning):
        scene.contains(POINT)


def test_drop_ins_warn():
    scene = RaycastingScene()
    scene.add_triangles(*OPEN)
    with pytest.warns(bth.OpenMeshWarning) as told:
        scene.compute_occupancy(POINT)
    assert told[0].filename == __file__
    trimesh = pytest.importorskip("trimesh")
    with pytest.warns(bth.OpenMeshWarning):
        bth.trimesh.RayMeshIntersector(trimesh.Trimesh(*OPEN)).contains_points(POINT)
