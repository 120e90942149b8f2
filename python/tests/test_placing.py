"""Instances that are moved, added, hidden and removed: answers are those of a scene that is compiled with them."""

import copy
import pickle

import numpy as np
import pytest
from conftest import sphere

import bth

PIECES = [sphere(6, 8), (np.array([[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]], np.float32), np.array([[0, 1, 2], [0, 2, 3]]))]
FLAT = np.diag([1.0, 1.0, 0.0, 1.0])


def matrices(count, seed):
    random = np.random.default_rng(seed)
    placed = np.tile(np.eye(4), (count, 1, 1))
    placed[:, :3, :3] = random.normal(size=(count, 3, 3))
    placed[:, :3, 3] = random.normal(size=(count, 3)) * 4
    return placed


def answers(scene, rows=None):
    """What queries say, with the instances of hits as rows of `rows`."""
    random = np.random.default_rng(5)
    origins, targets = random.normal(size=(2, 600, 3)) * [[[6]], [[3]]]
    directions = targets - origins
    hits, every, closest = scene.nearest(origins, directions), scene.all_hits(origins, directions), scene.closest(origins)
    assert hits.hit.sum() > 5
    names = (lambda ids: ids) if rows is None else (lambda ids: np.where(ids == bth.NONE, bth.NONE, rows[np.where(ids == bth.NONE, 0, ids)]))
    parts = [hits.t, hits.u, hits.triangle, names(hits.instance), hits.normal, hits.position, every.t, names(every.instance)]
    parts += [closest.distance, closest.point, names(closest.instance), scene.winding(origins), scene.signed_distance(origins)]
    return [part.tobytes() for part in parts]


def anew(scene):
    """A scene that is compiled with the visible instances of another, and their rows there."""
    ids = np.nonzero(scene.visible)[0]
    rows = np.zeros(scene.instance_count, np.uint32)
    rows[ids] = np.arange(len(ids))
    # The instance of the lowest index names a tie, so the order must be the same.
    return bth.compile_scene(PIECES, scene.objects_of_instances[ids], scene.transforms[ids], quality="fast"), rows


@pytest.fixture
def scene():
    return bth.compile_scene(PIECES, [0, 1, 0, 1], matrices(4, 1), quality="fast")


@pytest.mark.filterwarnings("ignore::bth.OpenMeshWarning")
def test_answers_are_those_of_a_scene_compiled_anew(scene):
    random = np.random.default_rng(2)
    for step in range(25):
        live = np.nonzero(scene.objects_of_instances != bth.NONE)[0]
        chosen = random.choice(live, size=min(len(live), 3), replace=False)
        match step % 5:
            case 0 | 3:
                scene.set_transforms(chosen, matrices(len(chosen), step))
            case 1:
                ids = scene.add_instances(random.integers(2, size=5), matrices(5, step))
                assert ids.dtype == np.uint32 and (scene.transforms[ids] == matrices(5, step)).all()
            case 2:
                scene.set_visible(chosen, random.integers(2, size=len(chosen)))
            case 4:
                scene.remove_instances(chosen)
                assert (scene.objects_of_instances[chosen] == bth.NONE).all() and not scene.visible[chosen].any()
        expected, rows = anew(scene)
        assert answers(scene, rows) == answers(expected)


@pytest.mark.filterwarnings("ignore::bth.OpenMeshWarning")
def test_placing_without_a_change_changes_no_answer(scene):
    before = answers(scene)
    scene.set_transforms([], np.eye(4))
    assert answers(scene) == before
    scene.set_transforms(2, scene.transforms[2])
    assert answers(scene) == before and scene.to_bytes() == bth.load(scene.to_bytes()).to_bytes()


@pytest.mark.filterwarnings("ignore::bth.OpenMeshWarning")
def test_objects_of_other_scenes():
    scene, sheet = bth.compile(PIECES[0]), bth.compile(PIECES[1])
    size, rows = scene.nbytes, [0, 1, 1]
    with sheet:
        assert scene.add_objects(sheet) == range(1, 2)
    assert scene.object_count == 2 and scene.instance_count == 1
    scene.set_transforms(0, matrices(1, 11)[0])
    scene.add_instances([1, 1], matrices(2, 12))
    expected = bth.compile_scene(PIECES, rows, [*matrices(1, 11), *matrices(2, 12)])
    assert answers(scene) == answers(expected) and scene.nbytes == size
    for copied in (copy.copy(scene), pickle.loads(pickle.dumps(scene))):
        assert answers(copied) == answers(expected) and copied.object_count == 2


def test_objects_of_scenes_with_added_objects():
    scene, others = bth.compile(PIECES[0]), bth.compile(PIECES[1], deformable=True)
    others.add_objects(bth.compile(sphere(3, 4), names=True))
    others.set_positions(PIECES[1][0] * np.float32(2), 0)
    assert scene.add_objects(others) == range(1, 3) and scene.add_objects(scene) == range(3, 6)
    assert [len(scene.triangles(k)) for k in range(6)] == [len(PIECES[0][1]), 2, 16] * 2
    # Added objects have the positions of their file.
    assert (scene.vertices(1) == PIECES[1][0]).all() and scene.vertex_count(1) == 4
    scene.set_positions(PIECES[1][0] * np.float32(3), 4)
    other = pickle.loads(pickle.dumps(scene))
    assert other.object_count == 6 and (other.vertices(4) == PIECES[1][0] * np.float32(3)).all()
    assert (other.vertices(1) == PIECES[1][0]).all()


def test_of_a_model_and_of_one_index():
    scene = bth.compile(PIECES[0])
    added = scene.add_instances(matrices=matrices(1, 3)[0])
    assert added == 1 and isinstance(added, int) and scene.instance_count == 2 and scene.object_count == 1
    scene.remove_instances(0)
    assert scene.add_instances(0, matrices(2, 4)).tolist() == [0, 2]
    assert scene.instance_names == ["", "", ""]


def test_models_in_double_precision():
    far = PIECES[0][0].astype(np.float64) / 3 + [5.5e6, 4.2e5, 300]
    back = np.eye(4)
    back[:3, 3] = [-5.5e6, -4.2e5, -300]
    scene = bth.compile_scene([(far, PIECES[0][1])], transforms=np.stack([np.eye(4), np.eye(4)]))
    scene.set_transforms([0, 1], [back @ np.eye(4), matrices(1, 4)[0] @ back])
    expected = bth.compile_scene([(far, PIECES[0][1])], transforms=scene.transforms)
    assert scene.vertices().dtype == np.float64 and answers(scene) == answers(expected)


def test_no_object_is_compiled():
    scene = bth.compile(PIECES[0])
    size = scene.nbytes
    scene.add_instances(0, matrices(3000, 6))
    assert scene.nbytes == size and scene.instance_count == 3001 and scene.triangle_counts.tolist() == [len(PIECES[0][1])]


@pytest.mark.filterwarnings("ignore::bth.OpenMeshWarning")
@pytest.mark.parametrize("change, error", [
    (lambda scene: scene.set_transforms([0, 1], [np.eye(4), FLAT]), bth.Error),
    (lambda scene: scene.set_transforms(1, np.diag([1e30, 1e30, 1e30, 1])), None),
    (lambda scene: scene.set_transforms(1, np.full((3, 4), np.nan)), bth.Error),
    (lambda scene: scene.set_transforms(4, np.eye(4)), IndexError),
    (lambda scene: scene.set_transforms(-1, np.eye(4)), IndexError),
    (lambda scene: scene.set_transforms([0, 1], np.zeros((3, 4, 4))), ValueError),
    (lambda scene: scene.set_transforms(0, np.eye(3)), ValueError),
    (lambda scene: scene.set_transforms(0.5, np.eye(4)), TypeError),
    (lambda scene: scene.add_instances(2), IndexError),
    (lambda scene: scene.add_instances([0, 0], [np.eye(4), FLAT]), bth.Error),
    (lambda scene: scene.remove_instances([0, 9]), IndexError),
    (lambda scene: scene.set_visible([0, 1], [True, False, True]), ValueError),
])
def test_a_call_that_fails_changes_nothing(scene, change, error):
    before, transforms = answers(scene), scene.transforms
    if error is None:
        change(scene)
        assert (scene.transforms[1] == np.diag([1e30, 1e30, 1e30, 1])).all()
        return
    with pytest.raises(error):
        change(scene)
    assert answers(scene) == before and (scene.transforms[:4] == transforms).all() and scene.visible[:4].all()
    assert scene.add_instances(1) == 4


def test_hidden_instances_may_have_any_transform(scene):
    scene.set_visible(1, False)
    scene.set_transforms(1, FLAT)
    with pytest.raises(bth.Error) as failed:
        scene.set_visible(1)
    assert failed.value.code == "BTH-S001" and scene.visible.tolist() == [True, False, True, True]
    scene.set_transforms(1, np.eye(4))
    scene.set_visible(1)
    assert scene.visible.all()


@pytest.mark.filterwarnings("ignore::bth.OpenMeshWarning")
def test_masks_names_and_positions_stay():
    scene = bth.compile_scene(
        PIECES, [0, 1, 0], matrices(3, 8), deformable=True, mesh_names=["ball", "sheet"], instance_names=["a", "b", "c"], names=True,
    )
    scene.set_positions(PIECES[1][0] + [0, 0, 1], 1)
    scene.set_instance_mask(0, 2)
    scene.set_group_mask(0, 5, obj=1)
    before = answers(scene)
    scene.set_visible(0, True)
    assert answers(scene) == before and scene.instance_names == ["a", "b", "c"] and scene.object_names == ["ball", "sheet"]
    assert scene.instance_masks.tolist() == [2, 2**32 - 1, 2**32 - 1] and scene.group_masks(1).tolist() == [5]
    scene.set_positions(PIECES[1][0] + [0, 0, 2], 1)
    assert (scene.vertices(1) == PIECES[1][0] + [0, 0, 2]).all()
    scene.set_instance_mask(1, 4)
    scene.remove_instances(1)
    assert scene.add_instances(1) == 1 and scene.instance_names == ["a", "", "c"]
    assert scene.instance_masks.tolist() == [2, 2**32 - 1, 2**32 - 1]


@pytest.mark.filterwarnings("ignore::bth.OpenMeshWarning")
@pytest.mark.parametrize("copied", [copy.copy, lambda scene: pickle.loads(pickle.dumps(scene))])
def test_copies(copied):
    scene = bth.compile_scene(PIECES, [0, 1, 0, 1], matrices(4, 1), instance_names=["a", "b", "c", "d"], deformable=True)
    scene.remove_instances([0, 3])
    scene.set_transforms(2, matrices(1, 9)[0])
    scene.add_instances([1, 1, 0], matrices(3, 10))
    scene.remove_instances(3)
    scene.set_visible(1, False)
    scene.set_transforms(1, FLAT)
    scene.set_instance_mask(2, 3)
    scene.set_positions(PIECES[1][0] * np.float32(2), 1)
    other = copied(scene)
    assert answers(other) == answers(scene) and other.instance_names == scene.instance_names == ["", "b", "c", "", ""]
    for name in ("objects_of_instances", "visible", "transforms", "instance_masks"):
        there = scene.objects_of_instances != bth.NONE
        assert (getattr(other, name)[there] == getattr(scene, name)[there]).all()
    other.set_visible(2, False)
    assert scene.visible[2]


def test_scenes_that_move_by_themselves_are_refused(tmp_path):
    (tmp_path / "sheet.obj").write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n")
    manifest = tmp_path / "slide.manifest"
    manifest.write_text("""
        version = 1
        objects = [{ name = "sheet", model = "sheet.obj" }]
        nodes = [{ name = "slide", object = "sheet" }]
        tracks = [{ node = "slide", property = "translation", times = [0, 1], values = [[0, 0, 0], [8, 0, 0]] }]
    """)
    scene = bth.compile(manifest, cache=False)
    for refused in (
        lambda: scene.set_transforms(0, np.eye(4)), lambda: scene.add_objects(bth.compile(PIECES[0])),
        lambda: bth.compile(PIECES[0]).add_objects(scene),
    ):
        with pytest.raises(ValueError, match="tracks .* animation=\"none\""):
            refused()
    scene.seconds = 1
    assert scene.bounds[1, 0].round(3) == 9


def test_no_change_while_a_filter_runs(scene):
    change = lambda _: scene.set_visible(0, False)
    with pytest.raises(RuntimeError, match="cannot be changed"):
        scene.nearest(np.zeros((50, 3)), np.random.default_rng(1).normal(size=(50, 3)), filter=change)
