"""python -m bth usd: scenes of USD, compiled or as a manifest."""

import argparse
import os
from typing import Any


def add_to(commands: Any) -> None:
    parser = commands.add_parser("usd", help="compile a scene of USD (usd, usda, usdc, usdz), or write its manifest")
    parser.add_argument("stage")
    parser.add_argument("-o", "--output", required=True, help="the compiled file (.bth), or a folder for a manifest and what it refers to")
    parser.add_argument("--subdivision", type=int, default=0, metavar="LEVELS", help="of Catmull-Clark surfaces (0: control cages)")
    parser.set_defaults(run=_run)


def _run(arguments: argparse.Namespace) -> None:
    # The library of USD is needed by this command alone.
    from .usd import compile, convert

    if os.path.splitext(arguments.output)[1] == ".bth":
        scene = compile(arguments.stage, arguments.output, subdivision=arguments.subdivision)
        print(f"{arguments.output}: {scene!r}")
        return
    made = convert(arguments.stage, arguments.output, subdivision=arguments.subdivision)
    print(made.manifest)
    for what, count in made.dropped.items():
        print(f"{count} × {what}")
