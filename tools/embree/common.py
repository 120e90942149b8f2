"""What the scripts in tools/embree share: where packages are, which library is judged, and how a skip is told."""

import argparse
import os
import re
import subprocess
import sys
from pathlib import Path

HERE = Path(__file__).resolve().parent
TARGET = Path(os.environ.get("CARGO_TARGET_DIR") or HERE.parents[1] / "target")
PACKAGES = Path(os.environ.get("BTH_EMBREE_PACKAGES") or TARGET / "embree-packages")
DEBIAN = PACKAGES / "trixie/usr/lib/x86_64-linux-gnu"


def arguments(text):
    """A parser whose first argument is the library to judge."""
    parser = argparse.ArgumentParser(description=text, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("library", metavar="LIB", help="libbth_embree.so, or 'real' for Embree itself")
    parser.add_argument("--fallback", choices=["forbidden", "allowed"], default="allowed",
                        help="may the library ask the real Embree for what it does not hold? (default: allowed)")
    return parser


def skip(reason):
    print(f"skipped: {reason}")
    sys.exit(0)


def packages(*options):
    """Gets the packages. What is missing is reported by that script, and missed by `need`."""
    subprocess.run([HERE / "packages", PACKAGES, *options], stdout=sys.stderr, check=False)


def need(pattern, what):
    """The one file in the packages that matches, or a skip."""
    found = sorted(PACKAGES.glob(pattern))
    if not found:
        skip(f"{what} is not to be had")
    return found[0]


def library(options):
    """The library to judge, or None for the real one."""
    if options.library == "real":
        return None
    path = Path(options.library).resolve()
    if not path.is_file():
        sys.exit(f"error: expected a library, found no file {path}")
    return path


def environment(options, real, ours=None):
    """Variables for a program that calls the library: `real` answers what it does not hold."""
    variables = {name: value for name, value in os.environ.items() if not name.startswith("LD_")}
    if ours:
        variables["BTH_EMBREE_FALLBACK"] = "none" if options.fallback == "forbidden" else str(real)
        variables["BTH_EMBREE_STATISTICS"] = "1"
    return variables


def preloaded(options, real, ours):
    """The same, with our library in front of the one that the program brings."""
    variables = environment(options, real, ours)
    if ours:
        variables["LD_PRELOAD"] = str(ours)
    return variables


def share(text):
    """The share of rays that the library answered itself, in its statistics; None without any."""
    counts = re.search(r"^rays\s+(\d+)\s+(\d+)", text, re.M)
    return int(counts[1]) / max(1, int(counts[1]) + int(counts[2])) if counts else None
