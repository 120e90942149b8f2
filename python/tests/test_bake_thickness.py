"""Thickness against closed forms."""

import math

import numpy as np
import pytest
from conftest import sphere
from test_bake_occlusion import box, grid

import bth
import bth.bake


def slab(points=9, width=1000.0, thick=2.0):
    """Two large parallel squares that face away from each other."""
    vertices, faces = grid(points, width, thick)
    return np.concatenate([vertices, vertices - [0, 0, thick]]), np.concatenate([faces, faces[:, ::-1] + len(vertices)])


def middle_of(at):
    return np.nonzero((at.position[:, :2] == 0).all(axis=1))[0]


@pytest.mark.parametrize("angle", [0.0, 20.0, 60.0])
def test_a_slab(angle):
    """At an angle t the length is h / cos t; the cosines are spread evenly from 1 to that of the cone."""
    scene, rays, c = bth.compile(slab()), 4096, math.cos(math.radians(angle))
    at = bth.bake.at_vertices(scene)
    median = bth.bake.thickness(scene, at, rays=rays, angle=angle)[middle_of(at)]
    mean = bth.bake.thickness(scene, at, rays=rays, angle=angle, reduce="mean")[middle_of(at)]
    assert len(median) == 2
    # Evenly spread points have an error of some 1 / rays; that of random ones would be 1 / sqrt(rays).
    np.testing.assert_allclose(median, 2 * 2 / (1 + c), rtol=4e-3)
    np.testing.assert_allclose(mean, 2.0 if angle == 0 else 2 * math.log(1 / c) / (1 - c), rtol=4e-3)


@pytest.mark.parametrize("scale", [1e-12, 1.0, 1e12])
def test_a_sphere(scale):
    """A chord at an angle t to the radius is 2 R cos t, so median and mean are R (1 + cosine of the cone)."""
    vertices, faces = sphere(48, 96)
    scene = bth.compile((vertices * np.float32(scale), faces))
    for reduce in ("median", "mean"):
        values = bth.bake.thickness(scene, rays=1024 if scale == 1 else 256, reduce=reduce)
        # The sphere of triangles is thinner by 1 - cos(pi / 96) at most, and its normals are a little off.
        np.testing.assert_allclose(values / scale, 1.5, rtol=0.01)


def test_the_shape_diameter_of_a_sphere():
    """Lengths 2 cos t with density sin t dt, those within one deviation of the median, weighted by 1 / t: by numerical integration."""
    t = (np.arange(200000) + 0.5) / 200000 * math.pi / 3
    lengths, density = 2 * np.cos(t), np.sin(t)
    mean = np.average(lengths, weights=density)
    deviation = math.sqrt(np.average((lengths - mean) ** 2, weights=density))
    near = np.abs(lengths - 1.5) <= deviation
    expected = np.average(lengths[near], weights=density[near] / t[near])
    values = bth.bake.thickness(bth.compile(sphere(48, 96)), rays=1024, reduce="diameter")
    np.testing.assert_allclose(values, expected, rtol=0.01)


def test_sheets_have_no_thickness():
    scene = bth.compile(grid(5, 2.0))
    assert np.isnan(bth.bake.thickness(scene)).all()
    # Something that faces the sheet from below is a front: the ray was not in a solid.
    vertices, faces = grid(5, 2.0)
    below = bth.compile((np.concatenate([vertices, vertices - [0, 0, 1]]), np.concatenate([faces, faces + len(vertices)])))
    at = bth.bake.at_vertices(below)
    assert np.isnan(bth.bake.thickness(below, at, angle=0)).all()


def test_corners_of_a_box_measure_across_it():
    """Rays from a corner that leave the box through the faces around it do not count; the others cross it."""
    scene = bth.compile(box([0, 0, 0], [1, 1, 1]))
    straight = bth.bake.thickness(scene, rays=1, angle=0)
    np.testing.assert_allclose(straight, math.sqrt(3), rtol=1e-5)
    assert (bth.bake.thickness(scene, rays=512) >= 1).all()


def test_threads_and_wrong_options(scene):
    expected = bth.bake.thickness(scene, threads=1)
    assert (bth.bake.thickness(scene, threads=5) == expected).all()
    for options in ({"rays": 0}, {"angle": 90}, {"angle": -1}, {"angle": math.nan}, {"reduce": "max"}):
        with pytest.raises(ValueError, match=next(iter(options))):
            bth.bake.thickness(scene, **options)


def test_reductions_of_rows_with_gaps():
    from bth.bake._thickness import _reduced

    nan = math.nan
    lengths, cosines = np.array([[3.0, nan, 1.0, nan], [nan] * 4, [5.0, 2.0, 9.0, nan], [4.0, nan, nan, nan]]), np.full((4, 4), 0.8)
    np.testing.assert_array_equal(_reduced(lengths, cosines, "median"), [2.0, nan, 5.0, 4.0])
    np.testing.assert_allclose(_reduced(lengths, cosines, "mean"), [2.0, nan, 16 / 3, 4.0])
    np.testing.assert_allclose(_reduced(lengths, cosines, "diameter"), [2.0, nan, 5.0, 4.0])
