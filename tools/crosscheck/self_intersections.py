#!/usr/bin/env python3
"""Checks the triangles that `bthc marks` reports in bad contact against pymeshlab's self-intersecting faces.

    self_intersections.py MODEL.tris IDS [--name NAME]     a model, and the reported triangle ids
    self_intersections.py --planted                        the list of planted contacts

MODEL.tris is what `bthc marks MODEL --tris MODEL.tris` writes: `TRIS`, u32 1, u64 count, then 9 f32
per triangle, little-endian. IDS is the output of `bthc marks --json` (`bad_triangles`), or a text
file with one id per line; other lines are skipped.

pymeshlab detects proper crossings only, in floating point, so its set must be a subset of the reported
one. Each triangle of its set that is not reported is tested in exact rational arithmetic against all
triangles whose boxes meet its box. It passes if that finds no bad contact and `exceptions.json` lists
it with a reason; `--record` adds such triangles to the list. Exits with 1 otherwise.
"""

import argparse
import hashlib
import json
import struct
import sys
from pathlib import Path

import numpy as np
import pymeshlab

import exact

HERE = Path(__file__).resolve().parent
EXCEPTIONS = HERE / "exceptions.json"
REASON = "pymeshlab tests in floating point; in rational arithmetic it touches no other beyond shared vertices"


def read_tris(path):
    data = Path(path).read_bytes()
    if data[:4] != b"TRIS" or len(data) < 16:
        sys.exit(f"{path}: not a .tris file")
    version, count = struct.unpack_from("<IQ", data, 4)
    if version != 1 or len(data) != 16 + 36 * count:
        sys.exit(f"{path}: expected version 1 and {16 + 36 * count} bytes, found {version} and {len(data)}")
    return np.frombuffer(data, "<f4", 9 * count, 16).reshape(count, 3, 3)


def read_ids(path, count):
    text = Path(path).read_text()
    if text.lstrip().startswith("{"):
        ids = json.loads(text)["bad_triangles"]
    else:
        ids = [int(line) for line in text.split("\n") if line.strip().isdecimal()]
    if any(i >= count for i in ids):
        sys.exit(f"{path}: an id is beyond the {count} triangles")
    return set(ids)


def weld(triangles):
    """Distinct positions (-0 = +0) and the rows of each triangle."""
    points = np.ascontiguousarray(triangles.reshape(-1, 3) + np.float32(0)).view("V12").ravel()
    distinct, rows = np.unique(points.view(np.uint32).reshape(-1, 3), axis=0, return_inverse=True)
    return distinct.view(np.float32).reshape(-1, 3), rows.reshape(-1, 3)


def pymeshlab_ids(triangles):
    """Ids of the triangles that pymeshlab selects, and of those passed to it. Triangles of zero area are left
    out: no ray hits them, and the compiler drops them."""
    positions, rows = weld(triangles)
    proper = (rows[:, 0] != rows[:, 1]) & (rows[:, 1] != rows[:, 2]) & (rows[:, 2] != rows[:, 0])
    # Only triangles that are nearly without area need the exact test.
    corners = triangles.astype(np.float64)
    edges = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    area = np.abs(np.cross(*edges)).max(axis=1)
    scale = np.abs(edges[0]).max(axis=1) * np.abs(edges[1]).max(axis=1)
    for i in np.nonzero(proper & (area <= 1e-9 * scale))[0]:
        proper[i] = exact.has_area(triangles[i])
    ids = np.nonzero(proper)[0]
    meshes = pymeshlab.MeshSet()
    meshes.add_mesh(pymeshlab.Mesh(positions.astype(np.float64), rows[ids].astype(np.int32)))
    if meshes.current_mesh().face_number() != len(ids):
        sys.exit("pymeshlab changed the number of faces")
    meshes.compute_selection_by_self_intersections_per_face()
    return set(ids[meshes.current_mesh().face_selection_array()].tolist()), ids


def near_ids(triangles, ids, i):
    """The other triangles whose boxes meet that of triangle i."""
    lower, upper = triangles[i].min(axis=0), triangles[i].max(axis=0)
    near = (triangles[ids].min(axis=1) <= upper).all(axis=1) & (triangles[ids].max(axis=1) >= lower).all(axis=1)
    return [int(j) for j in ids[near] if j != i]


def check(name, triangles, ours, record):
    """Compares the sets for one model; returns whether it passes."""
    theirs, ids = pymeshlab_ids(triangles)
    digest = hashlib.sha256(triangles.astype("<f4").tobytes()).hexdigest()[:16]
    listed = json.loads(EXCEPTIONS.read_text())
    known = {(e["model_sha256"], e["triangle"]) for e in listed}
    print(f"{name}: {len(triangles)} triangles, ours {len(ours)}, pymeshlab's {len(theirs)}, "
          f"only pymeshlab's {len(theirs - ours)}")
    passed = True
    for i in sorted(theirs - ours):
        near = near_ids(triangles, ids, i)
        contacts = [j for j in near if exact.in_bad_contact(triangles[i], triangles[j])]
        # pymeshlab does not report pairs: a partner is one of the near triangles that it selects, too.
        partners = contacts or [j for j in near if j in theirs]
        for j in [i] + partners:
            print(f"  triangle {j}: {triangles[j].tolist()}")
        if contacts:
            print(f"  triangle {i} is in bad contact with {contacts}, exactly: WE ARE WRONG")
            passed = False
        elif (digest, i) in known:
            print(f"  {i} is in no bad contact, exactly; listed in exceptions.json")
        elif record:
            listed.append({"model": name, "model_sha256": digest, "triangle": i,
                           "corners": triangles[i].tolist(), "reason": REASON})
            print(f"  {i} is in no bad contact, exactly; recorded")
        else:
            print(f"  {i} is in no bad contact, exactly, but not listed in exceptions.json (--record adds it)")
            passed = False
    if record:
        lines = ",\n".join(json.dumps(entry) for entry in listed)
        EXCEPTIONS.write_text(f"[\n{lines}\n]\n" if listed else "[]\n")
    return passed


def check_planted():
    """The planted contacts: rational arithmetic agrees with the list, pymeshlab's set is part of it."""
    passed = True
    cases = json.loads((HERE / "planted.json").read_text())
    for case in cases:
        triangles = np.array(case["triangles"], np.float32)
        proper = [i for i in range(len(triangles)) if exact.has_area(triangles[i])]
        pairs = [(i, j) for i in proper for j in proper
                 if i < j and exact.in_bad_contact(triangles[i], triangles[j])]
        bad = sorted({i for pair in pairs for i in pair})
        theirs, _ = pymeshlab_ids(triangles)
        if bad != case["bad"] or len(pairs) != case["pairs"]:
            print(f"{case['name']}: listed {case['bad']} in {case['pairs']} pairs, exactly {bad} in {len(pairs)}")
            passed = False
        if not theirs <= set(bad):
            print(f"{case['name']}: pymeshlab has {sorted(theirs - set(bad))} too")
            passed = False
    print(f"{len(cases)} planted cases {'pass' if passed else 'FAIL'}")
    return passed


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("tris", nargs="?")
    parser.add_argument("ids", nargs="?")
    parser.add_argument("--name", help="the model's name in messages")
    parser.add_argument("--planted", action="store_true", help="check the planted contacts")
    parser.add_argument("--record", action="store_true", help="add proven exceptions to exceptions.json")
    args = parser.parse_args()
    if not args.planted and not args.ids:
        parser.error("expected MODEL.tris and IDS, or --planted")
    passed = check_planted() if args.planted else True
    if args.ids:
        triangles = read_tris(args.tris)
        passed &= check(args.name or Path(args.tris).stem, triangles, read_ids(args.ids, len(triangles)), args.record)
    sys.exit(0 if passed else 1)


if __name__ == "__main__":
    main()
