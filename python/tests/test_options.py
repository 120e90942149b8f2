"""Options of the compiler: all of the program's that have a meaning here, checked, and with the same effect."""

import ast
import inspect
import os
import pathlib
import re
import struct
import subprocess

import models
import numpy as np
import pytest
from test_bits import BTHC

import bth
from bth import _compile

PAGE = pathlib.Path(__file__).resolve().parents[2] / "docs" / "reference.md"
#: Options of `bthc compile` that a function has no use for, and those that have another name.
OTHERS = {
    "jobs", "dry-run", "depfile", "end-with-input", "format", "watch", "shard", "json", "quiet", "in-cache", "no-cache", "cache-dir", "no-geometry",
    "help", "version", "isa", "set",
}
OURS = {"cache", "geometry", "progress", "settings"}


@pytest.mark.skipif(not PAGE.exists(), reason="not in the repository")
def test_all_options_of_the_program():
    section = re.search(r"^## bthc compile\n(.*?)^## ", PAGE.read_text(), re.S | re.M)[1]
    rows = [re.split(r"(?<!\\)\|", line)[1] for line in section.splitlines() if line.startswith("| `")]
    options = {name for row in rows for name in re.findall(r"--([a-z][a-z-]*)", row)}
    parameters = {name.replace("_", "-") for name in inspect.signature(bth.compile).parameters} - {"model"} - OURS
    assert options - OTHERS == parameters


@pytest.fixture
def path(tmp_path):
    models.write_obj(tmp_path / "parts.obj", *models.parts())
    return tmp_path / "parts.obj"


@pytest.mark.skipif(not BTHC.exists(), reason=f"there is no {BTHC}")
@pytest.mark.parametrize("options", [
    {}, {"names": True, "attributes": "all"}, {"attributes": "normals", "geometry": False}, {"coordinates": 16},
    {"max_error": "0.01%"}, {"quality": "best", "threads": 1}, {"alpha": "blend"}, {"deformable": True},
    {"free_directions": "all", "settings": {"free-reach": 0.25, "poses": 2}}, {"free_directions": "distances"}, {"memory": 100},
])
def test_bytes_of_the_program(path, options):
    command = [BTHC, "compile", path, "-o", path.with_suffix(".bth"), "--structure", "bvh", "--no-cache", "--quiet"]
    for name, value in options.items():
        if name == "settings":
            command += [f"--set={key}={number}" for key, number in value.items()]
            continue
        name = "--" + name.replace("_", "-")
        command += ["--no-geometry"] if name == "--geometry" else [name] if value is True else [name, str(value)]
    subprocess.run(command, check=True)
    assert bth.compile(path, cache=False, **options).to_bytes() == path.with_suffix(".bth").read_bytes()


def test_concave_polygons(tmp_path):
    (tmp_path / "arrow.obj").write_text("v 2 -1 0\nv 1 0 0\nv 2 1 0\nv 0 0 0\nf 1 2 3 4\n")
    in_notch = [[1.5, 0, 1]], [[0, 0, -1]]
    assert bth.compile(tmp_path / "arrow.obj").any(*in_notch).tolist() == [True]
    assert bth.compile(tmp_path / "arrow.obj", polygons="ears").any(*in_notch).tolist() == [False]


@pytest.mark.skipif(not BTHC.exists(), reason=f"there is no {BTHC}")
def test_known_rays(path):
    random = np.random.default_rng(3)
    origins, directions = random.normal(size=(2, 500, 3)).astype(np.float32)
    rows = np.hstack([origins, np.full((500, 1), 0.5), directions, np.full((500, 1), 9)]).astype("<f4")
    file = path.with_suffix(".rays")
    file.write_bytes(b"RAYS" + struct.pack("<IQ", 1, 500) + rows.tobytes())
    command = [BTHC, "compile", path, "-o", path.with_suffix(".bth"), "--structure", "bvh", "--no-cache"]
    subprocess.run([*command, "--quiet", "--rays", file], check=True)
    scene = bth.compile(path, cache=False, rays=(origins, directions, 0.5, np.full(500, 9)))
    assert scene.to_bytes() == path.with_suffix(".bth").read_bytes()
    assert scene.to_bytes() != bth.compile(path, cache=False).to_bytes()


def test_wrong_known_rays(path, tmp_path):
    with pytest.raises(ValueError, match="none of 1"):
        bth.compile(path, rays=([[0, 0, 0]], [[0, 0, 0]]))
    for wrong in (3, ([0, 0, 0],), "ab"):
        with pytest.raises(TypeError, match="rays"):
            bth.compile(path, rays=wrong)
    (tmp_path / "a.manifest").write_text("version = 1\n")
    with pytest.raises(ValueError, match="is a scene"):
        bth.compile(tmp_path / "a.manifest", rays=([[0, 0, 0]], [[0, 0, 1]]))


@pytest.mark.parametrize("options, error", [
    ({"alpha": "holes"}, ValueError), ({"polygons": "delaunay"}, ValueError), ({"attributes": "colours"}, ValueError), ({"names": "yes"}, TypeError), ({"threads": -1}, ValueError),
    ({"threads": 5000}, ValueError), ({"threads": 1.5}, TypeError), ({"settings": {"tet-deadline": 0}}, ValueError), ({"settings": {"tet_memory": 1}}, ValueError),
    ({"memory": 0}, ValueError), ({"settings": {"c-tet": float("nan")}}, ValueError), ({"settings": 3}, TypeError), ({"settings": {"speed": 3}}, ValueError),
    ({"max_error": "much"}, ValueError), ({"cache_size": "large", "cache": True}, ValueError), ({"cache": 3.5}, TypeError),
    ({"progress": 3}, TypeError), ({"rate": 0}, ValueError),
    ({"cache": False, "shared_cache": "x"}, ValueError), ({"output": 7}, TypeError),
    ({"shared_cache": "s3://bucket/prefix"}, ValueError),
])
def test_wrong_options(path, tmp_path, options, error):
    if options.get("cache") is True or "shared_cache" in options and "cache" not in options:
        options = {**options, "cache": tmp_path / "cache"}
    with pytest.raises(error) as raised:
        bth.compile(path, **options)
    if error is not OSError:
        names = [name for name in options if name != "cache"] or ["cache"]
        assert any(name in str(raised.value) for name in names) or error is TypeError


def test_shared_caches(path, tmp_path):
    shared, size = tmp_path / "shared", "64MiB"
    shared.mkdir()
    first = bth.compile(path, cache=tmp_path / "one", shared_cache=shared, cache_size=size)
    kept = {file for _, _, files in os.walk(shared) for file in files}
    assert kept and bth.compile(path, cache=tmp_path / "two", shared_cache=str(shared), cache_size=1 << 26).to_bytes() == first.to_bytes()


def test_shared_caches_of_the_environment(path, tmp_path, monkeypatch):
    (tmp_path / "shared").mkdir()
    monkeypatch.setenv("BTH_SHARED_CACHE", str(tmp_path / "shared"))
    first = bth.compile(path, cache=tmp_path / "one")
    assert any(files for _, _, files in os.walk(tmp_path / "shared"))
    monkeypatch.setenv("BTH_SHARED_CACHE", "s3://bucket/prefix")
    with pytest.warns(UserWarning, match="BTH_SHARED_CACHE") as warned:
        assert bth.compile(path, cache=tmp_path / "two").to_bytes() == first.to_bytes()
    assert warned[0].filename == __file__


def test_progress_and_cancelling(path):
    stages = []
    big = models.parts(count=30000)
    corners = big[0].reshape(-1, 3)
    bth.compile((corners, [[3 * i, 3 * i + 1, 3 * i + 2] for i in range(30000)]), quality="best", progress=lambda *a: stages.append(a))
    assert all(isinstance(stage, str) and done >= 0 and (total is None or total >= 0) for stage, done, total in stages)

    def cancel(*_):
        raise RuntimeError("no more")

    with pytest.raises(RuntimeError, match="no more"):
        for _ in range(50):
            bth.compile((corners, [[3 * i, 3 * i + 1, 3 * i + 2] for i in range(30000)]), quality="best", progress=cancel)


def test_stubs_have_the_options():
    stub = pathlib.Path(bth.__file__).parent / "_compile.pyi"
    functions = {f.name: {a.arg for a in f.args.kwonlyargs} for f in ast.parse(stub.read_text()).body if isinstance(f, ast.FunctionDef)}
    parameters = set(inspect.signature(bth.compile).parameters) - {"model"}
    assert functions["compile"] == parameters
    parameters |= {"mesh_names", "instance_names"}
    assert functions["compile_scene"] == parameters - {"flatten", "scene", "animation", "rate", "at_rest", "rigid_parts", "strict", "rays"}


def test_threads_of_all_calls_are_those_of_compilations(monkeypatch, mesh):
    used = []
    monkeypatch.setattr(_compile._native, "processors", lambda: 8)
    monkeypatch.setattr(_compile._native, "compile_mesh", lambda *arguments: used.append(arguments[-1].get("threads")) or scene._native)
    scene = bth.compile_scene([mesh])
    monkeypatch.setenv("BTH_THREADS", "3")
    bth.compile(mesh), bth.compile(mesh, threads=5), bth.compile(mesh, threads=0)
    bth.set_threads(2)
    try:
        bth.compile(mesh)
        # As many as there are processors are those that all calls share.
        bth.set_threads(9)
        bth.compile(mesh)
    finally:
        bth.set_threads(None)
    monkeypatch.delenv("BTH_THREADS")
    bth.compile(mesh)
    assert used == [3, 5, 0, 2, None, None]


@pytest.mark.skipif(not PAGE.exists(), reason="not in the repository")
def test_outputs_replace_no_input(path, tmp_path):
    """Neither the model nor a file that it names, nor that of an option."""
    library = tmp_path / "parts.mtl"
    library.write_text("newmtl a\nKd 1 0 0\n")
    path.write_text("mtllib parts.mtl\n" + path.read_text())
    before = [file.read_bytes() for file in (path, library)]
    for output, options in ((path, {}), (library, {"materials": True})):
        with pytest.raises(ValueError, match="output: .* would replace .*hint"):
            bth.compile(path, output=output, cache=False, **options)
    assert [file.read_bytes() for file in (path, library)] == before
