"""Scans of a box against distances of planes."""

import numpy as np
import pytest
from test_bake_occlusion import box

import bth
import bth.bake

LOW, HIGH = np.array([-2.0, -3.0, -1.0]), np.array([4.0, 5.0, 2.5])


@pytest.fixture(scope="module")
def room():
    return bth.compile(box(LOW, HIGH))


def planes(origin, direction):
    """Distance from inside of the box to its side."""
    with np.errstate(divide="ignore"):
        t = np.where(direction > 0, (HIGH - origin) / direction, (LOW - origin) / direction)
    return np.where(direction == 0, np.inf, t).min(axis=-1)


def test_a_room(room):
    position = [0.3, -0.2, 0.1]
    scan = bth.bake.lidar(room, position, elevations=[-30, 0, 10, 80], columns=90)
    assert scan.range.shape == scan.triangle.shape == (1, 90, 4) and scan.hit.all()
    np.testing.assert_allclose(np.linalg.norm(scan.direction, axis=-1), 1, atol=1e-14)
    np.testing.assert_allclose(scan.range, planes(np.array(position), scan.direction), rtol=3e-7)
    np.testing.assert_allclose(scan.point, np.array(position) + scan.range[..., None].astype(float) * scan.direction)
    # Counter-clockwise from x, and beams above each other.
    np.testing.assert_allclose(scan.direction[0, 0, 1], [1, 0, 0], atol=1e-15)
    assert scan.direction[0, 20, 1, 1] > 0.9 and scan.direction[0, 0, 2, 2] == pytest.approx(np.sin(np.deg2rad(10)))


def test_the_range_of_the_scanner(room):
    whole = bth.bake.lidar(room, [0, 0, 0], columns=64)
    part = bth.bake.lidar(room, [0, 0, 0], columns=64, nearest=2.5, farthest=4)
    inside = (whole.range >= 2.5) & (whole.range <= 4)
    assert (part.hit == inside).all() and 0 < inside.sum() < inside.size
    assert np.isinf(part.range[~inside]).all() and np.isnan(part.point[~inside]).all() and (part.triangle[~inside] == bth.NONE).all()


def test_noise(room):
    exact = bth.bake.lidar(room, [0, 0, 0], columns=512)
    noisy = bth.bake.lidar(room, [0, 0, 0], columns=512, noise=0.05, seed=3)
    error = (noisy.range - exact.range).astype(float).ravel()
    # 16,384 errors: their mean and deviation are within five of their own standard errors.
    assert abs(error.mean()) < 5 * 0.05 / 128 and abs(error.std() - 0.05) < 5 * 0.05 / 181 and np.abs(error).max() < 0.3
    assert (bth.bake.lidar(room, [0, 0, 0], columns=512, noise=0.05, seed=3, threads=3).range == noisy.range).all()
    assert (bth.bake.lidar(room, [0, 0, 0], columns=512, noise=0.05, seed=4).range != noisy.range).any()


def test_poses_turn_the_scanner(room):
    pose = np.eye(4)
    pose[:3, :3], pose[:3, 3] = [[0, 0, 1], [1, 0, 0], [0, 1, 0]], [1, 1, 0]
    scan = bth.bake.lidar(room, pose, elevations=[0.0], columns=4)
    np.testing.assert_allclose(scan.direction[0, :, 0], [[0, 1, 0], [0, 0, 1], [0, -1, 0], [0, 0, -1]], atol=1e-15)
    np.testing.assert_allclose(scan.range[0, :, 0], [4, 2.5, 4, 1], rtol=1e-6)


def test_a_scanner_that_moves(room):
    poses = bth.bake.poses_along([[-1, 0, 0], [3, 0, 0], [3, 4, 0]], 2, 64)
    assert poses.shape == (2, 64, 4, 4)
    np.testing.assert_allclose(poses[0, 0, :3, 3], [-1, 0, 0])
    np.testing.assert_allclose(poses[1, 0, :3, 3], [3, 0, 0])
    np.testing.assert_allclose(poses[1, 32, :3, 3], [3, 2, 0])
    np.testing.assert_allclose(poses[1, 32, :3, :3], [[0, -1, 0], [1, 0, 0], [0, 0, 1]], atol=1e-15)
    scan = bth.bake.lidar(room, poses, columns=64)
    np.testing.assert_allclose(scan.range, planes(scan.origin[:, :, None], scan.direction), rtol=1e-6)


@pytest.mark.parametrize("poses, options, match", [
    ([0, 0], {}, "poses"), ([np.nan, 0, 0], {}, "poses"), (np.eye(4) * 2, {}, "scale"), ([0, 0, 0], {"columns": 0}, "columns"),
    ([0, 0, 0], {"elevations": [95]}, "elevations"), ([0, 0, 0], {"noise": -1}, "noise"), ([0, 0, 0], {"nearest": 3, "farthest": 2}, "nearest"),
])
def test_wrong_options(room, poses, options, match):
    with pytest.raises(ValueError, match=match):
        bth.bake.lidar(room, poses, **options)


@pytest.mark.parametrize("path", [[[0, 0, 0]], [[0, 0, 0]] * 2, [[0, 0], [1, 1]], [[0, 0, 0], [np.inf, 0, 0]]])
def test_wrong_paths(path):
    with pytest.raises(ValueError, match="path"):
        bth.bake.poses_along(path, 1, 8)
