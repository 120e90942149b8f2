"""Plans run as farms run them, and give the bytes and pictures of one machine.

Usage: test_plan.py BTHC BTH_PLAY. Plans for Open Job Description need openjd-cli, those for Flamenco node.
"""

import json
import os
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

from models import model, scene

FARM = Path(__file__).with_name("bth-farm")

SBATCH = """#!/usr/bin/env bash
# Runs a job at once, with each number of its array, and prints a number as sbatch does.
array=
while [[ $1 == --* ]]; do
    [[ $1 != --array=* ]] || array=${1#--array=1-}
    [[ $1 != --dependency=* || $1 == --dependency=afterok:7 ]] || exit 1
    shift
done
for SLURM_ARRAY_TASK_ID in $(seq ${array:-1}); do
    SLURM_ARRAY_TASK_ID=$SLURM_ARRAY_TASK_ID bash "$@" >&2 || exit
done
echo 7
"""

MANAGER = """
const tasks = [];
const author = {
    Task: (name, type) => ({ name, type, commands: [], before: [],
        addCommand(command) { this.commands.push(command); }, addDependency(task) { this.before.push(task); } }),
    Command: (name, parameters) => ({ name, parameters }),
};
%s
if (typeof JOB_TYPE.label !== "string" || !Array.isArray(JOB_TYPE.settings)) throw new Error("no job type");
compileJob({ settings: {}, addTask: (task) => tasks.push(task) });
const done = new Set();
for (const task of tasks) {
    if (task.before.some((needed) => !done.has(needed))) throw new Error(`${task.name} comes too early`);
    for (const { name, parameters } of task.commands) {
        if (name !== "exec") throw new Error(name);
        require("child_process").execFileSync(parameters.exe, parameters.args, { stdio: ["ignore", 2, 2] });
    }
    done.add(task);
}
if (new Set(tasks.map((task) => task.name)).size !== tasks.length) throw new Error("two tasks of one name");
"""


def plan(*arguments, code=0):
    done = subprocess.run([sys.executable, FARM, "plan", *map(str, arguments)], capture_output=True, text=True)
    assert done.returncode == code, done
    return done.stdout


def run(format, text, folder):
    """Runs a plan as its farm would; False where what runs it is not installed."""
    file = folder / {"openjd": "plan.json", "flamenco": "plan.js"}.get(format, "plan.sh")
    if format == "flamenco":
        if not shutil.which("node"):
            return False
        file.write_text(MANAGER % text)
        command = [["node", file]]
    elif format == "openjd":
        openjd = Path(sys.executable).with_name("openjd")
        if not openjd.exists():
            return False
        file.write_text(text)
        command = [[openjd, "check", file], [openjd, "run", file]]
    else:
        file.write_text(text)
        command = [["bash" if format == "slurm" else "sh", file]]
    (folder / "bin").mkdir(exist_ok=True)
    (folder / "bin/sbatch").write_text(SBATCH)
    (folder / "bin/sbatch").chmod(0o755)
    environment = {**os.environ, "PATH": f"{folder / 'bin'}:{os.environ['PATH']}"}
    for line in command:
        done = subprocess.run(line, cwd="/", env=environment, capture_output=True, text=True)
        assert done.returncode == 0, (format, done.stdout[-2000:], done.stderr[-2000:])
    return True


def main():
    os.environ["BTHC"], os.environ["BTH_PLAY"] = bthc, bth_play = [str(Path(p).resolve()) for p in sys.argv[1:3]]
    skipped = []
    with tempfile.TemporaryDirectory(prefix="bth farm's ") as name:
        folder = Path(name)
        manifest = scene(folder, 3, 2)
        models = [folder / f"{i}.obj" for i in range(3)]
        play = ["--size", "90x50", "--spp", "2", "--mode", "path"]
        alone = {**os.environ, "BTH_NO_CACHE": "1"}
        in_parts = ["--set", "part-triangles=256"]
        (folder / "one").mkdir()
        subprocess.run([bthc, "compile", manifest, "-o", folder / "one.bth", "-q"], check=True, env=alone)
        subprocess.run([bthc, "compile", models[0], "-o", folder / "parts.bth", "-q", *in_parts], check=True, env=alone)
        subprocess.run([bthc, "compile", *models, "-o", folder / "one", "-q"], check=True, env=alone)
        subprocess.run([bth_play, folder / "one.bth", "-o", folder / "one/####.png", *play], check=True, stdout=subprocess.DEVNULL)
        expected = {path.name: path.read_bytes() for path in (folder / "one").iterdir()}
        assert len(expected) == 5, expected.keys()
        for format in ["commands", "slurm", "openjd", "flamenco"]:
            to = ["--to", format, "--cache-dir", folder / f"cache-{format}"]
            made, out = folder / f"{format}.bth", folder / format
            ran = run(format, plan("compile", manifest, "-o", made, "--parts", 2, *to), folder)
            if not ran:
                skipped.append(format)
                continue
            assert made.read_bytes() == (folder / "one.bth").read_bytes(), format
            run(format, plan("compile", models[0], "-o", folder / "p.bth", "--parts", 3, *to, "--", *in_parts), folder)
            assert (folder / "p.bth").read_bytes() == (folder / "parts.bth").read_bytes(), format
            run(format, plan("compile", *models, "-o", out, "--parts", 3, *to), folder)
            run(format, plan("render", made, "-o", out / "####.png", "--parts", 2, *to, "--", *play), folder)
            assert {path.name: path.read_bytes() for path in out.iterdir()} == expected, format
            shutil.rmtree(out)
            tiles = plan("render", made, "-o", out / "0000.png", "--tiles", "2x2", "--parts", 3, *to, "--", *play)
            run(format, tiles, folder)
            assert {path.name: path.read_bytes() for path in out.iterdir()} == {"0000.png": expected["0000.png"]}, format
        template = json.loads(plan("render", made, "-o", "a.png", "--tiles", "2x2", "--parts", 3, "--to", "openjd"))
        assert [step["name"] for step in template["steps"]] == ["parts", "whole"] and "jobEnvironments" not in template
    plan("render", "a.bth", "-o", "{{a}}.png", "--parts", 2, "--to", "openjd", code=2)
    plan("render", "a.bth", "-o", "a.png", "--tiles", "2", "--parts", 2, "--to", "slurm", code=2)
    for format in skipped:
        print(f"SKIPPED: the plan for {format}: nothing that runs it is installed")
    print("plans: same bytes, same pictures")


if __name__ == "__main__":
    main()
