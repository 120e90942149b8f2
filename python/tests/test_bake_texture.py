"""Ambient occlusion to textures: which texels a surface covers, where they are on it, and what is written."""

import json

import numpy as np
import pytest

import bth
import bth.bake
from bth.__main__ import main
from bth.bake._texels import dilated

# A square of side 2 in the plane z = 0, facing up, whose texture coordinates fill the texture.
SQUARE = np.array([[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]], float), np.array([[0, 1, 2], [0, 2, 3]])
WHOLE = np.array([[0, 0], [1, 0], [1, 1], [0, 1]], float)[SQUARE[1]]


@pytest.fixture(scope="module")
def square():
    return bth.compile(SQUARE)


@pytest.mark.parametrize("v_up", [True, False])
def test_each_texel_is_at_its_place(square, v_up):
    texels = bth.bake.at_texels(square, 8, 4, WHOLE, v_up=v_up)
    # Neighbouring triangles leave no texel out, also not those whose middle is on the edge between them.
    assert len(texels.points) == 32 and texels.shape == (4, 8) and texels.shared == 0
    y = (texels.rows + 0.5) / 4 * 2 - 1
    expected = np.stack([(texels.columns + 0.5) / 8 * 2 - 1, -y if v_up else y, np.zeros(32)], axis=-1)
    np.testing.assert_allclose(texels.points.position, expected, atol=1e-6)
    assert (texels.points.normal == [0, 0, 1]).all()
    assert (bth.bake.ambient_occlusion(square, texels.points) == 1).all()


def test_charts_that_repeat_overlap_or_leave_texels_out(square):
    half = bth.bake.at_texels(square, 8, 8, WHOLE * [0.5, 1])
    assert len(half.points) == 32 and half.columns.max() == 3
    shifted = bth.bake.at_texels(square, 8, 8, WHOLE + [3, -2])
    np.testing.assert_allclose(shifted.points.position, bth.bake.at_texels(square, 8, 8, WHOLE).points.position, atol=1e-5)
    across = bth.bake.at_texels(square, 8, 8, WHOLE + [0.5, 0])
    assert len(across.points) == 64 and across.points.position[(across.rows == 0) & (across.columns == 4)][0, 0] == pytest.approx(-0.875, abs=1e-5)
    with pytest.warns(UserWarning, match=r"\d+ of 36 texels lie within several triangles, .*use each texel once"):
        twice = bth.bake.at_texels(square, 8, 8, np.stack([WHOLE[0], WHOLE[0]]))
    assert 20 < twice.shared <= 36


def test_mirrored_instances(tmp_path):
    (tmp_path / "face.obj").write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nvt 1 0\nvt 0 1\nf 1/1 2/2 3/3\n")
    (tmp_path / "mirror.manifest").write_text(
        'version = 1\nobjects = [{ name = "face", model = "face.obj" }]\n'
        'nodes = [{ name = "mirrored", object = "face", scale = [-1, 1, 1] }]\n'
    )
    scene = bth.compile(tmp_path / "mirror.manifest", attributes="all", cache=False)
    texels = bth.bake.at_texels(scene, 8, 4)
    expected = np.stack([-(texels.columns + 0.5) / 8, 1 - (texels.rows + 0.5) / 4, np.zeros(len(texels.rows))], axis=-1)
    assert len(expected) > 10
    np.testing.assert_allclose(texels.points.position, expected, atol=1e-6)
    mesh, hits = texels.points.mesh, scene.nearest(expected + [0, 0, 1], [0, 0, -1])
    values = mesh.interpolated(mesh.vertices, hits.instance, hits.triangle, hits.u, hits.v)
    np.testing.assert_allclose(values, expected, atol=1e-6)


def test_texels_on_an_edge_are_not_shared():
    corners = np.array([[1, 2, 0], [3, 0, 2]])
    square = bth.compile((SQUARE[0], corners))
    texels = bth.bake.at_texels(square, 8, 8, np.array([[0, 0], [1, 0], [1, 1], [0, 1]])[corners])
    assert len(texels.points) == 64 and texels.shared == 0


def test_the_triangle_of_the_least_number_has_a_texel_that_several_cover():
    random, faces = np.random.default_rng(6), np.arange(120).reshape(-1, 3)
    scene = bth.compile((random.normal(size=(120, 3)), faces), quality="fast")
    # In units of 2^-10 all of this is exact.
    corners = random.integers(0, 1025, (40, 3, 2))
    texels = bth.bake.at_texels(scene, 16, 16, corners / 1024)
    middles = np.stack([64 * texels.columns + 32, 1024 - (64 * texels.rows + 32)], axis=-1)[:, None, None]
    before, behind = corners - middles, np.roll(corners, -1, axis=1) - middles
    signs = before[..., 0] * behind[..., 1] - before[..., 1] * behind[..., 0]
    inside = (signs >= 0).all(axis=2) | (signs <= 0).all(axis=2)
    assert (inside.sum(axis=1) > 1).sum() > 100
    assert (texels.points.triangle == inside.argmax(axis=1)).all()


@pytest.mark.parametrize("uv, error, match", [
    (WHOLE * np.nan, ValueError, "finite"), (WHOLE[:1], ValueError, "uv"), (WHOLE * 100, bth.Error, "repeat"), (None, bth.Error, "texture coordinates"),
])
def test_wrong_texture_coordinates(square, uv, error, match):
    with pytest.raises(error, match=match):
        bth.bake.at_texels(square, 8, 8, uv)
    with pytest.raises(ValueError, match="texture"):
        bth.bake.at_texels(square, 0, 8, WHOLE)


def test_borders_are_means_of_neighbours():
    random = np.random.default_rng(1)
    texture = np.where(random.random((12, 9)) < 0.3, random.random((12, 9)), np.nan).astype(np.float32)
    expected = texture.copy()
    for y, x in np.argwhere(np.isnan(texture)):
        near = texture[max(0, y - 1) : y + 2, max(0, x - 1) : x + 2]
        if not np.isnan(near).all():
            expected[y, x] = np.nanmean(near)
    np.testing.assert_allclose(dilated(texture, 1), expected, rtol=1e-6)
    assert not np.isnan(dilated(texture, 20)).any() and np.isnan(dilated(np.full((2, 2), np.nan, np.float32), 3)).all()
    assert (dilated(texture, 0)[~np.isnan(texture)] == texture[~np.isnan(texture)]).all()


OBJ = """
v -1 -1 0
v 1 -1 0
v 1 1 0
v -1 1 0
v 1 -1 1
v 1 1 1
vt 0 0
vt 0.5 0
vt 0.5 0.5
vt 0 0.5
vt 0.6 0.6
vt 0.9 0.6
vt 0.9 0.9
vt 0.6 0.9
f 1/1 2/2 3/3 4/4
f 2/5 5/6 6/7 3/8
"""


def test_a_texture_of_an_obj(tmp_path, monkeypatch, capsys):
    """A floor in the lower left quarter of the texture, and a wall at its right edge."""
    Image = pytest.importorskip("PIL.Image")
    monkeypatch.chdir(tmp_path)
    (tmp_path / "floor.obj").write_text(OBJ)
    arguments = ["ao", "floor.obj", "-o", "ao.png", "--texture", "40x20", "--border", "0", "--rays", "256", "--side", "both"]
    assert main([*arguments, "--picture", "p.png", "--size", "40x30", "--up", "z", "--json"]) == 0
    summary = json.loads(capsys.readouterr().out)
    assert summary["points"] == 20 * 10 + 12 * 6 and summary["texels_shared"] == 0
    texture = np.asarray(Image.open("ao.png")).astype(int)
    assert texture.shape == (20, 40) and (texture[:10, :24] == 255).all()
    front = bth.compile("floor.obj", attributes="all")
    texels = bth.bake.at_texels(front, 40, 20)
    values = bth.bake.ambient_occlusion(front, texels.points, rays=256)
    floor = texels.rows >= 10
    near, far = values[floor & (texels.columns == 19)], values[floor & (texels.columns == 0)]
    # The wall hides half of the sky at its foot, and 5 % from the other end (1 - d / sqrt(d^2 + h^2)) / 2 at most.
    assert 0.5 <= near.mean() < 0.62 and far.mean() > 0.94
    assert (texels.texture(values)[10:, 0] > 0.9).all()
