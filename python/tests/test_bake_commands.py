"""The bakers as commands: results, pictures, exit codes, and files that appear whole or not at all."""

import json
import os
import signal
import subprocess
import sys
import time

import numpy as np
import pytest
from conftest import sphere

import bth.bake
from bth.__main__ import main

Image = pytest.importorskip("PIL.Image")

CALLS = {
    "ao": (["-o", "out.ply", "--rays", "8"], "points"),
    "thickness": (["-o", "out.ply", "--rays", "8"], "median"),
    "sight": (["-o", "out.npy", "--from=0,3,0", "--from", "0.1,0.1"], "points_seen"),
    "lidar": (["-o", "out.ply", "--at=-1.5,0,0", "--columns", "64", "--noise", "0.01"], "points"),
    "sdf": (["-o", "out.npz", "--resolution", "8"], "spacing"),
}


@pytest.fixture
def folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    vertices, faces = sphere()
    x, y, z = vertices.T
    bth.bake.write_ply("ball.ply", {"x": x, "y": y, "z": z}, faces)
    return tmp_path


def call(capsys, *arguments):
    code = main(list(arguments))
    return code, *capsys.readouterr()


@pytest.mark.parametrize("command", CALLS)
def test_a_result_a_picture_and_a_summary(folder, capsys, command):
    options, key = CALLS[command]
    code, out, err = call(capsys, command, "ball.ply", *options, "--picture", "p.png", "--size", "64x48", "--json")
    assert (code, err) == (0, "")
    summary = json.loads(out)
    assert summary["command"] == command and summary["output"] == options[1] and summary[key] > 0 and summary["seconds"] >= 0
    picture = np.asarray(Image.open("p.png"))
    assert picture.shape == (48 + 42, 64, 3) and len(np.unique(picture[:48].reshape(-1, 3), axis=0)) > 10
    assert sorted(os.listdir()) == sorted(["ball.ply", options[1], "p.png"])
    first = open(options[1], "rb").read()
    code, out, err = call(capsys, command, "ball.ply", *options, "--quiet", "--threads", "3")
    assert (code, out, err) == (0, "", "") and open(options[1], "rb").read() == first


def test_what_is_in_files_as_json(folder, capsys):
    scene = bth.compile("ball.ply", output="ball.bth")
    with open("empty.obj", "w") as file:
        file.write("v 0 0 0\n")
    bth.compile("empty.obj", output="empty.bth")
    code, out, err = call(capsys, "info", "ball.bth", "empty.bth", "--json")
    assert (code, err) == (0, "")
    found = json.loads(out)
    assert list(found) == ["command", "files"] and found["command"] == "info"
    ball, empty = found["files"]
    assert ball == {
        "file": "ball.bth", "objects": 1, "instances": 1, "triangles": len(sphere()[1]), "bytes": os.path.getsize("ball.bth"),
        "resident_bytes": scene.resident_bytes, "content_id": scene.content_id, "bounds": scene.bounds.tolist(), "frames": None,
    }
    assert (empty["triangles"], empty["bounds"]) == (0, None)
    code, out, err = call(capsys, "info", "ball.bth", "no such file.bth", "--json")
    assert code == 4 and json.loads(out)["error"]["exit_code"] == 4


def test_what_is_written(folder, capsys):
    assert main(["ao", "ball.ply", "-o", "a.npy", "-q"]) == main(["ao", "ball.ply", "-o", "a.ply", "-q"]) == 0
    assert (np.load("a.npy") == 1).all() and len(np.load("a.npy")) == len(sphere()[0])
    again = bth.compile("a.ply")
    assert (again.vertices() == bth.compile("ball.ply").vertices()).all()
    assert main(["sdf", "ball.ply", "-o", "v.npz", "--resolution", "9", "-q"]) == 0
    with np.load("v.npz") as volume:
        expected = bth.bake.sdf(again, 9)
        assert (volume["distance"] == expected.distance).all() and volume["spacing"] == expected.spacing
        assert (volume["origin"] == expected.origin).all()
    assert main(["compile", "ball.ply"]) == 0 and main(["thickness", "ball.bth", "-o", "t.npy", "-q"]) == 0
    os.makedirs("d.x")
    os.link("ball.ply", "d.x/ball")
    assert main(["compile", "d.x/ball"]) == 0 and sorted(os.listdir("d.x")) == ["ball", "ball.bth"]
    capsys.readouterr()
    code, out, _ = call(capsys, "sight", "ball.ply", "--from=0,3,0", "--to=0,-3,0", "--to=1,3,0", "--json")
    assert code == 0 and json.loads(out)["seen"] == [[False, True]]


@pytest.mark.parametrize("arguments", [
    ["compile", "ball.ply", "-o", "./ball.ply"], ["compile", "room.manifest", "-o", "d/../ball.ply"], ["compile", "room.manifest", "-o", "room.manifest"],
    ["compile", "link.ply", "-o", "ball.ply"], ["ao", "ball.ply", "-o", "ball.ply"], ["thickness", "room.manifest", "-o", "link.ply"],
])
def test_nothing_that_is_read_is_replaced(folder, capsys, arguments):
    os.mkdir("d")
    os.symlink("ball.ply", "link.ply")
    (folder / "room.manifest").write_text("""
        version = 1
        objects = [{ name = "ball", model = "ball.ply" }]
        nodes = [{ name = "ball", object = "ball" }]
    """)
    before = {name: open(name, "rb").read() for name in ("ball.ply", "room.manifest")}
    code, out, err = call(capsys, *arguments)
    assert (code, out) == (2, "") and "BTH-U001" in err and "would replace" in err and "hint: " in err
    assert {name: open(name, "rb").read() for name in before} == before and os.path.islink("link.ply")
    # A compiled file that is there already is no reason to refuse.
    assert main(["compile", "ball.ply"]) == main(["compile", "ball.ply"]) == 0


def test_the_result_and_the_picture_are_two_files(folder, capsys):
    code, _, err = call(capsys, "ao", "ball.ply", "-o", "a.png", "--texture", "8x8", "--picture", "./a.png")
    assert code == 2 and "both" in err and not os.path.exists("a.png")


@pytest.mark.parametrize("arguments, exit_code, code", [
    (["ao", "ball.ply"], 2, "BTH-U001"),
    (["ao", "ball.ply", "-o", "out.txt"], 2, "BTH-U001"),
    (["ao", "ball.ply", "-o", "out.ply", "--rays", "0"], 2, "BTH-U001"),
    (["ao", "ball.ply", "-o", "out.ply", "--colour"], 2, "BTH-U001"),
    (["ao", "ball.ply", "-o", "out.ply", "--frame", "3"], 2, "BTH-U001"),
    (["ao", "ball.ply", "-o", "out.png"], 3, "BTH-P001"),
    (["ao", "none.ply", "-o", "out.ply"], 4, "BTH-O001"),
    (["ao", "none.bth", "-o", "out.ply"], 4, "BTH-O001"),
    (["ao", "bad.ply", "-o", "out.ply"], 3, None),
    (["ao", "bad.bth", "-o", "out.ply"], 3, "BTH-F"),
    (["ao", "ball.ply", "-o", "no/folder/out.ply"], 4, "BTH-O001"),
    (["sight", "ball.ply", "--from", "9,9", "-o", "out.ply"], 2, "BTH-U001"),
    (["sight", "ball.ply", "-o", "out.ply"], 2, "BTH-U001"),
    (["lidar", "ball.ply", "--at", "1,2", "-o", "out.ply"], 2, "BTH-U001"),
    (["sdf", "ball.ply", "--slice", "w", "-o", "out.npz"], 2, "BTH-U001"),
    (["sdf", "ball.ply", "--slice", "x=99", "--picture", "out.png"], 2, "BTH-U001"),
    (["thickness", "ball.ply", "--camera", "0,0,0,0,0,0", "--picture", "out.png"], 2, "BTH-U001"),
    (["dance"], 2, "BTH-U001"),
])
def test_errors(folder, capsys, arguments, exit_code, code):
    (folder / "bad.ply").write_text("ply\nnothing\n")
    (folder / "bad.bth").write_bytes(b"nothing")
    found, out, err = call(capsys, *arguments, "--json")
    error = json.loads(out)["error"]
    assert found == error["exit_code"] == exit_code and "error: " in err and "Traceback" not in err
    assert code is None or error["code"].startswith(code)
    assert not [name for name in os.listdir() if name.startswith("out")]


def test_help_names_every_option(capsys):
    for command in CALLS:
        with pytest.raises(SystemExit) as end:
            main([command, "--help"])
        assert end.value.code == 0 and "--picture" in capsys.readouterr().out


def test_failed_writes_leave_what_was_there(folder, monkeypatch):
    from bth.bake._files import write_whole

    (folder / "out.ply").write_text("before")

    def fail(file):
        file.write(b"half")
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        write_whole("out.ply", fail)
    assert (folder / "out.ply").read_text() == "before" and sorted(os.listdir()) == ["ball.ply", "out.ply"]
    os.symlink("out.ply", "link.ply")
    write_whole("link.ply", lambda file: file.write(b"after"))
    assert os.path.islink("link.ply") and (folder / "out.ply").read_text() == "after"


@pytest.mark.skipif(not hasattr(os, "openpty"), reason="no terminals")
def test_a_bar_on_a_terminal_and_ctrl_c(folder):
    arguments = [sys.executable, "-m", "bth", "ao", "ball.ply", "-o", "out.ply", "--rays", "1000000", "--json"]
    leader, follower = os.openpty()
    # Scripts start what runs in the background with interrupts ignored, which a child would inherit.
    child = subprocess.Popen(
        arguments, stdout=subprocess.PIPE, stderr=follower, preexec_fn=lambda: signal.signal(signal.SIGINT, signal.SIG_DFL)
    )
    os.close(follower)
    shown, deadline = b"", time.monotonic() + 120
    while b"ambient occlusion [" not in shown:
        assert time.monotonic() < deadline, shown
        shown += os.read(leader, 4096)
    child.send_signal(signal.SIGINT)
    out = child.communicate(timeout=60)[0]
    os.close(leader)
    assert child.returncode == 130 and json.loads(out)["error"]["exit_code"] == 130
    assert os.listdir() == ["ball.ply"]


def test_without_pillow_there_is_a_hint_before_anything_is_computed(folder, monkeypatch, capsys):
    monkeypatch.setitem(sys.modules, "PIL", None)
    code, _, err = call(capsys, "sdf", "ball.ply", "-o", "out.npz", "--picture", "p.png")
    assert code == 4 and "pip install pillow" in err and os.listdir() == ["ball.ply"]
    assert main(["sdf", "ball.ply", "-o", "out.npz", "--resolution", "4", "-q"]) == 0


def test_a_reader_that_goes_away_is_no_error(folder):
    reader, writer = os.pipe()
    os.close(reader)
    arguments = [sys.executable, "-m", "bth", "ao", "ball.ply", "-o", "out.ply", "--rays", "4"]
    child = subprocess.run(arguments, stdout=writer, stderr=subprocess.PIPE)
    os.close(writer)
    assert (child.returncode, child.stderr) == (0, b"") and os.path.exists("out.ply")


def test_the_same_bits_with_other_instructions(folder):
    """With plain code of the library, and numpy without its dispatched code where it has any. Names that numpy does not know are left out by it."""
    plain = {"BTH_ISA": "scalar", "NPY_DISABLE_CPU_FEATURES": "X86_V4 X86_V3 AVX512_SKX AVX512F AVX2 FMA3"}
    results = []
    for environment in ({}, plain):
        for command in (["ao", "--rays", "64", "--side", "back", "--distance", "1.2"], ["thickness", "--reduce", "diameter"]):
            arguments = [sys.executable, "-m", "bth", *command, "ball.ply", "-o", f"{command[0]}.npy", "-q"]
            subprocess.run(arguments, check=True, env={**os.environ, **environment}, stderr=subprocess.DEVNULL)
            results.append((folder / f"{command[0]}.npy").read_bytes())
    assert results[:2] == results[2:] and len(set(np.load("ao.npy"))) > 3


def test_what_is_told_of_a_room(folder, capsys):
    vertices, faces = sphere()
    x, y, z = vertices.T
    bth.bake.write_ply("room.ply", {"x": x, "y": y, "z": z}, faces[:, ::-1])
    code, _, err = call(capsys, "ao", "room.ply", "-o", "room-ao.ply", "--rays", "4")
    assert code == 0 and err.startswith("warning: 100 % of the points are black") and err.count("\n") == 1
    assert "--distance) counts near occluders only, such as 0.4 of a room's 2" in err and "--side both" in err
    for options in (["--distance", "0.1"], ["--side", "both"], ["--quiet"]):
        assert call(capsys, "ao", "room.ply", "-o", "room-ao.ply", "--rays", "4", *options)[::2] == (0, "")


def test_a_picture_from_inside(folder, capsys):
    vertices, faces = sphere()
    x, y, z = vertices.T
    bth.bake.write_ply("room.ply", {"x": 3 * x, "y": y, "z": z}, faces[:, ::-1])
    options = ["--rays", "4", "--distance", "0.5", "--size", "64x48", "--quiet", "--picture"]
    assert call(capsys, "ao", "room.ply", *options, "in.png", "--inside")[::2] == (0, "")
    assert call(capsys, "ao", "room.ply", *options, "out.png")[::2] == (0, "")
    background = np.asarray(Image.open("out.png"))[0, 0]
    inside, outside = (np.asarray(Image.open(name))[:48] for name in ("in.png", "out.png"))
    assert not (inside == background).all(axis=-1).any() and (outside == background).all(axis=-1).any()
    code, _, err = call(capsys, "ao", "room.ply", *options, "in.png", "--inside", "--camera", "0,0,0,1,0,0")
    assert code == 2 and "--inside" in err


def test_positions_far_from_the_origin_are_written_in_double_precision(folder, capsys):
    vertices, faces = sphere()
    x, y, z = vertices.T.astype(np.float64) + [[5e6], [5e6], [0]]
    bth.bake.write_ply("far.ply", {"x": x, "y": y, "z": z}, faces)
    assert call(capsys, "ao", "far.ply", "-o", "far-ao.ply", "--rays", "4", "--quiet") == (0, "", "")
    assert b"property double x" in open("far-ao.ply", "rb").read(400)
    written = bth.compile("far-ao.ply", cache=False)
    assert sorted(written.vertices().tolist()) == sorted(np.stack([x, y, z], axis=-1).tolist())
    assert call(capsys, "ao", "ball.ply", "-o", "ball-ao.ply", "--rays", "4", "--quiet") == (0, "", "")
    assert b"property float x" in open("ball-ao.ply", "rb").read(400)


def test_what_is_told_of_open_surfaces(folder, capsys):
    vertices, faces = sphere()
    x, y, z = vertices.T
    bth.bake.write_ply("bowl.ply", {"x": x, "y": y, "z": z}, faces[4:])
    code, out, err = call(capsys, "sdf", "bowl.ply", "-o", "bowl.npz", "--resolution", "4", "--json")
    assert code == 0 and err.startswith("warning: object 0 is not closed") and err.count("\n") == 1 and not json.loads(out)["closed"]
    assert call(capsys, "sdf", "bowl.ply", "-o", "bowl.npz", "--resolution", "4", "--quiet") == (0, "", "")
