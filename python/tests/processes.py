"""Python in processes of their own."""

import subprocess
import sys
import textwrap


def exits(code, *arguments):
    return subprocess.run([sys.executable, "-c", textwrap.dedent(code), *arguments], timeout=120).returncode
