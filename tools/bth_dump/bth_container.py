"""Header, section table and hashes of a BTH file (format-spec/README.md, "Container")."""

import struct
from collections import namedtuple

from bth_blake3 import blake3

NONE = 0xFFFFFFFF
IDENTIFIER = bytes.fromhex("89 42 54 48 31 0D 0A 1A 0A 00 00 00 00 00 00 00")
VERSION = 0x00010000
FEATURE_GRID = 1
FEATURE_WIDENED_BOXES = 16
FEATURE_FIRST_TREES = 32

OBJECT, LINES, TRIANGLE_IDS, TET_LEAVES, TETS, TET_VERTICES, TET_FACES, HULL_FACES, TRIANGLE_FACES = range(1, 10)
LEAF_VERTICES = 10
TRIANGLE_PLACES, FREE_DIRECTIONS, FREE_LEVELS, FREE_DISTANCES = range(11, 15)
ANCHOR, EXACT_POSITIONS = 15, 30
POSITIONS, TRIANGLES, CORNERS, NORMALS, UVS, GROUPS, GROUP_RUNS, MATERIALS, LABELS = range(16, 25)
SEQUENCE_TIMES, SEQUENCE_POSITIONS, FORMER_SEGMENTS = range(25, 28)
OPACITY, OPACITY_MICRO = 28, 29
PROVENANCE, OBJECT_NAMES, OBJECT_LABELS = range(32, 35)
MATERIAL_PARAMETERS, TEXTURES, COLOR_CORNERS, COLORS, IMAGES, IMAGE_BYTES = range(35, 41)
DEFORMATION, JOINTS, JOINT_WEIGHTS, MORPHS, MORPH_ROWS, MORPH_DELTAS = range(41, 47)
SCENE, NODES, INSTANCES, TRACKS, TIMES, VALUES, CAMERAS, LIGHTS, NAMES = range(48, 57)
DEFORMERS, SKINS, SKIN_JOINTS, MORPH_WEIGHTS, TREES, TREE_LINES = range(57, 63)
SECOND_CORNERS, SECOND_UVS, GLOSS_PARAMETERS = 68, 69, 70
OF_FILE = {PROVENANCE, OBJECT_NAMES, OBJECT_LABELS, IMAGES, IMAGE_BYTES, *range(SCENE, TREE_LINES + 1)}

# Kind: name, strides, most elements.
KINDS = {
    OBJECT: ("OBJECT", (64,), None),
    LINES: ("LINES", (64,), 1 << 29),
    TRIANGLE_IDS: ("TRIANGLE_IDS", (4,), 1 << 30),
    TET_LEAVES: ("TET_LEAVES", (64,), 1 << 29),
    TETS: ("TETS", (32,), 1 << 30),
    TET_VERTICES: ("TET_VERTICES", (16,), (1 << 31) - 1),
    TET_FACES: ("TET_FACES", (32,), (1 << 31) - 1),
    HULL_FACES: ("HULL_FACES", (20,), (1 << 31) - 1),
    TRIANGLE_FACES: ("TRIANGLE_FACES", (4,), 1 << 30),
    LEAF_VERTICES: ("LEAF_VERTICES", (64,), 1 << 28),
    TRIANGLE_PLACES: ("TRIANGLE_PLACES", (4,), 1 << 30),
    FREE_DIRECTIONS: ("FREE_DIRECTIONS", (20,), 1 << 30),
    FREE_LEVELS: ("FREE_LEVELS", (16,), 1),
    FREE_DISTANCES: ("FREE_DISTANCES", (8,), 1 << 30),
    ANCHOR: ("ANCHOR", (24,), 1),
    EXACT_POSITIONS: ("EXACT_POSITIONS", (24,), (1 << 32) - 2),
    POSITIONS: ("POSITIONS", (12,), (1 << 32) - 2),
    TRIANGLES: ("TRIANGLES", (12,), 1 << 30),
    CORNERS: ("CORNERS", (12,), 1 << 30),
    NORMALS: ("NORMALS", (12,), (1 << 32) - 2),
    UVS: ("UVS", (8,), (1 << 32) - 2),
    GROUPS: ("GROUPS", (16,), (1 << 32) - 2),
    GROUP_RUNS: ("GROUP_RUNS", (8,), 1 << 30),
    MATERIALS: ("MATERIALS", (16,), (1 << 32) - 2),
    LABELS: ("LABELS", (1,), (1 << 32) - 2),
    SEQUENCE_TIMES: ("SEQUENCE_TIMES", (8,), (1 << 32) - 2),
    SEQUENCE_POSITIONS: ("SEQUENCE_POSITIONS", (12,), (1 << 32) - 2),
    OPACITY: ("OPACITY", (4,), 1 << 30),
    OPACITY_MICRO: ("OPACITY_MICRO", (4,), 1 << 28),
    PROVENANCE: ("PROVENANCE", (1,), None),
    OBJECT_NAMES: ("OBJECT_NAMES", (8,), (1 << 32) - 2),
    OBJECT_LABELS: ("OBJECT_LABELS", (1,), (1 << 32) - 2),
    MATERIAL_PARAMETERS: ("MATERIAL_PARAMETERS", (64,), (1 << 32) - 2),
    TEXTURES: ("TEXTURES", (64,), (1 << 32) - 2),
    COLOR_CORNERS: ("COLOR_CORNERS", (12,), 1 << 30),
    COLORS: ("COLORS", (8,), (1 << 32) - 2),
    SECOND_CORNERS: ("SECOND_CORNERS", (12,), 1 << 30),
    SECOND_UVS: ("SECOND_UVS", (8,), (1 << 32) - 2),
    GLOSS_PARAMETERS: ("GLOSS_PARAMETERS", (32,), (1 << 32) - 2),
    IMAGES: ("IMAGES", (32,), (1 << 32) - 2),
    IMAGE_BYTES: ("IMAGE_BYTES", (1,), None),
    DEFORMATION: ("DEFORMATION", (16,), (1 << 32) - 2),
    JOINTS: ("JOINTS", (8,), (1 << 32) - 2),
    JOINT_WEIGHTS: ("JOINT_WEIGHTS", (16,), (1 << 32) - 2),
    MORPHS: ("MORPHS", (16,), (1 << 32) - 2),
    MORPH_ROWS: ("MORPH_ROWS", (4,), (1 << 32) - 2),
    MORPH_DELTAS: ("MORPH_DELTAS", (12,), (1 << 32) - 2),
    SCENE: ("SCENE", (64,), (1 << 32) - 2),
    NODES: ("NODES", (128,), (1 << 32) - 2),
    INSTANCES: ("INSTANCES", (16,), (1 << 31) - 1),
    TRACKS: ("TRACKS", (32,), (1 << 32) - 2),
    TIMES: ("TIMES", (8,), (1 << 32) - 2),
    VALUES: ("VALUES", (8,), (1 << 32) - 2),
    CAMERAS: ("CAMERAS", (64,), (1 << 32) - 2),
    LIGHTS: ("LIGHTS", (80,), (1 << 32) - 2),
    NAMES: ("NAMES", (1,), (1 << 32) - 2),
    DEFORMERS: ("DEFORMERS", (32,), (1 << 32) - 2),
    SKINS: ("SKINS", (16,), (1 << 32) - 2),
    SKIN_JOINTS: ("SKIN_JOINTS", (112,), (1 << 32) - 2),
    MORPH_WEIGHTS: ("MORPH_WEIGHTS", (8,), (1 << 32) - 2),
    TREES: ("TREES", (64,), (1 << 31) - 1),
    TREE_LINES: ("TREE_LINES", (64,), (1 << 31) - 1),
}

Header = namedtuple(
    "Header",
    "identifier writer_version minimum_reader_version file_length section_offset section_count reserved "
    "required_features optional_features content_id table_hash header_hash",
)
HEADER = struct.Struct("<16sIIQQIIQQ32s16s16s")
Entry = namedtuple("Entry", "kind flags object alignment offset length stride reserved count hash")
ENTRY = struct.Struct("<IIIIQQIIQ16s")


def kind_name(kind):
    return KINDS[kind][0] if kind in KINDS else "unknown"


class Invalid(Exception):
    """A violated invariant. The offset counts from the start of the file."""

    def __init__(self, number, message, section=None, offset=None):
        super().__init__(message)
        self.code, self.message, self.section, self.offset = f"BTH-{number}", message, section, offset


def hash128(data):
    return blake3(bytes(data))[:16]


def need(condition, number, message, offset=None, section=None):
    if not condition:
        raise Invalid(number, message, section, offset)


class Container:
    """A file whose header and section table have been checked; its sections have not."""

    def __init__(self, data):
        need(len(data) >= HEADER.size, "F001", f"{len(data)} bytes hold no header", 0)
        h = self.header = Header(*HEADER.unpack_from(data))
        need(h.identifier == IDENTIFIER, "F002", f"identifier {h.identifier.hex()}", 0)
        writer, reader = h.writer_version, h.minimum_reader_version
        majors = writer >> 16 == 1 and reader >> 16 == 1
        need(majors and reader <= writer and reader <= VERSION, "F003", f"versions {writer:#x}, {reader:#x}", 16)
        need(h.header_hash == hash128(data[:112]), "F004", "the header was changed", 112)
        need(h.file_length == len(data), "F005", f"{len(data)} bytes instead of {h.file_length}", 24)
        need(h.reserved == 0, "F006", "a reserved field is not zero", 44)
        known = FEATURE_GRID | FEATURE_WIDENED_BOXES | FEATURE_FIRST_TREES
        need(h.required_features & ~known == 0, "F007", f"unknown features {h.required_features:#x}", 48)
        end = HEADER.size + ENTRY.size * h.section_count
        fits = h.section_offset == HEADER.size and h.section_count <= 1 << 22 and end <= len(data)
        need(fits, "F008", f"{h.section_count} sections at {h.section_offset}", 32)
        need(h.table_hash == hash128(data[HEADER.size : end]), "F009", "the section table was changed", 96)
        self.data = data
        self.entries = [Entry(*fields) for fields in ENTRY.iter_unpack(data[HEADER.size : end])]
        last = self._check_entries(end)
        self._check_objects()
        need(h.content_id == self.content_id(), "F018", "the content id is not that of the sections", 64)
        need((last + 63) // 64 * 64 == len(data), "F019", f"the last section ends at {last}", 24)
        self.by_key = {(e.object, e.kind): e for e in self.entries}

    def _check_entries(self, end):
        """F006, F010 to F016 and F022; returns where the last section ends. `end` is where the table does."""
        before = None
        ends = {True: end, False: max([end, *(e.offset + e.length for e in self.entries if e.kind == OBJECT)])}
        for i, e in enumerate(self.entries):
            at, name = HEADER.size + ENTRY.size * i, kind_name(e.kind)
            key = (e.object, e.kind)
            need(before is None or before < key, "F010", f"{key} behind {before}", at, name)
            before = key
            need(e.reserved == 0, "F006", "a reserved field is not zero", at, name)
            need(e.flags in (0, 1), "F016", f"flags {e.flags}", at, name)
            need(e.alignment == 64 and e.offset % 64 == 0, "F011", f"offset {e.offset}", at, name)
            inside = ends[e.kind == OBJECT] <= e.offset and e.offset + e.length <= len(self.data)
            need(inside, "F012", f"{e.length} bytes at {e.offset}", at, name)
            ends[e.kind == OBJECT] = e.offset + e.length
            need(e.stride * e.count == e.length, "F013", f"{e.count} x {e.stride} is not {e.length}", at, name)
            need(e.kind != FORMER_SEGMENTS, "F007", "trees for ranges of time of older files", at, name)
            if e.kind in KINDS:
                _, strides, most = KINDS[e.kind]
                old = e.kind == TETS and e.stride in (16, 20)
                need(not old, "F007", f"tetrahedra of {e.stride} bytes", at, name)
                need(e.stride in strides, "F014", f"stride {e.stride}", at, name)
                need(most is None or e.count <= most, "F022", f"{e.count} elements", at, name)
            else:
                need(e.flags == 0, "F015", f"unknown kind {e.kind}", at, name)
        return ends[False]

    def _check_objects(self):
        """F017."""
        owners = sorted({e.object for e in self.entries} - {NONE})
        self.objects = len(owners)
        need(owners == list(range(len(owners))), "F017", f"objects {owners}", HEADER.size)
        rows = {e.object: e.count for e in self.entries if e.kind == OBJECT}
        for owner in owners:
            need(rows.get(owner) == 1, "F017", f"{rows.get(owner)} OBJECT rows in object {owner}", HEADER.size)
        for e in self.entries:
            of_file = e.kind in OF_FILE
            fits = e.kind not in KINDS or (e.object == NONE) == of_file
            need(fits, "F017", f"{kind_name(e.kind)} of object {e.object}", HEADER.size)

    def content_id(self):
        """The content id that the section table should have (F018)."""
        parts = [IDENTIFIER]
        for e in self.entries:
            if e.kind != PROVENANCE:
                parts.append(struct.pack("<IIIIQ", e.kind, e.flags, e.object, e.stride, e.count) + e.hash)
        return blake3(b"".join(parts))

    def check_bytes(self):
        """Gaps and hashes: F020 and F021."""
        end = HEADER.size + ENTRY.size * len(self.entries)
        for e in [*sorted(self.entries, key=lambda e: e.kind != OBJECT), None]:
            start = len(self.data) if e is None else e.offset
            need(not any(self.data[end:start]), "F020", f"bytes {end} to {start} are not zero", end)
            if e is not None:
                end = e.offset + e.length
                same = hash128(self.data[e.offset : end]) == e.hash
                need(same, "F021", "the section was changed", e.offset, kind_name(e.kind))

    def section(self, owner, kind):
        """Bytes of a section, empty if there is none."""
        e = self.by_key.get((owner, kind))
        return b"" if e is None else self.data[e.offset : e.offset + e.length]
