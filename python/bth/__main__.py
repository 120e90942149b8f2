"""python -m bth compile|info …"""

import argparse
import sys

import bth


def _compile(arguments):
    def progress(stage, done, total):
        share = f" {100 * done // total:3d} %" if total else ""
        print(f"\r{stage}{share}      ", end="", file=sys.stderr, flush=True)

    output = arguments.output or arguments.model.rpartition(".")[0] + ".bth"
    scene = bth.compile(arguments.model, output=output, quality=arguments.quality, progress=progress if sys.stderr.isatty() else None)
    print(f"{output}: {scene!r}")


def _info(arguments):
    for path in arguments.files:
        with bth.open(path) as scene:
            bounds = scene.bounds
            print(f"{path}: {scene!r}, {scene.nbytes} bytes, box {None if bounds is None else bounds.tolist()}, frames {scene.frames}")


def main(arguments=None):
    parser = argparse.ArgumentParser(prog="python -m bth", description="Compiles models and shows what is in compiled files.")
    commands = parser.add_subparsers(required=True)
    compiler = commands.add_parser("compile", help="compile a model or a scene")
    compiler.add_argument("model")
    compiler.add_argument("-o", "--output")
    compiler.add_argument("--quality", choices=["fast", "balanced", "best"])
    compiler.set_defaults(run=_compile)
    info = commands.add_parser("info", help="what is in compiled files")
    info.add_argument("files", nargs="+")
    info.set_defaults(run=_info)
    parsed = parser.parse_args(arguments)
    try:
        parsed.run(parsed)
    except (bth.Error, OSError) as error:
        print(f"error: {error}", file=sys.stderr)
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())
