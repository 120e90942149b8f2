"""Signed distances on a grid against formulas."""

import numpy as np
import pytest
from conftest import sphere
from test_bake_occlusion import box, grid

import bth
import bth.bake


def points_of(volume):
    return np.stack(np.meshgrid(*(volume.axis(k) for k in range(3)), indexing="ij"), axis=-1)


def test_a_box():
    low, high = np.array([-1.0, 0.5, 2.0]), np.array([2.0, 1.5, 4.0])
    volume = bth.bake.sdf(bth.compile(box(low, high)), 25)
    assert volume.distance.dtype == np.float32 and volume.distance.shape == (25, 11, 18)
    assert volume.spacing == pytest.approx(3.6 / 24)
    np.testing.assert_allclose(volume.origin + volume.spacing * (np.array(volume.distance.shape) - 1) / 2, (low + high) / 2, atol=1e-12)
    outwards = np.abs(points_of(volume).astype(np.float32).astype(float) - (low + high) / 2) - (high - low) / 2
    expected = np.linalg.norm(np.maximum(outwards, 0), axis=-1) + np.minimum(outwards.max(axis=-1), 0)
    np.testing.assert_allclose(volume.distance, expected, rtol=2e-6, atol=1e-6)
    assert (volume.distance < 0).any() and (volume.distance > 0).any()


def test_a_sphere_and_threads():
    scene = bth.compile(sphere(96, 192))
    volume = bth.bake.sdf(scene, 20, margin=0.5, threads=1)
    # The sphere of triangles lies within the true one by 1 - cos(pi / 96) / cos(...) of its radius: 1e-3.
    np.testing.assert_allclose(volume.distance, np.linalg.norm(points_of(volume), axis=-1) - 1, atol=1.1e-3)
    assert (bth.bake.sdf(scene, 20, margin=0.5, threads=4).distance == volume.distance).all()


def test_a_box_of_ones_own():
    scene = bth.compile(sphere())
    volume = bth.bake.sdf(scene, 5, margin=0, box=[[0, 0, 0], [4, 2, 0]])
    assert volume.distance.shape == (5, 3, 2) and volume.spacing == 1
    np.testing.assert_allclose(volume.origin, [0, 0, -0.5])


@pytest.mark.parametrize("options, match", [
    ({"resolution": 1}, "resolution"), ({"resolution": 10**6}, "lower resolution"), ({"margin": -1}, "margin"), ({"margin": np.nan}, "margin"),
    ({"box": [[0, 0, 0], [0, 0, 0]]}, "box"), ({"box": [[1, 0, 0], [0, 1, 1]]}, "box"), ({"box": [0, 1]}, "box"),
])
def test_wrong_options(scene, options, match):
    with pytest.raises(ValueError, match=match):
        bth.bake.sdf(scene, **options)


def test_what_is_closed():
    assert bth.bake.world_mesh(bth.compile(sphere())).closed() and not bth.bake.world_mesh(bth.compile(grid(3, 1.0))).closed()
    # Triangles that share no vertex, as in STL files, in an object that keeps them all.
    vertices, faces = (np.asarray(rows) for rows in sphere())
    corners = vertices[faces].reshape(-1, 3)
    rows = np.arange(len(corners)).reshape(-1, 3)
    assert bth.bake.world_mesh(bth.compile((corners, rows), deformable=True)).closed()
    assert not bth.bake.world_mesh(bth.compile((corners, rows[1:]), deformable=True)).closed()
    with pytest.raises(bth.Error, match="BTH-P001"):
        bth.bake.sdf(bth.compile((np.zeros((0, 3)), np.zeros((0, 3), int))))
