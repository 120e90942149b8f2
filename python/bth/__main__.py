"""python -m bth compile|info|usd|ao|thickness|sight|lidar|sdf …"""

import argparse
import json
import os
import sys
from typing import Any

import bth
from bth import _usd_command
from bth._command import Parser, run
from bth.bake._progress import Bar
from bth.bake.commands import ao, lidar, sdf, sight, thickness


def _compile(arguments: argparse.Namespace) -> None:
    output = arguments.output or os.path.splitext(arguments.model)[0] + ".bth"
    with Bar() as bar:
        scene = bth.compile(arguments.model, output=output, quality=arguments.quality, progress=bar if bar.shown else None)
    print(f"{output}: {scene!r}")


def _facts(path: str, scene: bth.Scene) -> dict[str, Any]:
    frames, bounds = scene.frames, scene.bounds
    return {
        "file": path,
        "objects": scene.object_count,
        "instances": scene.instance_count,
        "triangles": int(scene.triangle_counts.sum()),
        "bytes": scene.nbytes,
        "resident_bytes": scene.resident_bytes,
        "content_id": scene.content_id,
        "bounds": None if bounds is None else bounds.tolist(),
        "frames": None if frames is None else dict(zip(("first", "last", "rate"), frames)),
    }


def _info(arguments: argparse.Namespace) -> None:
    if arguments.json:
        files = []
        for path in arguments.files:
            with bth.open(path) as scene:
                files.append(_facts(path, scene))
        print(json.dumps({"command": "info", "files": files}, indent=2))
        return
    for path in arguments.files:
        with bth.open(path) as scene:
            bounds = scene.bounds
            print(f"{path}: {scene!r}, {scene.nbytes} bytes, box {None if bounds is None else bounds.tolist()}, frames {scene.frames}")


def main(arguments: list[str] | None = None) -> int:
    parser = Parser(prog="python -m bth", description="Compiles models, shows what is in compiled files, and bakes what rays find out.")
    commands = parser.add_subparsers(required=True, metavar="COMMAND")
    compiler = commands.add_parser("compile", help="compile a model or a scene")
    compiler.add_argument("model")
    compiler.add_argument("-o", "--output")
    compiler.add_argument("--quality", choices=["fast", "balanced", "best"])
    compiler.set_defaults(run=_compile)
    info = commands.add_parser("info", help="what is in compiled files")
    info.add_argument("files", nargs="+")
    info.add_argument("--json", action="store_true", help="print one JSON object")
    info.set_defaults(run=_info)
    _usd_command.add_to(commands)
    for baker in (ao, thickness, sight, lidar, sdf):
        baker.add_to(commands)
    return run(parser, sys.argv[1:] if arguments is None else arguments)


if __name__ == "__main__":
    sys.exit(main())
