"""Output files that appear whole or not at all."""

import os
import secrets
from collections.abc import Callable
from typing import BinaryIO


def write_whole(path: str | os.PathLike[str], write: Callable[[BinaryIO], object]) -> None:
    """Calls `write` with a file beside `path`, which then takes its place; on any exception, Ctrl-C included, nothing remains.

    What is at `path` and is no ordinary file, such as a pipe, is written to as it is. Raises OSError.
    """
    path = os.path.realpath(os.fspath(path))
    if os.path.exists(path) and not os.path.isfile(path):
        with open(path, "wb") as file:
            write(file)
        return
    # Not the path with more behind it: names may be as long as the system takes them.
    part = os.path.join(os.path.dirname(path), f".{secrets.token_hex(8)}.part")
    file = open(part, "xb")
    try:
        with file:
            write(file)
        os.replace(part, path)
    except BaseException:
        os.remove(part)
        raise
