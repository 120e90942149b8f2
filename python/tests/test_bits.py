"""Answers have the bits of the Rust library's, as `bthc trace` writes them, in every chunk and on every number of threads."""

import os
import pathlib
import struct
import subprocess

import numpy as np
import pytest

import bth

ROOT = pathlib.Path(__file__).resolve().parents[2]
BTHC = pathlib.Path(os.environ.get("BTHC", pathlib.Path(os.environ.get("CARGO_TARGET_DIR", ROOT / "target")) / "debug" / "bthc"))


@pytest.mark.skipif(not BTHC.exists(), reason=f"there is no {BTHC}")
@pytest.mark.parametrize("threads", [1, 2])
def test_bits_of_the_program(scene, tmp_path, threads):
    random = np.random.default_rng(11)
    count = 10_001
    origins = (random.normal(size=(count, 3)) * 2).astype(np.float32)
    directions = (random.normal(size=(count, 3)) * 0.5 - origins).astype(np.float32)
    tmin = random.uniform(0, 1, count).astype(np.float32)
    tmax = random.uniform(0, 3, count).astype(np.float32)
    scene.save(tmp_path / "scene.bth")
    rays = np.concatenate([origins, tmin[:, None], directions, tmax[:, None]], 1)
    header = struct.pack("<IQ", 1, count)
    (tmp_path / "rays").write_bytes(b"RAYS" + header + rays.tobytes())
    command = [BTHC, "trace", tmp_path / "scene.bth", tmp_path / "rays"]
    for name, options in (("hits", []), ("any", ["--any"])):
        subprocess.run([*command, "-o", tmp_path / name, *options], check=True, capture_output=True)
    hits = scene.nearest(origins, directions, tmin, tmax, threads=threads)
    ours = np.stack([hits.t.view(np.uint32), hits.u.view(np.uint32), hits.v.view(np.uint32), hits.triangle], 1)
    data = (tmp_path / "hits").read_bytes()
    assert data[:16] == b"HITS" + header
    assert np.array_equal(ours, np.frombuffer(data[16:], np.uint32).reshape(count, 4))
    assert 0 < hits.hit.sum() < count
    rows = np.frombuffer((tmp_path / "any").read_bytes()[16:], np.uint32).reshape(count, 4)
    assert np.array_equal(scene.any(origins, directions, tmin, tmax, threads=threads), rows[:, 3] == 0)
