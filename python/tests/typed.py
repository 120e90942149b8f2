"""A program with types, which mypy checks (python/test), and test_docs.py runs."""

from pathlib import Path

import numpy as np
import trimesh
from numpy.typing import NDArray

import bth
from bth.embreex.mesh_construction import TriangleMesh
from bth.embreex.rtcore import EmbreeDevice
from bth.embreex.rtcore_scene import EmbreeScene

VERTICES = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]], np.float32)
FACES = np.array([[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]])


def nearest(scene: bth.Scene, rays: NDArray[np.float32]) -> NDArray[np.float64]:
    hits: bth.Hits = scene.nearest(rays[..., :3], rays[..., 3:], tmax=9, mask=3, cull="back", filter=keep)
    t: NDArray[np.floating] = hits.t
    triangle: NDArray[np.uint32] = hits.triangle
    found: NDArray[np.bool_] = scene.any(None, [0, 0, 1], start=hits)
    scene.check_start((0, [0, 1], np.zeros((2, 2))))
    group: str = hits.group_name.item(0)
    surface: bth.SurfacePoints = hits.surface()
    assert t.shape == triangle.shape == found.shape == surface.texcoord.shape[:-1] and group == ""
    return hits.shading_normal


def keep(candidate: bth.Candidate) -> bool:
    return candidate.u + candidate.v < 0.9 and candidate.opacity != bth.Opacity.UNKNOWN


def masks(scene: bth.Scene) -> list[int]:
    scene.set_instance_mask(0, 1)
    scene.set_group_mask("", 3)
    scene.set_group_mask(0, 3, obj=0)
    masks: NDArray[np.uint32] = scene.group_masks()
    return [int(mask) for mask in masks]


def moved(scene: bth.Scene) -> int:
    one: int = scene.add_instances()
    ids: int | NDArray[np.uint32] = scene.add_instances([0, 0], np.stack([np.eye(4)] * 2))
    scene.set_transforms(ids, np.eye(4))
    scene.set_visible(one, False)
    scene.remove_instances(one)
    closed: bool | None = scene.is_closed
    assert closed and scene.is_object_closed(0) and not scene.visible[one]
    return scene.instance_count


def many(scene: bth.Scene, points: NDArray[np.float64]) -> None:
    every: bth.AllHits = scene.all_hits(points, [0, 0, 1], most=3)
    offsets: NDArray[np.int64] = every.offsets
    count: NDArray[np.int64] = scene.count(points, [0, 0, 1])
    passages, winding = scene.crossings(points, [0, 0, 1])
    closest: bth.Closest = scene.closest(points, radius=5)
    inside: NDArray[np.bool_] = scene.contains(points) & scene.overlaps_sphere(points, closest.distance)
    overlaps: bth.Overlaps = scene.triangles_in_box(points - 1, points + 1)
    box: NDArray[np.float32] | None = scene.bounds
    assert box is not None and len(offsets) == count.size + 1 == inside.size + 1 and len(overlaps) <= 4 * count.size
    assert passages.shape == winding.shape == closest.feature.shape


def compiled(path: Path) -> bth.Scene:
    with bth.compile((VERTICES, FACES), quality="fast", names=True, output=path) as first:
        data: bytes = first.to_bytes()
    scenes = [bth.open(path, mmap=True), bth.load(data), bth.compile_scene([(VERTICES, FACES)], [0, 0], np.eye(4), threads=1)]
    frames: tuple[int, int, float] | None = scenes[2].frames
    assert frames is not None and frames[0] == 0
    return scenes[0]


def assembled(scene: bth.Scene) -> int:
    """Objects of one scene in another; returns how many there are."""
    added: range = scene.add_objects(bth.compile((VERTICES, FACES)))
    scene.add_instances(added[0], np.eye(4))
    return scene.object_count


def drop_ins() -> None:
    """The drop-ins, with what type checkers know of their results."""
    rays = bth.open3d.RaycastingScene()
    geometry: int = rays.add_triangles(VERTICES, FACES)
    assert geometry == 0 and rays.cast_rays([[0.1, 0.1, 5, 0, 0, -1]])["t_hit"].numpy().shape == (1,)
    device = EmbreeScene(EmbreeDevice())
    TriangleMesh(device, VERTICES, FACES)
    primitives: NDArray[np.int32] = device.run([[0.1, 0.1, 5]], [[0, 0, -1]])
    distances: NDArray[np.floating] = device.run([[0.1, 0.1, 5]], [[0, 0, -1]], query="DISTANCE")
    assert primitives.shape == distances.shape == (1,)
    mesh = bth.trimesh.RayMeshIntersector(trimesh.creation.box())
    first: NDArray[np.int64] = mesh.intersects_first([[0.1, 0.1, 5]], [[0, 0, -1]])
    _, _, points = mesh.intersects_id([[0.1, 0.1, 5]], [[0, 0, -1]], return_locations=True)
    assert first.shape == (1,) and points.shape == (2, 3)


def wrong(scene: bth.Scene) -> None:
    """What mypy must refuse; never called."""
    scene.nearest([0, 0, 0], [0, 0, 1], cull="left")  # type: ignore[arg-type]
    scene.any([0, 0, 0], [0, 0, 1], filter=3)  # type: ignore[arg-type]
    bth.compile("model.obj", alpha="holes")  # type: ignore[arg-type]
    bth.compile_scene([], flatten=True)  # type: ignore[call-arg]
    scene.nearst([0, 0, 0], [0, 0, 1])  # type: ignore[attr-defined]
    scene.bounds = None  # type: ignore[misc]
    bth.open3d.RaycastingScene().cast_ray([[0, 0, 0, 0, 0, 1]])  # type: ignore[attr-defined]
    EmbreeScene().run([[0, 0, 0]], [[0, 0, 1]], query="NEAREST")  # type: ignore[call-overload]
    bth.trimesh.RayMeshIntersector([[0, 0, 0]])  # type: ignore[arg-type]
    scene.add_objects(VERTICES)  # type: ignore[arg-type]


def main(folder: Path) -> None:
    scene = compiled(folder / "tetrahedron.bth")
    try:
        bth.load(b"nothing")
    except bth.Error as error:
        code: str = error.code
        assert code.startswith("BTH-F")
    many(scene, np.full((2, 3), 0.1))
    assert nearest(scene, np.array([[0.2, 0.2, -1, 0, 0, 1]], np.float32)).tolist() == [[0, 0, -1]]
    assert masks(scene) == [3] and moved(scene) == 4 and assembled(scene) == 2
    drop_ins()
    assert issubclass(bth.OpenMeshWarning, UserWarning)
