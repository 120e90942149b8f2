"""Objects whose vertices move by themselves (format-spec/README.md, "Sequences"): F190 to F192."""

import math

import bth_container as c


class SequenceView:
    """The frames of an object."""

    def __init__(self, view):
        self.view = view
        self.times = view.rows(c.SEQUENCE_TIMES, "<d", scalar=True)
        self.positions = view.rows(c.SEQUENCE_POSITIONS, "<3f")

    def check(self):
        """F190 to F192."""
        view, times, positions = self.view, self.times, self.positions
        rows = len(view.positions)
        if len(positions) != len(times) * rows or (times and not view.leaf_vertices):
            raise view.invalid("F190", f"{len(positions)} rows for {len(times)} times", c.SEQUENCE_POSITIONS)
        for i, time in enumerate(times):
            if not math.isfinite(time) or (i > 0 and time <= times[i - 1]):
                raise view.invalid("F191", f"time {time}", c.SEQUENCE_TIMES, 8 * i)
        for i, position in enumerate(positions):
            if not all(map(math.isfinite, position)):
                raise view.invalid("F192", f"position {position}", c.SEQUENCE_POSITIONS, 12 * i)
        if times and view.bytes(c.SEQUENCE_POSITIONS)[: 12 * rows] != view.bytes(c.POSITIONS):
            raise view.invalid("F192", "the first frame is not POSITIONS", c.SEQUENCE_POSITIONS)
