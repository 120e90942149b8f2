"""Mistakes of a first day: each is told what it is and what to do, in terms of this package."""

import pathlib
import pydoc
import re
import warnings

import numpy as np
import pytest
from conftest import sphere

import bth
import bth.bake

MESH = sphere(4, 6)
SEEDS = pathlib.Path(__file__).resolve().parents[2] / "fuzz" / "seeds" / "gltf"


def ply(path):
    x, y, z = MESH[0].T
    bth.bake.write_ply(str(path), {"x": x, "y": y, "z": z}, MESH[1])
    return str(path)


def test_a_model_that_is_opened(tmp_path):
    path = ply(tmp_path / "ball.ply")
    with pytest.raises(bth.Error, match=re.escape(f"found a model (.ply) (hint: bth.compile({path!r})")) as failed:
        bth.open(path)
    assert failed.value.code == "BTH-F002"
    with pytest.raises(bth.Error, match="expected a compiled file, found a model"):
        bth.open(path, mmap=True)
    other = tmp_path / "other.bth"
    other.write_text("no file of ours")
    with pytest.raises(bth.Error, match="BTH-F00") as failed:
        bth.open(other)
    assert "found a model" not in str(failed.value)


def test_scenes_of_paths(tmp_path):
    for meshes in (["a.ply"], "a.ply", [tmp_path / "a.ply"], [MESH, b"a.ply"]):
        with pytest.raises(TypeError, match="got the path '.*a.ply'.* bth.compile takes the path of one model; .* docs/scenes.md"):
            bth.compile_scene(meshes)


def test_transforms_without_instances():
    moved = np.tile(np.eye(4), (3, 1, 1))
    moved[:, 0, 3] = [0, 5, 9]
    scene = bth.compile_scene([MESH], transforms=list(moved))
    assert scene.instance_count == 3 and (scene.transforms == moved).all()
    assert bth.compile_scene([MESH, MESH], transforms=moved[0]).instance_count == 2
    with pytest.raises(ValueError, match="transforms: got 3 for 2 meshes .*instances="):
        bth.compile_scene([MESH, MESH], transforms=moved)


def test_ranges():
    scene = bth.compile(MESH)
    for radius in (-1, np.nan):
        with pytest.raises(ValueError, match="radius: expected a number from 0"):
            scene.closest([0, 0, 0], radius=radius)
    for query in (scene.overlaps_sphere, scene.triangles_in_sphere):
        with pytest.raises(ValueError, match="radius: expected numbers from 0, got -2"):
            query([0, 0, 0], [1, -2])
    for query in (scene.overlaps_box, scene.triangles_in_box):
        with pytest.raises(ValueError, match=r"ascending order along each axis, got .* \(box 1\)"):
            query([0, 0, 0], [[1, 1, 1], [1, -1, 1]])
    assert scene.closest([0, 0, 0], radius=0).found == False


def test_time_of_a_model():
    scene = bth.compile(MESH)
    for change in (lambda: scene.set_frame(3), lambda: setattr(scene, "seconds", 1.0)):
        with pytest.raises(ValueError, match="a model, which has no frames and no time"):
            change()
    bth.compile_scene([MESH]).set_frame(3)


def test_nobody_is_told_to_use_cargo_or_options():
    for structure in ("tets", "bth"):
        with warnings.catch_warnings(record=True) as told:
            warnings.simplefilter("always")
            try:
                bth.compile(MESH, structure=structure, settings={"c-tet": 0.01, "min-tet-triangles": 1})
            except bth.Error as error:
                told.append(error)
        text = " ".join(str(one) for one in told)
        assert "cargo" not in text and "--" not in text
        assert structure == "bth" or not told or "use structure bth" in text


@pytest.mark.skipif(not SEEDS.exists(), reason="not in the repository")
def test_models_compressed_by_meshopt():
    scene = bth.compile(SEEDS / "meshopt.glb", cache=False)
    assert scene.triangle_counts.sum() > 0 and scene.bounds is not None


def test_copies_are_read_only():
    scene = bth.compile_scene([MESH])
    parts = [scene.transforms, scene.visible, scene.objects_of_instances, scene.bounds, scene.instance_bounds(0), scene.object_bounds()]
    parts += [scene.vertices(), scene.triangles(), scene.triangle_counts, scene.instance_masks, scene.group_masks()]
    for part in parts:
        with pytest.raises(ValueError, match="read-only"):
            part[...] = 0
    hits = scene.nearest([0, 0, 5], [0, 0, -1])
    hits.t[...] = 0
    hits.position[...] = 0


def test_positions_that_are_rounded_are_told_of():
    mesh = MESH[0].astype(np.float64), MESH[1]
    scene = bth.compile(mesh, deformable=True)
    with pytest.warns(UserWarning, match=r"positions: rounding to float32 moves \d+ of 20 positions, by up to .*set_transforms"):
        scene.set_positions(mesh[0] + [5e6, 5e6, 0])
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        scene.set_positions(mesh[0] + [1, 0.1, 0])
        scene.set_positions(mesh[0].astype(np.float32) + np.float32(5e6))
        far = bth.compile((mesh[0] + [5e6, 5e6, 0], mesh[1]))
        assert far.normals(0, np.arange(len(mesh[1]))).any(axis=1).all()
        assert bth.compile((1e9 + mesh[0], mesh[1])).bounds is not None


def test_volumes_far_from_the_origin():
    scene = bth.compile((MESH[0].astype(np.float64) + [5e6, 5e6, 0], MESH[1]))
    box = np.array([[-1, -1, -1], [1, 1, 1]])
    volume, near = bth.bake.sdf(scene, 8, box=box + [5e6, 5e6, 0]), bth.bake.sdf(bth.compile(MESH), 8, box=box)
    assert volume.distance.shape == near.distance.shape == (8, 8, 8) and abs(volume.distance - near.distance).max() < 1e-6


@pytest.mark.parametrize("thing", [bth.bake.lidar, bth.bake.sdf, bth.bake.line_of_sight, bth.bake.at_texels, bth.compile, bth.Scene.nearest])
def test_help_is_readable(thing):
    signature = pydoc.plain(pydoc.render_doc(thing)).split("\n")[2]
    assert len(signature) < 1100 and "Union" not in signature and "_NestedSequence" not in signature, signature
    pydoc.render_doc(bth)
