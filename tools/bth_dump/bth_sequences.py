"""Objects whose vertices move by themselves (format-spec/README.md, "Sequences"): F190 to F194."""

import math

import bth_container as c


class SequenceView:
    """The frames and segments of an object."""

    def __init__(self, view):
        self.view = view
        self.times = view.rows(c.SEQUENCE_TIMES, "<d", scalar=True)
        self.positions = view.rows(c.SEQUENCE_POSITIONS, "<3f")
        self.segments = view.rows(c.SEGMENTS, "<dII")

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


def check_segments(sequences, instances):
    """F193 and F194 of a file, given what all objects have and the objects of all instances."""
    taken = set()
    for number, sequence in enumerate(sequences):
        view, segments = sequence.view, sequence.segments
        for row, (first, offset, reserved) in enumerate(segments):
            after = row == 0 or segments[row - 1][0] < first
            if not math.isfinite(first) or not after or reserved or (offset == 0) != (row == 0):
                raise view.invalid("F193", f"row {row}: {first}, {offset}, {reserved}", c.SEGMENTS, 16 * row)
        if len(segments) == 1:
            raise view.invalid("F193", "one row", c.SEGMENTS)
        for row, (_, offset, _) in list(enumerate(segments))[1:]:
            at = number + offset
            other = sequences[at] if at < len(sequences) else None
            good = other is not None and at not in taken and not other.segments and not other.times
            good = good and view.leaf_vertices and other.view.leaf_vertices
            good = good and view.bytes(c.POSITIONS) == other.view.bytes(c.POSITIONS)
            good = good and view.bytes(c.TRIANGLES) == other.view.bytes(c.TRIANGLES)
            if not good:
                raise view.invalid("F194", f"object {at}", c.SEGMENTS, 16 * row)
            taken.add(at)
            if at in instances:
                raise view.invalid("F194", f"an instance of object {at}", c.SEGMENTS, 16 * row)
