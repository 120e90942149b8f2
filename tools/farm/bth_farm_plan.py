"""Writes the work on scenes as files for programs that run it: a shell, Slurm, Open Job Description, or Flamenco.

The work is a list of steps. A step is a command, or the same command for parts 1 to N; it needs all steps before it.
"""

import json
import shlex
from dataclasses import dataclass

PART = "\0"
"""What stands for the number of the part in a command."""


@dataclass(frozen=True)
class Step:
    name: str
    command: list
    parts: int = 0
    """How often the command is run, with the numbers from 1; 0 is once and without a number."""

    def lines(self, part):
        """The command as words, with a number or with what stands for it."""
        return [word.replace(PART, str(part)) for word in self.command]


def steps(bthc, bth_play, args):
    """The steps of what `bth-farm compile` and `bth-farm render` do, for these options."""
    shard = ["--shard", f"{PART}/{args.parts}"]
    if args.work == "compile":
        compile = [bthc, "compile", *args.models]
        return [
            Step("parts", [*compile, "--in-cache", *shard, *args.options], args.parts),
            Step("whole", [*compile, "-o", args.output, *args.options]),
        ]
    render = [bth_play, *args.models, "-o", args.output, *(["--tiles", args.tiles] if args.tiles else [])]
    parts = [Step("parts", [*render, *shard, *args.options], args.parts)]
    # Tiles are put together.
    return parts + ([Step("whole", [*render, *args.options])] if args.tiles else [])


def exports(environment):
    return "".join(f"export {name}={shlex.quote(value)}\n" for name, value in environment.items())


def commands(steps, environment, _):
    """A script for a shell: its lines are the commands, and those of one step may run at once, on any machine."""
    text = "#!/bin/sh\n# The commands of one step may run at once, on any machine; a step needs the steps before it.\nset -e\n"
    text += exports(environment)
    for step in steps:
        text += f"\n# Step {step.name}\n"
        text += "".join(shlex.join(step.lines(part)) + "\n" for part in range(1, max(step.parts, 1) + 1))
    return text


def slurm(steps, environment, name):
    """A script that submits itself: a job array for each step, which waits for those before."""
    submit, run, after = "", "", ""
    for step in steps:
        array = f" --array=1-{step.parts}" if step.parts else ""
        submit += f'{step.name}=$(sbatch --parsable --job-name={shlex.quote(f"{name}-{step.name}")}{array}{after} "$0" {step.name})\n'
        after = f' --dependency=afterok:"${step.name}"'
        command = " ".join('"$SLURM_ARRAY_TASK_ID"'.join(map(shlex.quote, word.split(PART))) if PART in word else shlex.quote(word)
                           for word in step.command)
        run += f"    {step.name}) exec {command} ;;\n"
    return f"""#!/bin/bash
# Submits the jobs: bash FILE. Options of all jobs, such as --time, are lines #SBATCH here.
set -e
{exports(environment)}case ${{1:-submit}} in
{run}esac
{submit}echo "submitted {len(steps)} jobs"
"""


def openjd(steps, environment, name):
    """A job template of Open Job Description, version 2023-09."""
    written = []
    for step in steps:
        if any("{{" in word for word in step.command):
            raise ValueError("Open Job Description takes no {{ in paths and options")
        words = step.lines("{{Task.Param.Part}}")
        entry = {"name": step.name, "script": {"actions": {"onRun": {"command": words[0], "args": words[1:]}}}}
        if step.parts:
            part = {"name": "Part", "type": "INT", "range": f"1-{step.parts}"}
            entry["parameterSpace"] = {"taskParameterDefinitions": [part]}
        if written:
            entry["dependencies"] = [{"dependsOn": written[-1]["name"]}]
        written.append(entry)
    template = {"specificationVersion": "jobtemplate-2023-09", "name": name}
    if environment:
        template["jobEnvironments"] = [{"name": "bth", "variables": environment}]
    return json.dumps({**template, "steps": written}, indent=2) + "\n"


def flamenco(steps, environment, name):
    """A job type of Flamenco 3: for the folder `scripts` of its manager."""
    work = [
        {"name": step.name, "commands": [step.lines(part) for part in range(1, max(step.parts, 1) + 1)]} for step in steps
    ]
    # Commands of Flamenco have no variables of the environment.
    set_variables = ["/usr/bin/env", *(f"{key}={value}" for key, value in environment.items())] if environment else []
    return f"""// A job type of Flamenco: put this file into the folder `scripts` of the manager.
const JOB_TYPE = {{
    label: {json.dumps(name)},
    settings: [],
}};

const VARIABLES = {json.dumps(set_variables)};
const STEPS = {json.dumps(work, indent=4)};

function compileJob(job) {{
    let before = [];
    for (const step of STEPS) {{
        const tasks = [];
        for (let i = 0; i < step.commands.length; i++) {{
            const words = VARIABLES.concat(step.commands[i]);
            const task = author.Task(step.name + "-" + (i + 1), "misc");
            task.addCommand(author.Command("exec", {{ exe: words[0], args: words.slice(1) }}));
            for (const needed of before) task.addDependency(needed);
            job.addTask(task);
            tasks.push(task);
        }}
        before = tasks;
    }}
}}
"""


FORMATS = {"commands": commands, "slurm": slurm, "openjd": openjd, "flamenco": flamenco}
