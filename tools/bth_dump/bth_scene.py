"""The scene sections (format-spec/README.md, "Scenes") and invariants F150 to F159, F185 and
F188."""

import math
import struct
from collections import namedtuple

import bth_container as c
from bth_container import NONE, Invalid, kind_name
from bth_deformation import Deformers
from bth_groups import checked

Scene = namedtuple("Scene", "rate first_frame last_frame camera reserved")
Node = namedtuple("Node", "transform parent flags name name_length reserved")
Instance = namedtuple("Instance", "node object flags first")
Track = namedtuple("Track", "node property interpolation keys first_time first_value reserved")
Camera = namedtuple("Camera", "node projection name name_length size aspect near far reserved")
Light = namedtuple("Light", "node kind name name_length color intensity range inner outer reserved")

WIDTHS = (3, 4, 3, 1)
TRANSLATION, ROTATION, SCALE, VISIBLE, WEIGHTS = range(5)
STEP, LINEAR, CUBIC = range(3)
HIDDEN, MATRIX, GROUP = 1, 2, 4
OF_GROUP = 1
MAX_PATH = 16
FRAME_LIMIT = 1 << 24


class SceneView:
    """The scene sections of a file; `exists` is false for a file without any."""

    def __init__(self, container):
        self.container = container
        self.exists = any((NONE, kind) in container.by_key for kind in range(c.SCENE, c.MORPH_WEIGHTS + 1))
        self.scenes = [Scene(*r[:4], r[4:]) for r in self.rows(c.SCENE, "<dii12I")]
        self.nodes = [Node(r[:12], *r[12:16], r[16:]) for r in self.rows(c.NODES, "<12d8I")]
        self.instances = [Instance(*r) for r in self.rows(c.INSTANCES, "<4I")]
        self.tracks = [Track(*r[:6], r[6:]) for r in self.rows(c.TRACKS, "<8I")]
        self.times = [r[0] for r in self.rows(c.TIMES, "<d")]
        self.values = [r[0] for r in self.rows(c.VALUES, "<d")]
        self.cameras = [Camera(*r[:8], r[8:]) for r in self.rows(c.CAMERAS, "<4I4d4I")]
        self.lights = [Light(*r[:4], r[4:7], *r[7:11], r[11:]) for r in self.rows(c.LIGHTS, "<4I7d2I")]
        self.names = checked(container.section(NONE, c.NAMES))
        self.deformers = Deformers(self)

    def rows(self, kind, form):
        return list(struct.iter_unpack(form, self.container.section(NONE, kind)))

    def name(self, row):
        return self.names[row.name : row.name + row.name_length].decode()

    def need(self, condition, number, message, kind):
        if not condition:
            entry = self.container.by_key.get((NONE, kind))
            raise Invalid(number, message, kind_name(kind), entry.offset if entry else 0)

    def check_name(self, row, kind):
        """F153."""
        end = row.name + row.name_length
        self.need(end <= len(self.names) and row.name_length <= 4096, "F153", f"name {row.name}..{end}", kind)
        try:
            self.name(row)
        except UnicodeDecodeError as error:
            self.need(False, "F153", str(error), kind)


def check_scene(view):
    """F150 to F159 and F188."""
    if not view.exists:
        return
    need = view.need
    need(len(view.scenes) == 1, "F150", f"{len(view.scenes)} rows of SCENE", c.SCENE)
    s = view.scenes[0]
    frames = -FRAME_LIMIT <= s.first_frame <= s.last_frame <= FRAME_LIMIT
    camera = s.camera == NONE or s.camera < len(view.cameras)
    need(math.isfinite(s.rate) and s.rate > 0 and frames and camera, "F150", f"{s}", c.SCENE)
    need(not any(s.reserved), "F150", "reserved", c.SCENE)
    for i, n in enumerate(view.nodes):
        need(n.parent == NONE or n.parent < i, "F151", f"parent {n.parent} of node {i}", c.NODES)
        need(n.flags < 8 and not any(n.reserved), "F151", f"flags {n.flags} of node {i}", c.NODES)
        need(not n.flags & GROUP or n.parent == NONE, "F151", f"parent of group {i}", c.NODES)
        good = all(map(math.isfinite, n.transform))
        if not n.flags & MATRIX:
            good = good and any(n.transform[3:7]) and not any(n.transform[10:])
        need(good, "F152", f"transform of node {i}", c.NODES)
        view.check_name(n, c.NODES)
    for x in view.instances:
        if x.flags & OF_GROUP:
            there = x.object < len(view.nodes) and view.nodes[x.object].flags & GROUP
        else:
            there = x.object < view.container.objects
        good = x.node < len(view.nodes) and there and x.flags < 2
        need(good, "F154", f"{x}", c.INSTANCES)
    view.deformers.check()
    check_tracks(view)
    for x in view.cameras:
        size = 0 < x.size < (180 if x.projection == 0 else math.inf)
        depths = 0 <= x.near < math.inf and (x.far == 0 or x.near < x.far < math.inf)
        good = x.node < len(view.nodes) and x.projection < 2 and size and 0 <= x.aspect < math.inf and depths
        need(good and not any(x.reserved), "F158", f"{x}", c.CAMERAS)
        view.check_name(x, c.CAMERAS)
    for x in view.lights:
        angles = 0 <= x.inner < x.outer <= 90 if x.kind == 2 else x.inner == x.outer == 0
        numbers = all(0 <= v < math.inf for v in (*x.color, x.intensity, x.range))
        good = x.node < len(view.nodes) and x.kind < 3 and angles and numbers and not any(x.reserved)
        need(good, "F159", f"{x}", c.LIGHTS)
        view.check_name(x, c.LIGHTS)
    check_groups(view)


def groups_of(view):
    """The number of groups of nodes, which is the world's, and for each node the number of its group."""
    world = sum(n.flags & GROUP != 0 for n in view.nodes)
    group_of, last = [], -1
    for n in view.nodes:
        last += n.flags & GROUP != 0
        own = last if n.flags & GROUP else world
        group_of.append(own if n.parent == NONE else group_of[n.parent])
    return world, group_of


def check_groups(view):
    """F188, and F154 of the numbers of instances."""
    need = view.need
    world, group_of = groups_of(view)
    skinned = {d.object for d in view.deformers.deformers if d.skin != NONE}
    numbered = True
    before, count, levels = 0, [0] * (world + 1), [0] * (world + 1)
    for x in view.instances:
        within = group_of[x.node]
        inner = group_of[x.object] if x.flags & OF_GROUP else None
        good = before <= within and (inner is None or inner < within)
        good = good and (within == world or inner is not None or x.object not in skinned or not world)
        need(good, "F188", f"{x}", c.INSTANCES)
        numbered = numbered and x.first == count[within]
        before = within
        count[within] += 1 if inner is None else count[inner]
        levels[within] = max(levels[within], 1 + (0 if inner is None else levels[inner]))
        need(count[within] < NONE and levels[within] <= MAX_PATH, "F188", f"{x}", c.INSTANCES)
    need(numbered, "F154", "numbers of first instances", c.INSTANCES)
    for rows, kind in ((view.cameras, c.CAMERAS), (view.lights, c.LIGHTS), (view.deformers.deformers, c.DEFORMERS)):
        for x in rows:
            need(group_of[x.node] == world, "F188", f"{x}", kind)


def check_tracks(view):
    """F155 to F157 and F185."""
    need = view.need
    before, times, values = (-1, -1), 0, 0
    for t in view.tracks:
        good = t.node < len(view.nodes) and t.property < 5 and t.interpolation < 3 and not any(t.reserved)
        if good and t.property == VISIBLE:
            good = t.interpolation == STEP
        elif good and t.property != WEIGHTS:
            good = not view.nodes[t.node].flags & MATRIX
        need(good and before < (t.node, t.property), "F155", f"{t}", c.TRACKS)
        before = (t.node, t.property)
        numbers = view.deformers.weights_of(t.node) if t.property == WEIGHTS else WIDTHS[t.property]
        need(numbers > 0, "F185", f"{t}", c.TRACKS)
        width = numbers * (3 if t.interpolation == CUBIC else 1)
        need(t.keys > 0 and (t.first_time, t.first_value) == (times, values), "F156", f"{t}", c.TRACKS)
        keys = view.times[times : times + t.keys]
        numbers = view.values[values : values + t.keys * width]
        need(len(keys) == t.keys and len(numbers) == t.keys * width, "F156", f"{t}", c.TRACKS)
        ascending = all(map(math.isfinite, keys)) and all(a < b for a, b in zip(keys, keys[1:]))
        need(ascending, "F157", f"times of {t}", c.TIMES)
        need(all(map(math.isfinite, numbers)), "F157", f"values of {t}", c.VALUES)
        for i in range(0, len(numbers), width):
            rotation = t.property == ROTATION and width == 12
            value = numbers[i + 4 : i + 8] if rotation else numbers[i : i + width]
            fits = {ROTATION: any(value), VISIBLE: value[0] in (0, 1)}.get(t.property, True)
            need(fits, "F157", f"values of {t}", c.VALUES)
        times, values = times + t.keys, values + t.keys * width
    need(times == len(view.times) and values == len(view.values), "F156", "keys of no track", c.TRACKS)
