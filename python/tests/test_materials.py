"""How surfaces look: materials, textures and vertex colors that a file keeps."""

import pathlib
import struct
import zlib

import numpy as np
import pytest

import bth

FILES = pathlib.Path(__file__).resolve().parents[2] / "format-spec" / "conformance" / "valid"


def _png(*texels):
    """A PNG file of one row of RGBA texels."""
    chunk = lambda kind, body: struct.pack(">I", len(body)) + kind + body + struct.pack(">I", zlib.crc32(kind + body))
    header = struct.pack(">IIBBBBB", len(texels), 1, 8, 6, 0, 0, 0)
    row = b"\0" + bytes(np.array(texels, np.uint8))
    return b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", header) + chunk(b"IDAT", zlib.compress(row)) + chunk(b"IEND", b"")


MODEL = """
mtllib colored.mtl
v 0 0 0 1 0 0
v 1 0 0 0 1 0
v 0 1 0 0 0 1
vt 0 0
vt 1 0
vt 0 1
usemtl lamp
f 1/1 2/2 3/3
usemtl glass
f 1/1 3/3 2/2
"""
MATERIALS = """
newmtl lamp
Kd 0.5 0.25 1
Ke 2 1 0
map_Kd grey.png
newmtl glass
Kd 1 1 1
d 0.5
"""
IMAGE = _png([188, 188, 188, 255], [0, 0, 0, 255])


@pytest.fixture(scope="module")
def path(tmp_path_factory):
    folder = tmp_path_factory.mktemp("materials")
    (folder / "colored.obj").write_text(MODEL)
    (folder / "colored.mtl").write_text(MATERIALS)
    (folder / "grey.png").write_bytes(IMAGE)
    return folder / "colored.obj"


def test_materials_and_textures_are_those_of_the_source(path):
    scene = bth.compile(path, materials=True, cache=False)
    lamp, glass = scene.materials()
    assert lamp.name == "lamp" and lamp.alpha == "opaque" and not lamp.unlit and lamp.emissive_texture is None
    np.testing.assert_allclose(lamp.emissive, [2, 1, 0])
    assert glass.name == "glass" and glass.alpha == "blend" and glass.base_color[3] == 0.5 and glass.base_color_texture is None
    [texture] = scene.textures()
    assert lamp.base_color_texture == 0 and texture.data == IMAGE and texture.wrap == ("repeat", "repeat")
    assert texture.transform.shape == (2, 3) and texture.transform.dtype == np.float32
    hits = scene.nearest([[0.25, 0.5, 1], [9, 9, 1]], [0, 0, -1])
    # Texture coordinates of OBJ go up, those of images down.
    assert texture.coordinates(hits.texcoord[0]).tolist() == [0.25, 0.5]
    assert texture.coordinates([[0.25, 0.125], [1, 0]]).tolist() == [[0.25, 0.875], [1, 1]]


def test_gloss_is_that_of_the_file(path):
    """As `brass` of tests/src/conformance/materials.rs."""
    [plain, _] = bth.compile(path, materials=True, cache=False).materials()
    assert plain.gloss is None
    if not FILES.exists():
        pytest.skip("not in the repository")
    scene = bth.open(FILES / "gloss.bth")
    [brass] = scene.materials(0)
    assert brass.gloss == bth.Gloss(1.0, 0.25, 1, 0, 1.0, None, 1.0) and scene.materials(1)[0].gloss is None


def test_vertex_colors_are_interpolated_linearly(path):
    scene = bth.compile(path, materials=True, cache=False)
    hits = scene.nearest([[0.25, 0.5, 1], [9, 9, 1]], [0, 0, -1])
    np.testing.assert_allclose(hits.vertex_color[0], [0.25, 0.25, 0.5, 1], atol=1e-4)
    assert np.isnan(hits.vertex_color[1]).all() and hits.vertex_color.dtype == np.float32
    np.testing.assert_array_equal(hits.surface().vertex_color, hits.vertex_color)


def test_without_materials_only_names_are_kept(path):
    scene = bth.compile(path, names=True, cache=False)
    assert scene.materials() == [None, None] and scene.material_names() == ["lamp", "glass"] and scene.textures() == []
    assert np.isnan(scene.nearest([0.25, 0.5, 1], [0, 0, -1]).vertex_color).all()
    for wrong in (1, -1):
        with pytest.raises(IndexError):
            scene.materials(wrong)
        with pytest.raises(IndexError):
            scene.textures(wrong)


def test_a_missing_image_is_an_error_unless_it_is_left_out(path, tmp_path):
    (tmp_path / "colored.obj").write_text(MODEL)
    (tmp_path / "colored.mtl").write_text(MATERIALS)
    with pytest.raises(bth.Error, match="BTH-I016.*grey.png"):
        bth.compile(tmp_path / "colored.obj", materials=True, cache=False)
    with pytest.warns(UserWarning, match="grey.png.*left out"):
        scene = bth.compile(tmp_path / "colored.obj", materials=True, lenient_materials=True, cache=False)
    [lamp, glass] = scene.materials()
    whole = bth.compile(path, materials=True, cache=False).materials()
    np.testing.assert_array_equal([lamp.base_color, glass.base_color], [material.base_color for material in whole])
    assert lamp.base_color_texture is None and scene.textures() == []
