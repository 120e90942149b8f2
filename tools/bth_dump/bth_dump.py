#!/usr/bin/env python3
"""Shows what a BTH file holds and checks it, independently of the library.

Written from format-spec/README.md alone. Needs nothing but Python 3.9; with the `blake3` package
from PyPI hashing is fast. Exit status: 0 the file is valid, 1 it is not, 2 it cannot be read.
"""

import argparse
import json
import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parent))
from bth_container import Container, Invalid, NONE, kind_name  # noqa: E402
from bth_deformation import DeformationView  # noqa: E402
from bth_geometry import check_geometry  # noqa: E402
from bth_groups import GroupsView, object_names  # noqa: E402
from bth_indices import check_indices  # noqa: E402
from bth_materials import MaterialsView, check_images  # noqa: E402
from bth_object import ObjectView  # noqa: E402
from bth_scene import SceneView, check_scene  # noqa: E402
from bth_sequences import SequenceView  # noqa: E402
from bth_trees import check_trees  # noqa: E402


def describe(container):
    """The header, the sections and the objects as a JSON-able value."""
    header = container.header
    objects = []
    names = object_names(container)
    for i in range(container.objects):
        view = ObjectView(container, i)
        objects.append(
            {
                "name": names[i] if names else "",
                "lower": view.lower,
                "upper": view.upper,
                "triangles": view.triangles,
                "dropped": view.dropped,
                "depth": view.depth,
                "tet_leaves": len(view.tet_leaves),
                "tets": len(view.tets),
                "frames": len(SequenceView(view).times),
                "groups": GroupsView(view).describe(),
                "materials": MaterialsView(view).describe(),
            }
        )
    return {
        "writer_version": f"{header.writer_version >> 16}.{header.writer_version & 0xFFFF}",
        "minimum_reader_version": f"{header.minimum_reader_version >> 16}.{header.minimum_reader_version & 0xFFFF}",
        "file_length": header.file_length,
        "content_id": header.content_id.hex(),
        "sections": [
            {
                "kind": kind_name(e.kind),
                "code": e.kind,
                "object": None if e.object == NONE else e.object,
                "offset": e.offset,
                "length": e.length,
                "stride": e.stride,
                "count": e.count,
                "required": bool(e.flags & 1),
                "hash": e.hash.hex(),
            }
            for e in container.entries
        ],
        "objects": objects,
        "scene": describe_scene(SceneView(container)),
    }


def describe_scene(view):
    """The scene as a JSON-able value; None for a file without one."""
    if not view.exists:
        return None
    scene = view.scenes[0]
    return {
        "rate": scene.rate,
        "frames": [scene.first_frame, scene.last_frame],
        "nodes": [view.name(n) for n in view.nodes],
        "instances": [[x.node, x.object] for x in view.instances],
        "tracks": [[t.node, t.property, t.interpolation, t.keys] for t in view.tracks],
        "cameras": [view.name(x) for x in view.cameras],
        "lights": [view.name(x) for x in view.lights],
    }


def check(data, level):
    """Checks a file up to a level (open, index, verify); returns its container."""
    container = Container(data)
    if level == "verify":
        container.check_bytes()
    if level != "open":
        materials = []
        for i in range(container.objects):
            view = ObjectView(container, i)
            GroupsView(view).check()
            materials.append(MaterialsView(view))
            materials[-1].check()
            DeformationView(view).check()
            tets = check_indices(view)
            SequenceView(view).check()
            if level == "verify":
                check_geometry(view, tets)
        object_names(container)
        check_images(container, materials)
        scene = SceneView(container)
        check_scene(scene)
        if level == "verify":
            check_trees(scene)
    return container


def show(description):
    """Prints a description for people."""
    print(f"BTH {description['writer_version']}, readable from {description['minimum_reader_version']}")
    print(f"{description['file_length']} bytes, content id {description['content_id']}")
    for s in description["sections"]:
        owner = "file" if s["object"] is None else f"object {s['object']}"
        print(
            f"  {s['kind']:16} {owner:10} at {s['offset']:>10}: {s['count']} x {s['stride']} bytes"
            + (", required" if s["required"] else "")
        )
    for i, o in enumerate(description["objects"]):
        print(f"object {i}: {o['triangles']} triangles ({o['dropped']} dropped), depth {o['depth']}")
        print(f"  bounds {o['lower']} to {o['upper']}")
        if o["tet_leaves"]:
            print(f"  {o['tet_leaves']} tet leaves with {o['tets']} tetrahedra")
        if o["frames"]:
            print(f"  {o['frames']} frames of its vertices")
        if o["groups"]:
            print(f"  {len(o['groups'])} groups of triangles")
        if o["materials"]["parameters"]:
            print(f"  {o['materials']['parameters']} materials with {o['materials']['textures']} textures")
    scene = description["scene"]
    if scene:
        counts = ", ".join(f"{len(scene[k])} {k}" for k in ("nodes", "instances", "tracks", "cameras", "lights"))
        print(f"scene: frames {scene['frames'][0]} to {scene['frames'][1]} at {scene['rate']} a second, {counts}")


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("files", nargs="+", metavar="FILE", help="a BTH file")
    parser.add_argument("--json", action="store_true", help="one line of JSON for each file")
    parser.add_argument(
        "--level", choices=["open", "index", "verify"], default="verify", help="how much to check (default: %(default)s)"
    )
    arguments = parser.parse_args()
    status = 0
    for name in arguments.files:
        result = {"file": name, "valid": True}
        try:
            result.update(describe(check(Path(name).read_bytes(), arguments.level)))
        except Invalid as error:
            result.update(valid=False, code=error.code, section=error.section, offset=error.offset, message=error.message)
            status = max(status, 1)
        except OSError as error:
            result.update(valid=False, code="BTH-O001", message=error.strerror)
            status = 2
        if arguments.json:
            print(json.dumps(result))
        elif result["valid"]:
            print(f"{name}: valid")
            show(result)
        else:
            where = "".join(f"{k} {result[k]}: " for k in ("section", "offset") if result.get(k) is not None)
            print(f"{name}: {result['code']}: {where}{result['message']}")
    return status


if __name__ == "__main__":
    sys.exit(main())
