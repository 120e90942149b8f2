"""Distributes the work on models and scenes over the workers of a Dask cluster, or plans it for other farms.

The tasks are the ordinary programs with `--shard I/N`: `bthc compile --in-cache`, whose results go to a cache that all
workers share, and `bth-play`, whose frames go to a shared folder. Both skip what exists already, so a task may be run any
number of times: when a worker is lost, Dask runs its tasks elsewhere.
"""

import argparse
import json
import os
import shutil
import subprocess
import sys
import time
from pathlib import Path

import bth_farm_plan

RETRIES = 3
"""Times that a part is run again after its program failed, or after the worker was lost."""

USAGE, FAILED, LOST = 2, 1, 4


class Failure(Exception):
    """What ends the run: most often a part that failed, with the error of its program."""

    def __init__(self, message, code=FAILED):
        super().__init__(message)
        self.code = code

    def __reduce__(self):
        return Failure, (self.args[0], self.code)


def program(name):
    """The path of a program: named by a variable (`BTHC`, `BTH_PLAY`), else on the PATH, else built here."""
    variable = name.upper().replace("-", "_")
    named = os.environ.get(variable)
    target = Path(os.environ.get("CARGO_TARGET_DIR", Path(__file__).resolve().parents[2] / "target"))
    if named and not shutil.which(named):
        raise Failure(f"{named} is no program (hint: set {variable} to the path of {name})", USAGE)
    found = named or shutil.which(name) or shutil.which(name, path=str(target / "release"))
    if not found:
        raise Failure(f"{name} is not on the PATH (hint: cargo build --release, or set {variable})", USAGE)
    return found


def run_part(name, arguments, environment):
    """Runs a program on the calling worker and returns its JSON. Exit codes 2 to 5 are errors of the input, which would be
    the same on every worker, so they are returned rather than raised, and not tried again."""
    # The variables of the caller, not of the worker, so that all workers use one cache.
    command = [program(name), *arguments, "--json"]
    done = subprocess.run(command, env={**os.environ, **environment}, capture_output=True, text=True)
    if done.returncode == 0:
        return json.loads(done.stdout)
    lines = done.stderr.strip().splitlines() or [f"ended with {done.returncode}"]
    # Below an error about options is how to get help.
    said = next((line for line in lines if line.startswith("error: ")), lines[-1])
    failure = Failure(f"{' '.join(command)}: {said}", max(done.returncode, FAILED))
    if 2 <= done.returncode <= 5:
        return failure
    raise failure


def run_parts(client, parts, environment, on_done=lambda done: None):
    """Runs parts, each a program and its arguments; their JSON in order. `on_done` is called with the number of finished
    parts."""
    from distributed import as_completed
    from distributed.scheduler import KilledWorker

    futures = [
        client.submit(run_part, name, arguments, environment, pure=False, retries=RETRIES) for name, arguments in parts
    ]
    try:
        for done, future in enumerate(as_completed(futures), 1):
            result = future.result()
            if isinstance(result, Failure):
                raise result
            on_done(done)
        return client.gather(futures)
    except KilledWorker as lost:
        raise Failure(f"a part was lost with {RETRIES + 1} workers: {lost}", LOST) from lost
    finally:
        client.cancel(futures)


def shards(count):
    return [f"{i}/{count}" for i in range(1, count + 1)]


def run_here(name, arguments, environment):
    """Runs a program on this machine; its JSON."""
    done = run_part(name, arguments, environment)
    if isinstance(done, Failure):
        raise done
    return done


def compile_models(client, models, output, options, environment, count, on_done=lambda done: None):
    """Compiles models, or the objects of a scene and their parts, on all workers, then puts the files together here; the JSON
    of that."""
    models = [str(Path(model).resolve()) for model in models]
    parts = [("bthc", ["compile", *models, "--in-cache", "--shard", shard, *options]) for shard in shards(count)]
    objects = run_parts(client, parts, environment, on_done)
    done = run_here("bthc", ["compile", *models, "-o", str(output), *options], environment)
    jobs = [job for part in objects for job in part["jobs"]]
    # A model is one object, and the part that compiles it reports no number of objects.
    built = {"objects": sum(job.get("objects", 1) for job in jobs), "object_parts": sum(job.get("parts", 0) for job in jobs)}
    done["farm"] = {"parts": count, **built}
    return done


def render_frames(client, scene, output, options, environment, count, on_done=lambda done: None, tiles=None):
    """Renders the frames of a compiled scene, or their tiles, on all workers; the JSON of each part."""
    output = str(Path(output).absolute())
    render = [str(Path(scene).resolve()), "-o", output, *(["--tiles", tiles] if tiles else [])]
    parts = [("bth-play", [*render, "--shard", shard, *options]) for shard in shards(count)]
    done = {"output": output, "farm": {"parts": count}, "parts": run_parts(client, parts, environment, on_done)}
    if tiles:
        done["whole"] = run_here("bth-play", [*render, *options], environment)
    return done


def positive(text):
    """A number from 1, for argparse."""
    if not text.isdecimal() or int(text) == 0:
        raise argparse.ArgumentTypeError(f"expected a number from 1, found {text!r}")
    return int(text)


def tiles(text):
    """Columns and rows, for argparse."""
    if not all(part.isdecimal() and int(part) for part in text.split("x")) or text.count("x") != 1:
        raise argparse.ArgumentTypeError(f"expected COLUMNSxROWS, such as 4x2, found {text!r}")
    return text


def add_work(parser, work):
    """What both the work and its plan take."""
    if work == "compile":
        parser.add_argument("models", nargs="+", type=Path, metavar="MODEL", help="models, or one scene")
        parser.add_argument("-o", "--output", required=True, help="the compiled file, or the folder for several")
    else:
        parser.add_argument("models", nargs=1, type=Path, metavar="SCENE", help="a compiled scene or model")
        output = "numbered pictures, such as frames/####.png, in a folder that all see; with --tiles also one picture"
        parser.add_argument("-o", "--output", required=True, help=output)
        parser.add_argument("--tiles", type=tiles, metavar="CxR", help="share out the tiles of pictures, in columns and rows")
    parser.add_argument("--cache-dir", metavar="FOLDER", help="a cache that all workers see")
    parser.add_argument("--shared-cache", metavar="PLACE", help="a cache behind that of each worker")


WORK = {"compile": "compile models or the objects of a scene, then the files", "render": "render the frames of a scene"}


def arguments(argv):
    parser = argparse.ArgumentParser(prog="bth-farm", description=__doc__.splitlines()[0])
    commands = parser.add_subparsers(dest="command", required=True)
    passed_on = "What follows `--` is passed on to the program of each task."
    for work, about in WORK.items():
        sub = commands.add_parser(work, help=about, epilog=passed_on)
        add_work(sub, work)
        sub.add_argument("--scheduler", metavar="ADDRESS", help="of a Dask cluster; by default one is started on this machine")
        sub.add_argument("--workers", type=positive, metavar="N", help="workers of the cluster on this machine")
        sub.add_argument("--parts", type=positive, metavar="N", help="parts of the work; by default four for each worker")
        sub.add_argument("--json", action="store_true", help="print one JSON object")
    plan = commands.add_parser("plan", help="write the same work for another farm, on standard output")
    plans = plan.add_subparsers(dest="work", required=True)
    for work, about in WORK.items():
        sub = plans.add_parser(work, help=about, epilog=passed_on)
        add_work(sub, work)
        sub.add_argument("--parts", type=positive, metavar="N", required=True, help="parts of the work")
        sub.add_argument("--to", choices=bth_farm_plan.FORMATS, required=True, help="what runs it")
        sub.add_argument("--name", default="bth", help="of the jobs; bth by default")
    split = argv.index("--") if "--" in argv else len(argv)
    args = parser.parse_args(argv[:split])
    args.options = argv[split + 1 :]
    return args


def plan(args):
    """The text of a plan. Programs are on the PATH of workers, or at the paths that BTHC and BTH_PLAY name."""
    args.models = [str(path.resolve()) for path in args.models]
    args.output = str(Path(args.output).absolute())
    args.tiles = getattr(args, "tiles", None)
    steps = bth_farm_plan.steps(os.environ.get("BTHC", "bthc"), os.environ.get("BTH_PLAY", "bth-play"), args)
    return bth_farm_plan.FORMATS[args.to](steps, environment_of(args), args.name)


def environment_of(args):
    """The variables of the environment that the programs get."""
    wanted = {"BTH_CACHE_DIR": args.cache_dir, "BTH_SHARED_CACHE": args.shared_cache}
    names = ["BTH_CACHE_DIR", "BTH_SHARED_CACHE", "BTH_CACHE_SIZE", "BTH_TETGEN"]
    kept = {name: os.environ[name] for name in names if name in os.environ}
    given = {name: str(Path(value).absolute()) if "://" not in value else value for name, value in wanted.items() if value}
    return {**kept, **given}


def connect(args):
    from distributed import Client, LocalCluster

    if args.scheduler:
        try:
            return None, Client(args.scheduler, timeout="30s")
        except ValueError as error:
            raise Failure(f"--scheduler: {error} (hint: expected an address such as tcp://head:8786)", USAGE) from error
    workers = args.workers or os.cpu_count() or 1
    cluster = LocalCluster(n_workers=workers, threads_per_worker=1, processes=True, dashboard_address=None)
    return cluster, Client(cluster)


def main(argv=None):
    args = arguments(sys.argv[1:] if argv is None else argv)
    try:
        # bthc writes several files into a folder that is there.
        if len(args.models) > 1:
            Path(args.output).mkdir(parents=True, exist_ok=True)
    except OSError as error:
        print(f"error: {args.output} is no folder for {len(args.models)} models: {error}", file=sys.stderr)
        return LOST
    if args.command == "plan":
        try:
            sys.stdout.write(plan(args))
        except ValueError as error:
            print(f"error: {error}", file=sys.stderr)
            return USAGE
        return 0
    start = time.monotonic()
    cluster = client = None
    try:
        cluster, client = connect(args)
        count = args.parts or 4 * max(1, sum(client.ncores().values()))
        options = args.options
        if cluster and not any(option.startswith("--threads") for option in options):
            options += ["--threads", str(max(1, (os.cpu_count() or 1) // len(cluster.workers)))]

        def progress(done):
            if sys.stderr.isatty() and not args.json:
                print(f"\r{done} of {count} parts", end="" if done < count else "\n", file=sys.stderr, flush=True)

        if args.command == "compile":
            done = compile_models(client, args.models, args.output, options, environment_of(args), count, progress)
        else:
            environment = environment_of(args)
            done = render_frames(client, args.models[0], args.output, options, environment, count, progress, args.tiles)
        done["farm"]["seconds"] = time.monotonic() - start
    except (Failure, OSError) as error:
        code = error.code if isinstance(error, Failure) else LOST
        print(f"error: {error}", file=sys.stderr)
        if args.json:
            print(json.dumps({"error": {"message": str(error), "exit_code": code}}, indent=2))
        return code
    except KeyboardInterrupt:
        return 130
    finally:
        for part in (client, cluster):
            if part:
                part.close()
    if args.json:
        print(json.dumps(done, indent=2))
    else:
        print(f"wrote {args.output} in {done['farm']['parts']} parts, {done['farm']['seconds']:.1f} s")
    return 0
