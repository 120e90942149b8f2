"""How bakes go on: calls of a progress function, chunk by chunk, and a bar on a terminal."""

import sys
import time
from collections.abc import Callable, Iterator
from typing import TextIO

#: Is called with the name of the stage, the units done and the units in all or None; an exception from it cancels.
Progress = Callable[[str, int, int | None], object]

#: Rays of a chunk. Chunks decide how often progress is reported and how much memory is used, never what is answered.
_RAYS = 1 << 18


def chunks(count: int, rays_each: int, stage: str, progress: Progress | None) -> Iterator[slice]:
    """Slices of `count` elements, each of which takes `rays_each` rays, and calls of the progress function between them."""
    step = max(1, _RAYS // max(1, rays_each))
    if progress:
        progress(stage, 0, count)
    for start in range(0, count, step):
        end = min(count, start + step)
        yield slice(start, end)
        if progress:
            progress(stage, end, count)


class Bar:
    """A bar on a terminal, in one line that is removed in the end; nothing where the stream is no terminal."""

    _WIDTH = 28
    _SECONDS = 0.1

    def __init__(self, stream: TextIO | None = None, quiet: bool = False):
        self._stream = sys.stderr if stream is None else stream
        self._shown = not quiet and self._stream is not None and self._stream.isatty()
        self._stage, self._since, self._last = "", 0.0, 0.0

    @property
    def shown(self) -> bool:
        return self._shown

    def __call__(self, stage: str, done: int, total: int | None) -> None:
        """Shows how far a stage is. Calls that follow each other within a tenth of a second are left out."""
        now = time.monotonic()
        if not self._shown or (stage == self._stage and done != total and now - self._last < self._SECONDS):
            return
        if stage != self._stage:
            self._stage, self._since = stage, now
        self._last = now
        self._write(f"{stage} {self._bar(done, total, now)}" if total else stage)

    def _bar(self, done: int, total: int, now: float) -> str:
        share = min(1.0, done / total)
        full = round(share * self._WIDTH)
        left = f", {(now - self._since) * (1 / share - 1):.0f} s left" if 0 < share < 1 and now - self._since > 1 else ""
        return f"[{'#' * full}{'.' * (self._WIDTH - full)}] {100 * share:3.0f} %{left}"

    def _write(self, text: str) -> None:
        self._stream.write(f"\r\x1b[K{text}")
        self._stream.flush()

    def __enter__(self) -> "Bar":
        return self

    def __exit__(self, *_: object) -> None:
        if self._shown and self._stage:
            self._write("")
