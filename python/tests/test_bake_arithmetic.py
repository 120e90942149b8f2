"""Arithmetic and directions of the bakers against plain mathematics."""

import math

import numpy as np
import pytest

from bth.bake import _arithmetic, _sampling


def test_cosines_sines_and_arctangents():
    shares = np.concatenate([np.linspace(0, 1, 1001), [0.125, 0.375, 0.625, 0.875]])
    x, y = _arithmetic.turn(shares)
    assert max(abs(a - math.cos(2 * math.pi * s)) for a, s in zip(x, shares)) < 1e-15
    assert max(abs(a - math.sin(2 * math.pi * s)) for a, s in zip(y, shares)) < 1e-15
    numbers = np.concatenate([np.linspace(0, 3, 1001), [1e-300, 1e10, np.inf]])
    assert max(abs(a - math.atan(n)) for a, n in zip(_arithmetic.arctangent(numbers), numbers)) < 1e-15


def test_angles_and_unit_vectors():
    random = np.random.default_rng(1)
    a, b = _arithmetic.unit(random.normal(size=(2, 500, 3)) * 10.0 ** random.uniform(-200, 200, (2, 500, 1)))
    np.testing.assert_allclose(np.linalg.norm(a, axis=1), 1, atol=1e-15)
    np.testing.assert_allclose(_arithmetic.angle_between(a, b), [math.acos(max(-1, min(1, x @ y))) for x, y in zip(a, b)], atol=1e-7)
    np.testing.assert_allclose(_arithmetic.angle_between(a, np.stack([a, -a])), [np.zeros(500), np.full(500, np.pi)], atol=1e-7)
    assert not _arithmetic.unit(np.zeros((2, 3))).any()


@pytest.mark.parametrize("normal", [[0.0, 0, 1], [0, 0, -1], [1, 0, 0], [0.6, -0.8, 0], [1e-9, 0, -1]])
def test_directions(normal):
    axis = _arithmetic.unit(np.array([normal]))
    directions = _sampling.hemisphere(axis, 0, np.array([5]), 4096)[0]
    np.testing.assert_allclose(np.linalg.norm(directions, axis=1), 1, atol=1e-14)
    assert (directions @ axis[0] > 0).all()
    # The mean of a density that is proportional to the cosine is two thirds of the normal.
    np.testing.assert_allclose(directions.mean(axis=0), axis[0] * 2 / 3, atol=0.005)
    within, cosine = _sampling.cone(axis, 0.5, 0, np.array([5]), 4096)
    np.testing.assert_allclose(within[0] @ axis[0], cosine[0], atol=1e-14)
    assert cosine.min() >= 0.5 and abs(cosine.mean() - 0.75) < 0.002
    assert (_sampling.cone(axis, 1.0, 0, np.array([5]), 3)[0] == axis[:, None]).all()


def test_points_of_the_square_have_a_low_discrepancy():
    x, y = (a[0] for a in _sampling.squares(3, np.array([8]), 1024))
    corners = np.random.default_rng(2).random((500, 2))
    shares = ((x < corners[:, :1]) & (y < corners[:, 1:])).mean(axis=1)
    # The largest of these errors is some 0.04 for random points.
    assert np.abs(shares - corners.prod(axis=1)).max() < 0.01
    assert (_sampling.squares(4, np.array([8]), 2)[0] != _sampling.squares(3, np.array([8]), 2)[0]).all()
    assert abs(_sampling.uniform(0, np.arange(10000)).mean() - 0.5) < 0.01
