"""Three workers, one of them killed mid-way: the same bytes and frames as on one machine.

Usage: test_farm.py BTHC BTH_PLAY
"""

import contextlib
import io
import json
import os
import signal
import subprocess
import sys
import tempfile
from pathlib import Path

from distributed import Client, LocalCluster

import bth_farm
from models import model, scene

OBJECTS = 9
FRAMES = 12


def kill_one(cluster, after):
    """Kills a worker's process when so many parts are done. Its nanny starts another one, as a farm would."""
    killed = []

    def on_done(done):
        if done >= after and not killed:
            worker = cluster.workers[0]
            killed.append(worker.pid)
            os.kill(worker.pid, signal.SIGKILL)

    return killed, on_done


def frames(folder):
    return {path.name: path.read_bytes() for path in sorted(folder.iterdir())}


def main():
    os.environ["BTHC"], os.environ["BTH_PLAY"] = (str(Path(p).resolve()) for p in sys.argv[1:3])
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        manifest = scene(folder, OBJECTS, FRAMES)
        play = ["--size", "96x54", "--spp", "4", "--threads", "1"]
        env = {**os.environ, "BTH_NO_CACHE": "1"}
        subprocess.run([os.environ["BTHC"], "compile", manifest, "-o", folder / "one.bth", "-q"], check=True, env=env)
        (folder / "one").mkdir()
        alone = [os.environ["BTH_PLAY"], folder / "one.bth", "-o", folder / "one/####.png", *play]
        subprocess.run(alone, check=True, stdout=subprocess.DEVNULL)

        with LocalCluster(n_workers=3, threads_per_worker=1, processes=True, dashboard_address=None) as cluster:
            with Client(cluster) as client:
                shared = {"BTH_CACHE_DIR": str(folder / "cache")}
                killed, on_done = kill_one(cluster, 2)
                done = bth_farm.compile_models(
                    client, [manifest], folder / "farm.bth", ["--threads", "1"], shared, OBJECTS, on_done
                )
                assert killed, "no worker was killed"
                assert done["farm"]["objects"] == OBJECTS, done["farm"]
                assert done["jobs"][0]["cache"]["hits"] == {"object": OBJECTS}, done["jobs"]
                assert (folder / "farm.bth").read_bytes() == (folder / "one.bth").read_bytes(), "other bytes"

                (folder / "farm").mkdir()
                killed, on_done = kill_one(cluster, 1)
                bth_farm.render_frames(
                    client, folder / "farm.bth", folder / "farm/####.png", play, shared, 6, on_done
                )
                assert killed, "no worker was killed"
                one, farm = frames(folder / "one"), frames(folder / "farm")
                assert len(one) == FRAMES and one == farm, "other frames"

                (folder / "4.obj").write_text("f 1 2 3\n")
                try:
                    bth_farm.compile_models(client, [manifest], folder / "x.bth", [], shared, 3)
                except bth_farm.Failure as failure:
                    assert failure.code == 3 and "4.obj:1" in str(failure), failure
                else:
                    raise AssertionError("a faulty model was compiled")
        (folder / "4.obj").write_text(model(80))
        farm = [sys.executable, Path(__file__).with_name("bth-farm"), "compile", manifest, "-o", folder / "local.bth"]
        local = [*farm, "--workers", "2", "--cache-dir", folder / "cache", "--json", "--", "--quality", "fast"]
        done = json.loads(subprocess.run(local, check=True, stdout=subprocess.PIPE).stdout)
        assert done["farm"]["objects"] == OBJECTS and (folder / "local.bth").exists(), done["farm"]
        single = [*farm[:3], folder / "0.obj", "-o", folder / "0.bth", "--workers", "1", "--parts", "2", "--json"]
        done = json.loads(subprocess.run(single, check=True, stdout=subprocess.PIPE).stdout)
        assert (done["farm"]["parts"], done["farm"]["objects"]) == (2, 1), done["farm"]
        done = json.loads(subprocess.run([*single, "--", "--set", "part-triangles=256"], check=True, stdout=subprocess.PIPE).stdout)
        assert done["farm"]["object_parts"] == done["jobs"][0]["cache"]["hits"]["part"] == 16, done
        several = [*farm[:3], folder / "0.obj", folder / "1.obj", "-o", folder / "out", "--workers", "2", "--json"]
        done = json.loads(subprocess.run(several, check=True, stdout=subprocess.PIPE).stdout)
        assert len(done["jobs"]) == 2 and (folder / "out/1.bth").read_bytes()[:3] == (folder / "0.bth").read_bytes()[:3]
        tiled = [*farm[:2], "render", folder / "0.bth", "-o", folder / "still.png", "--tiles", "2x2", "--workers", "2", "--json"]
        subprocess.run([*tiled, "--", *play], check=True, stdout=subprocess.DEVNULL)
        alone = [os.environ["BTH_PLAY"], folder / "0.bth", "-o", folder / "alone.png", *play]
        subprocess.run(alone, check=True, stdout=subprocess.DEVNULL)
        assert (folder / "still.png").read_bytes() == (folder / "alone.png").read_bytes(), "another picture"
        for wrong in ["--parts=-3", "--workers=0"]:
            assert subprocess.run([*farm, wrong], stderr=subprocess.DEVNULL).returncode == 2, wrong
        for address in ["head", "nothing://head:8786"]:
            said = io.StringIO()
            with contextlib.redirect_stderr(said):
                code = bth_farm.main(["compile", str(manifest), "-o", "x.bth", "--scheduler", address])
            assert code == 2 and said.getvalue().startswith("error: --scheduler: "), said.getvalue()
        failure = bth_farm.run_part("bthc", ["compile", str(manifest), "--nothing"], {})
        assert failure.code == 2 and "'--nothing'" in str(failure), failure
        os.environ["BTHC"] = str(folder / "absent")
        try:
            bth_farm.run_part("bthc", ["--version"], {})
        except bth_farm.Failure as failure:
            assert failure.code == 2 and "absent is no program" in str(failure), failure
        else:
            raise AssertionError("a program that is not there was run")
    print("three workers, one killed mid-way, twice: same bytes, same frames")


if __name__ == "__main__":
    main()
