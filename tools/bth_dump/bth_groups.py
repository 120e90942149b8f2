"""Groups of triangles, materials and names (format-spec/README.md, "Groups and names") and F142 to F144 and F148."""

import struct
from collections import namedtuple

import bth_container as c
from bth_container import NONE, Invalid, kind_name

Group = namedtuple("Group", "name name_length material reserved")
Run = namedtuple("Run", "first group")
Material = namedtuple("Material", "name name_length reserved")
ObjectName = namedtuple("ObjectName", "name name_length")


def checked(text):
    """The part of a section of text in which names can lie: all before the first byte that is not UTF-8."""
    text = bytes(text)
    try:
        text.decode()
    except UnicodeDecodeError as error:
        return text[: error.start]
    return text


def label(text, row):
    """The name of a row; None where it does not lie within the text, is too long or is not UTF-8."""
    raw = text[row.name : row.name + row.name_length]
    if len(raw) != row.name_length or row.name > len(text) or row.name_length > 4096:
        return None
    try:
        return bytes(raw).decode()
    except UnicodeDecodeError:
        return None


class GroupsView:
    """The groups of an object."""

    def __init__(self, view):
        self.view = view
        self.groups = [Group(*r) for r in view.rows(c.GROUPS, "<4I")]
        self.runs = [Run(*r) for r in view.rows(c.GROUP_RUNS, "<2I")]
        self.materials = [Material(*r[:2], r[2:]) for r in view.rows(c.MATERIALS, "<4I")]
        self.labels = checked(view.bytes(c.LABELS))

    def describe(self):
        """Groups with their numbers of triangles, as a JSON-able value."""
        counts = [0] * len(self.groups)
        ends = [run.first for run in self.runs[1:]] + [self.view.triangles]
        for run, end in zip(self.runs, ends):
            if run.group < len(counts):
                counts[run.group] += end - run.first
        materials = dict(enumerate(label(self.labels, m) for m in self.materials))
        return [
            {
                "name": label(self.labels, g),
                "material": materials.get(g.material),
                "triangles": count,
            }
            for g, count in zip(self.groups, counts)
        ]

    def check(self):
        """F142 to F144."""
        groups, runs, triangles = self.groups, self.runs, self.view.triangles

        def need(condition, number, message, kind):
            if not condition:
                raise self.view.invalid(number, message, kind)

        present = bool(groups) and triangles > 0
        need(bool(runs) == present, "F142", f"{len(runs)} runs of {len(groups)} groups", c.GROUP_RUNS)
        before = -1
        for i, run in enumerate(runs):
            good = before < run.first < triangles and run.group < len(groups) and (i > 0 or run.first == 0)
            need(good, "F142", f"{run}", c.GROUP_RUNS)
            before = run.first
        for group in groups:
            good = group.material == NONE or group.material < len(self.materials)
            need(good and group.reserved == 0, "F143", f"{group}", c.GROUPS)
            need(label(self.labels, group) is not None, "F144", f"{group}", c.GROUPS)
        for material in self.materials:
            need(not any(material.reserved), "F143", f"{material}", c.MATERIALS)
            need(label(self.labels, material) is not None, "F144", f"{material}", c.MATERIALS)


def object_names(container):
    """The names of the objects, after F148; an empty list if the file has none."""
    entry = container.by_key.get((NONE, c.OBJECT_NAMES))
    rows = [ObjectName(*r) for r in struct.iter_unpack("<2I", container.section(NONE, c.OBJECT_NAMES))]
    labels = checked(container.section(NONE, c.OBJECT_LABELS))
    names = [label(labels, row) for row in rows]
    if rows and (len(rows) != container.objects or None in names):
        raise Invalid("F148", f"names {names}", kind_name(c.OBJECT_NAMES), entry.offset)
    return names
