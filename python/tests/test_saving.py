"""Files that are written: whole or not at all, with all names that the system has."""

import copy
import os
import stat
import sys
import threading

import pytest

import bth
import bth.bake


def test_failed_saves_leave_nothing(scene, tmp_path):
    folder = tmp_path / "folder"
    folder.mkdir()
    closed = copy.copy(scene)
    closed.close()
    with pytest.raises(ValueError, match="closed"):
        closed.save(tmp_path / "a.bth")
    with pytest.raises(OSError):
        scene.save(folder)
    assert list(tmp_path.iterdir()) == [folder] and not list(folder.iterdir())
    scene.save(os.fsencode(tmp_path / "a.bth"))
    threads = [threading.Thread(target=scene.save, args=(tmp_path / "a.bth",)) for _ in range(8)]
    failed = []
    before, threading.excepthook = threading.excepthook, failed.append
    try:
        [thread.start() for thread in threads]
        [thread.join() for thread in threads]
    finally:
        threading.excepthook = before
    assert not failed and sorted(tmp_path.iterdir()) == [tmp_path / "a.bth", folder]


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="no named pipes")
def test_saving_replaces_no_pipe(scene, tmp_path):
    os.mkfifo(tmp_path / "pipe")
    with pytest.raises(OSError, match="regular file"):
        scene.save(tmp_path / "pipe")
    with pytest.raises(IsADirectoryError):
        scene.save(tmp_path)
    assert stat.S_ISFIFO(os.stat(tmp_path / "pipe").st_mode) and os.listdir(tmp_path) == ["pipe"]


@pytest.mark.skipif(sys.platform != "linux", reason="/proc is that of Linux")
def test_saving_replaces_no_link_to_an_open_file(scene, tmp_path):
    """As /dev/stdout is one where the output goes to a file: no program would have it any more."""
    with open(tmp_path / "file", "wb") as file:
        (tmp_path / "stdout").symlink_to(f"/proc/self/fd/{file.fileno()}")
        with pytest.raises(OSError, match="open"):
            scene.save(tmp_path / "stdout")
    assert (tmp_path / "stdout").is_symlink() and sorted(os.listdir(tmp_path)) == ["file", "stdout"]


def test_names_as_long_as_they_can_be(scene, mesh, tmp_path):
    path = tmp_path / ("é" * 125 + "e.bth")
    scene.save(path)
    assert bth.open(path).content_id == scene.content_id and len(os.listdir(tmp_path)) == 1
    bth.bake.write_ply(path, {axis: column for axis, column in zip("xyz", mesh[0].T)}, mesh[1])
    with pytest.raises(FileNotFoundError) as error:
        scene.save(tmp_path / "missing" / "a.bth")
    assert error.value.filename == str(tmp_path / "missing" / "a.bth")


def test_paths_as_bytes(scene, mesh, tmp_path):
    class Path:
        def __init__(self, path):
            self.path = path

        def __fspath__(self):
            return os.fsencode(self.path)

    for path in (os.fsencode(tmp_path / "é.bth"), Path(tmp_path / "ü.bth")):
        scene.save(path)
        assert bth.open(path).content_id == bth.open(path, mmap=True).content_id == scene.content_id
        bth.compile(mesh, output=path)
    (tmp_path / "a.off").write_text("OFF 3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n")
    for path in (Path(tmp_path / "a.off"), os.fsencode(tmp_path / "a.off")):
        assert bth.compile(path, cache=False).triangle_counts == [1]
    for name in ("output", "shared_cache", "cache"):
        with pytest.raises(TypeError, match=f"^{name}: expected"):
            bth.compile(mesh, **{name: 5})
    for size, error in ((-1, ValueError), (2**64, ValueError), (1.5, TypeError)):
        with pytest.raises(error):
            bth.compile(mesh, cache_size=size)
