"""Ambient occlusion against closed forms and against a slow integration."""

import math

import numpy as np
import pytest
from conftest import hits_by_force, sphere

import bth
import bth.bake


def grid(points, width, height=0.0):
    """A square of so many points along each side in the plane of this z, facing up."""
    x, y = np.meshgrid(np.linspace(-width / 2, width / 2, points), np.linspace(-width / 2, width / 2, points), indexing="ij")
    corner = (np.arange(points - 1)[:, None] * points + np.arange(points - 1)).reshape(-1)
    faces = np.concatenate([np.stack([corner, corner + points, corner + points + 1], -1), np.stack([corner, corner + points + 1, corner + 1], -1)])
    return np.stack([x, y, np.full_like(x, height)], -1).reshape(-1, 3), faces


def box(low, high):
    """A closed box, counter-clockwise seen from outside."""
    corners = np.array([[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)])
    quads = [[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]]
    faces = np.array([[q[i] for i in t] for q in quads for t in ((0, 1, 2), (0, 2, 3))])
    return np.asarray(low) + corners * (np.asarray(high, float) - low), faces


def strip(points, z, width):
    """A floor in the plane of z with vertices at the given x, width long along y, facing up."""
    n = len(points)
    vertices = np.array([[x, y, z] for y in (-width, 0, width) for x in points])
    at = lambda row, column: row * n + column
    faces = [f for r in range(2) for c in range(n - 1) for f in ([at(r, c), at(r, c + 1), at(r + 1, c + 1)], [at(r, c), at(r + 1, c + 1), at(r + 1, c)])]
    return vertices, np.array(faces)


@pytest.mark.parametrize("scale", [1e-18, 1.0, 1e15])
@pytest.mark.parametrize("shift", [0.0, 1000.0])
def test_nothing_hides_an_open_plane_from_itself(scale, shift):
    vertices, faces = grid(9, 2.0)
    # A rotation, so that no coordinate of the plane has a float32 of its own.
    turn = np.array([[0.36, 0.48, -0.8], [-0.8, 0.6, 0.0], [0.48, 0.64, 0.6]])
    scene = bth.compile(((vertices @ turn.T + shift) * scale, faces))
    # Rounding the vertices of a turned plane makes bumps, which hide a little, the more the farther it is from the origin.
    assert (bth.bake.ambient_occlusion(scene, rays=256) == 1.0).mean() > (0.999 if shift == 0 else 0.5)
    flat = bth.compile(((vertices + shift) * scale, faces))
    assert (bth.bake.ambient_occlusion(flat, rays=256) == 1.0).all()


def test_convex_solids_are_open_and_rooms_are_closed():
    for vertices, faces in (box([-1, -2, 5], [2, 3, 7]), sphere()):
        scene = bth.compile((vertices, faces))
        assert (bth.bake.ambient_occlusion(scene) == 1.0).all()
        assert (bth.bake.ambient_occlusion(scene, side="back") == 0.0).all()
        assert (bth.bake.ambient_occlusion(scene, side="both") == 1.0).all()
        room = bth.compile((vertices, faces[:, ::-1]))
        assert (bth.bake.ambient_occlusion(room) == 0.0).all()


def test_a_wall_hides_what_its_form_factor_says():
    """A wall of height h at the distance d of an endless floor hides (1 - d / sqrt(d^2 + h^2)) / 2: a half at its foot."""
    distances, rays, long = np.array([1e-3, 0.5, 1.0, 2.0, 5.0]), 4096, 1e4
    floor, floor_faces = strip([*distances, 100.0], 0.0, long)
    wall = np.array([[0, -long, 0], [0, long, 0], [0, long, 1], [0, -long, 1]])
    scene = bth.compile((np.concatenate([floor, wall]), np.concatenate([floor_faces, np.array([[0, 1, 2], [0, 2, 3]]) + len(floor)])))
    at = bth.bake.at_vertices(scene)
    openness = bth.bake.ambient_occlusion(scene, at, rays=rays)
    for distance in distances:
        vertex = np.nonzero((at.position == np.float32([distance, 0, 0]).astype(float)).all(axis=1))[0]
        expected = 1 - (1 - distance / math.hypot(distance, 1)) / 2
        standard_error = math.sqrt(expected * (1 - expected) / rays)
        assert abs(openness[vertex[0]] - expected) < 3 * standard_error
    assert bth.bake.ambient_occlusion(scene, at, rays=rays, distance=0.4)[vertex[0]] == 1.0


def test_the_edge_of_two_planes():
    """The normal of the edge halves the right angle, and its hemisphere is open where the angle in the plane across is below 45 degrees."""
    rays = 4096
    vertices = np.array([[x, y, 0] for y in (-1e5, 0, 1e5) for x in (0, 1e5)] + [[0, y, 1e5] for y in (-1e5, 0, 1e5)], float)
    faces = np.array([[0, 1, 3], [0, 3, 2], [2, 3, 5], [2, 5, 4], [0, 2, 7], [0, 7, 6], [2, 4, 8], [2, 8, 7]])
    scene = bth.compile((vertices, faces))
    at = bth.bake.at_vertices(scene)
    edge = int(np.nonzero((at.position == 0).all(axis=1))[0][0])
    np.testing.assert_allclose(at.normal[edge], [math.sqrt(0.5), 0, math.sqrt(0.5)], atol=1e-12)
    value, expected = bth.bake.ambient_occlusion(scene, at, rays=rays)[edge], math.sin(math.pi / 4)
    assert abs(value - expected) < 3 * math.sqrt(expected * (1 - expected) / rays)


def test_against_integration_by_force():
    """A few vertices of random triangles around a sphere, with 2,000 directions of an even grid, each against each triangle in float64."""
    random, rays = np.random.default_rng(3), 1024
    vertices, faces = sphere(6, 8)
    pieces = random.normal(size=(40, 1, 3)) * 1.5 + random.normal(size=(40, 3, 3)) * 0.7
    vertices, faces = np.concatenate([vertices, pieces.reshape(-1, 3)]).astype(np.float32), np.concatenate(
        [faces, len(vertices) + np.arange(120).reshape(-1, 3)]
    )
    scene = bth.compile((vertices, faces))
    at = bth.bake.at_vertices(scene)
    openness = bth.bake.ambient_occlusion(scene, at, rays=rays)
    vertices, faces, above = scene.vertices(), scene.triangles(), at.position + 1e-9 * at.normal
    checked = 0
    for vertex in range(0, len(at), 37):
        normal = at.normal[vertex]
        tangent = np.cross(normal, [1.0, 0, 0] if abs(normal[0]) < 0.7 else [0, 1.0, 0])
        tangent /= np.linalg.norm(tangent)
        bitangent, hidden = np.cross(normal, tangent), 0
        for ring in range(25):
            for sector in range(80):
                height, angle = math.sqrt(1 - (ring + 0.5) / 25), 2 * math.pi * (sector + 0.37) / 80
                flat = math.sqrt(1 - height * height)
                direction = flat * (math.cos(angle) * tangent + math.sin(angle) * bitangent) + height * normal
                hidden += bool(hits_by_force(vertices, faces, above[vertex], direction))
        expected = 1 - hidden / 2000
        checked += 0 < expected < 1
        # The grid's own error is that of the cells that edges of the triangles pass through.
        assert abs(openness[vertex] - expected) < 4 * math.sqrt(0.25 / rays) + 0.01
    assert checked >= 2


def test_the_same_at_any_number_of_threads_and_in_any_order(scene, mesh):
    vertices, faces = mesh
    scene = bth.compile((np.concatenate([vertices, vertices * 1.5 + 1]), np.concatenate([faces, faces + len(vertices)])))
    at = bth.bake.at_vertices(scene)
    expected = bth.bake.ambient_occlusion(scene, at, rays=50, threads=1)
    for threads in (2, 3, 7):
        assert (bth.bake.ambient_occlusion(scene, at, rays=50, threads=threads) == expected).all()
    other = bth.bake.ambient_occlusion(scene, at, rays=50, seed=1)
    assert (other != expected).any() and abs(other.mean() - expected.mean()) < 0.01


def test_progress_and_cancelling(scene):
    calls = []
    bth.bake.ambient_occlusion(scene, rays=4096, progress=lambda *call: calls.append(call))
    count = len(bth.bake.at_vertices(scene))
    assert calls[0] == ("ambient occlusion", 0, count) and calls[-1] == ("ambient occlusion", count, count) and len(calls) > 4

    def cancel(*_):
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        bth.bake.ambient_occlusion(scene, progress=cancel)


@pytest.mark.parametrize("options", [{"rays": 0}, {"distance": 0.0}, {"distance": -1}, {"distance": math.nan}, {"side": "left"}])
def test_wrong_options(scene, options):
    with pytest.raises(ValueError, match=next(iter(options))):
        bth.bake.ambient_occlusion(scene, **options)


def test_models_without_geometry_and_without_area(mesh):
    with pytest.raises(bth.Error, match="no-geometry") as error:
        bth.bake.ambient_occlusion(bth.compile(mesh, geometry=False))
    assert error.value.code == "BTH-P001"
    nothing = bth.compile((np.zeros((0, 3)), np.zeros((0, 3), int)))
    assert bth.bake.ambient_occlusion(nothing).shape == (0,)
    needle = bth.compile(([[0, 0, 0], [1, 0, 0], [2, 0, 0]], [[0, 1, 2]]))
    assert np.isnan(bth.bake.ambient_occlusion(needle)).all()


MANIFEST = """
version = 1
[[objects]]
name = "ball"
model = "ball.ply"
[[nodes]]
object = "ball"
name = "plain"
[[nodes]]
object = "ball"
name = "far and stretched"
translation = [1000.0, 7.0, -3.0]
scale = [10.0, 0.5, 3.0]
rotation = { axis = [1, 2, 3], degrees = 50 }
[[nodes]]
object = "ball"
name = "mirrored"
translation = [-40.0, 0.0, 0.0]
scale = [-2.0, 2.0, 2.0]
"""


def test_instances_do_not_hide_themselves(tmp_path):
    vertices, faces = sphere()
    x, y, z = vertices.T
    bth.bake.write_ply(tmp_path / "ball.ply", {"x": x, "y": y, "z": z}, faces)
    (tmp_path / "scene.manifest").write_text(MANIFEST)
    scene = bth.compile(tmp_path / "scene.manifest")
    at = bth.bake.at_vertices(scene)
    assert len(at) == 3 * len(vertices) and at.mesh.closed()
    middle = scene.transforms[at.instance, :3, 3]
    assert (np.einsum("ij,ij->i", at.normal, at.position - middle) > 0).all()
    openness = bth.bake.ambient_occlusion(scene, at, rays=256)
    # The others are so far away that they hide 0.3 % at most.
    assert openness.min() > 0.98
    corners = at.mesh.vertices[at.mesh.faces]
    outwards = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    assert (np.einsum("ij,ij->i", outwards, corners[:, 0] - scene.transforms[at.mesh.instance, :3, 3]) > 0).all()
