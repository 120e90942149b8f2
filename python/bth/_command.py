"""Commands of `python -m bth`: how they end, and what they print then. Exit codes and error codes are those of docs/reference.md."""

import argparse
import json
import re
import sys
import traceback
import warnings
from collections.abc import Callable, Sequence
from typing import Any, NoReturn

from . import Error


class Usage(Exception):
    """Options that do not fit together, or of which there are none of the name (exit code 2)."""


class Parser(argparse.ArgumentParser):
    """A parser that raises `Usage`, and takes lists of numbers such as -1,0,2 as values of options."""

    def __init__(self, *arguments: Any, **options: Any):
        options["allow_abbrev"] = False
        super().__init__(*arguments, **options)
        self._negative_number_matcher = re.compile(r"^-\.?\d")

    def error(self, message: str) -> NoReturn:
        self.print_usage(sys.stderr)
        raise Usage(message)


def exit_code_of(error: BaseException) -> tuple[str, int, str]:
    """Code, exit code and message of an exception."""
    text = str(error)
    if isinstance(error, KeyboardInterrupt):
        return "BTH-C000", 130, "cancelled"
    if isinstance(error, Usage):
        return "BTH-U001", 2, f"BTH-U001: {text}"
    if isinstance(error, Error):
        code = getattr(error, "code", "BTH-I000")
        return code, 5 if code.startswith("BTH-L") else 3, text
    if isinstance(error, ImportError):
        return "BTH-P005", 4, f"BTH-P005: {text}"
    if isinstance(error, OSError):
        found = re.search(r"BTH-O\d+", text)
        code = found[0] if found else "BTH-O001"
        return code, 4, text if found else f"{code}: {text}"
    if isinstance(error, ValueError):
        return "BTH-U001", 2, f"BTH-U001: {text}"
    if isinstance(error, MemoryError):
        return "BTH-L000", 5, f"BTH-L000: there is not enough memory: {text}"
    return "BTH-X000", 70, f"BTH-X000: internal error, please report it: {type(error).__name__}: {text}"


def run(parser: Parser, arguments: Sequence[str]) -> int:
    """Parses arguments, calls the command's function `run`, and returns the exit code. Errors are printed, with --json as an object, too."""
    wants_json = "--json" in arguments
    quiet = "--quiet" in arguments or "-q" in arguments
    with warnings.catch_warnings():
        warnings.simplefilter("ignore" if quiet else "always")
        warnings.showwarning = _show_warning
        return _run(parser, arguments, wants_json)


def _show_warning(message: Warning | str, *_: Any, **__: Any) -> None:
    print(f"warning: {message}", file=sys.stderr)


def _run(parser: Parser, arguments: Sequence[str], wants_json: bool) -> int:
    try:
        parsed = parser.parse_args(arguments)
        command: Callable[[argparse.Namespace], None] = parsed.run
        command(parsed)
        sys.stdout.flush()
        return 0
    except BrokenPipeError:
        # The reader of standard output has closed it, which is no error. Python would report it once more when it ends.
        sys.stdout = None  # type: ignore[assignment]
        return 0
    except (Exception, KeyboardInterrupt) as error:
        code, exit_code, message = exit_code_of(error)
        if exit_code == 70:
            traceback.print_exc()
        print(f"error: {message}" if exit_code != 130 else message, file=sys.stderr)
        if wants_json:
            print(json.dumps({"error": {"code": code, "message": message, "exit_code": exit_code}}, indent=2))
        return exit_code
