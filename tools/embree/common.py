"""What the scripts in tools/embree share: where packages are, which library is judged, and how a skip is told."""

import argparse
import os
import re
import shutil
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


def environment(options, real, ours=None, statistics=False):
    """Variables for a program that calls the library: `real` answers what it does not hold."""
    variables = {name: value for name, value in os.environ.items() if not name.startswith(("LD_", "BTH_EMBREE_"))}
    if ours:
        variables["BTH_EMBREE_FALLBACK"] = "none" if options.fallback == "forbidden" else str(real)
    if ours and statistics:
        variables["BTH_EMBREE_STATISTICS"] = "1"
    return variables


def preloaded(options, real, ours, front=None, statistics=False):
    """The same, with our library before the one that the program brings, and a library in C before both."""
    variables = environment(options, real, ours, statistics)
    # What is in front looks for the next library, and finds only those that are preloaded.
    libraries = [front, ours or real] if front else [ours] if ours else []
    return variables | {"LD_PRELOAD": ":".join(map(str, libraries))} if libraries else variables


def in_front(folder, function):
    """A library to preload in front, made of one function in C that calls NEXT; None without a C compiler."""
    out = Path(folder) / "front.so"
    text = f"#define _GNU_SOURCE\n#include <dlfcn.h>\n#include <stdio.h>\n#define NEXT(name) dlsym(RTLD_NEXT, name)\n{function}"
    made = shutil.which("cc") and not subprocess.run(
        ["cc", "-O2", "-shared", "-fPIC", "-x", "c", "-", "-o", out], input=text, text=True, check=False).returncode
    return out if made else None


def counted(kind, text):
    """Answers by the library and by Embree, in the statistics that the library printed."""
    found = re.search(rf"^{kind}\s+(\d+)\s+\S+\s+(\d+)", text, re.M)
    return (int(found[1]), int(found[2])) if found else None
