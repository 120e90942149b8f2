"""How many threads a call uses."""

import operator
import os

from . import _native

# More than any machine has.
_MOST = 65535

_default = None


def set_threads(threads):
    """Sets how many threads calls use that do not say so themselves; None for one for each processor (or BTH_THREADS)."""
    global _default
    _default = None if threads is None else count(threads)


def count(threads):
    """The number of threads of a call."""
    if threads is not None:
        threads = operator.index(threads)
        if not 0 <= threads <= _MOST:
            raise ValueError(f"threads: expected a number from 0 (one for each processor) to {_MOST}, got {threads}")
        return threads or _native.processors()
    return default() or _native.processors()


def default():
    """The number of threads of calls that do not say so themselves; 0 for one for each processor."""
    if _default is not None:
        return _default
    try:
        return min(max(int(os.environ.get("BTH_THREADS", "")), 0), _MOST)
    except ValueError:
        return 0
