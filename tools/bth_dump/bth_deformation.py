"""What moves the vertices of objects (format-spec/README.md, "Deformation") and invariants F173 to F184 and F186."""

import math
import struct
from collections import namedtuple

import bth_container as c
from bth_container import NONE

Deformation = namedtuple("Deformation", "joints influence_sets targets reserved")
Morph = namedtuple("Morph", "deltas first_delta first_row reserved")
Deformer = namedtuple("Deformer", "node object skin weights first_weight reserved")
Skin = namedtuple("Skin", "first_joint joints reserved")
SkinJoint = namedtuple("SkinJoint", "inverse_bind node reserved")


class DeformationView:
    """The deformation sections of an object."""

    def __init__(self, view):
        self.view = view
        self.counts = [Deformation(*r) for r in view.rows(c.DEFORMATION, "<4I")]
        self.joints = view.rows(c.JOINTS, "<4H")
        self.weights = view.rows(c.JOINT_WEIGHTS, "<4f")
        self.morphs = [Morph(*r) for r in view.rows(c.MORPHS, "<4I")]
        self.rows = view.rows(c.MORPH_ROWS, "<I", scalar=True)
        self.deltas = view.rows(c.MORPH_DELTAS, "<3f")

    def need(self, condition, number, message, kind):
        if not condition:
            raise self.view.invalid(number, message, kind)

    def check(self):
        """F173 to F179."""
        view, need = self.view, self.need
        need(len(self.counts) < 2, "F173", f"{len(self.counts)} rows", c.DEFORMATION)
        if not self.counts:
            parts = ((c.JOINTS, self.joints), (c.JOINT_WEIGHTS, self.weights), (c.MORPHS, self.morphs))
            for kind, rows in (*parts, (c.MORPH_ROWS, self.rows), (c.MORPH_DELTAS, self.deltas)):
                need(not rows, "F173", "rows without DEFORMATION", kind)
            return
        counts = self.counts[0]
        sets = counts.influence_sets
        good = counts.joints <= 1 << 16 and sets <= 2 and (counts.joints == 0) == (sets == 0)
        good = good and counts.reserved == 0 and len(view.source) == view.triangles
        need(good, "F173", f"{counts}", c.DEFORMATION)
        for kind, rows in ((c.JOINTS, self.joints), (c.JOINT_WEIGHTS, self.weights)):
            need(len(rows) == sets * len(view.positions), "F174", f"{len(rows)} rows", kind)
        for joints in self.joints:
            need(max(joints) < counts.joints, "F175", f"joints {joints}", c.JOINTS)
        for position in range(len(view.positions) if sets else 0):
            weights = [w for row in self.weights[position * sets : (position + 1) * sets] for w in row]
            good = all(math.isfinite(w) and w >= 0 for w in weights) and any(weights)
            need(good, "F175", f"weights {weights} of position {position}", c.JOINT_WEIGHTS)
        self.check_morphs(counts.targets)

    def check_morphs(self, targets):
        """F176 to F179."""
        view, need = self.view, self.need
        need(len(self.morphs) in (targets, 2 * targets), "F176", f"{len(self.morphs)} rows", c.MORPHS)
        delta = row = 0
        for i, m in enumerate(self.morphs):
            need(m.reserved == 0, "F176", f"{m}", c.MORPHS)
            most = len(view.normals if i >= targets else view.positions)
            dense = m.first_row == NONE
            good = m.first_delta == delta and (dense or m.first_row == row) and (not dense or m.deltas == most)
            delta, first, row = delta + m.deltas, row, row + (0 if dense else m.deltas)
            need(good and delta <= len(self.deltas) and row <= len(self.rows), "F177", f"{m}", c.MORPHS)
            own = self.rows[first:row]
            ascends = all(a < b for a, b in zip(own, own[1:]))
            need(ascends and all(r < most for r in own), "F178", f"rows of morph {i}", c.MORPH_ROWS)
        need(delta == len(self.deltas), "F177", "deltas of no morph", c.MORPH_DELTAS)
        need(row == len(self.rows), "F177", "rows of no morph", c.MORPH_ROWS)
        good = all(math.isfinite(x) for d in self.deltas for x in d)
        need(good, "F179", "a delta that is not finite", c.MORPH_DELTAS)


class Deformers:
    """The deformers of a scene and their skins."""

    def __init__(self, scene):
        self.scene = scene
        self.deformers = [Deformer(*r[:5], r[5:]) for r in scene.rows(c.DEFORMERS, "<8I")]
        self.skins = [Skin(r[0], r[1], r[2:]) for r in scene.rows(c.SKINS, "<4I")]
        self.joints = [SkinJoint(r[:12], r[12], r[13:]) for r in scene.rows(c.SKIN_JOINTS, "<12d4I")]
        self.weights = [r[0] for r in scene.rows(c.MORPH_WEIGHTS, "<d")]

    def weights_of(self, node):
        """Number of weights of a node's deformer."""
        return next((d.weights for d in self.deformers if d.node == node), 0)

    def object_row(self, index, kind, form):
        """The first row of a section of an object; None where there is none."""
        data = self.scene.container.section(index, kind)
        return struct.unpack_from(form, data) if len(data) >= struct.calcsize(form) else None

    def check(self):
        """F180 to F184 and F186."""
        scene, need, end = self.scene, self.scene.need, 0
        for s in self.skins:
            good = s.first_joint == end and s.joints > 0 and not any(s.reserved)
            end += s.joints
            need(good and end <= len(self.joints), "F183", f"{s}", c.SKINS)
        need(end == len(self.joints), "F183", "joints of no skin", c.SKIN_JOINTS)
        for j in self.joints:
            good = j.node < len(scene.nodes) and all(map(math.isfinite, j.inverse_bind)) and not any(j.reserved)
            need(good, "F184", f"{j}", c.SKIN_JOINTS)
        before, end = -1, 0
        for d in self.deformers:
            there = d.node < len(scene.nodes) and d.object < scene.container.objects and not any(d.reserved)
            row = self.object_row(d.object, c.DEFORMATION, "<4I") if there else None
            need(row and before < d.node, "F180", f"{d}", c.DEFORMERS)
            before = d.node
            root = self.object_row(d.object, c.OBJECT, "<24xI")[0]
            has = {kind for kind in (c.LEAF_VERTICES, c.SEQUENCE_TIMES) if len(scene.container.section(d.object, kind))}
            can_move = (root == NONE or c.LEAF_VERTICES in has) and c.SEQUENCE_TIMES not in has
            need(can_move, "F186", f"{d}", c.DEFORMERS)
            if d.skin != NONE:
                joints = self.skins[d.skin].joints if d.skin < len(self.skins) else 0
                need(0 < row[0] <= joints, "F181", f"{d}", c.DEFORMERS)
            need(d.weights == row[2] and d.first_weight == end, "F182", f"{d}", c.DEFORMERS)
            end += d.weights
        need(end == len(self.weights), "F182", "weights of no deformer", c.MORPH_WEIGHTS)
        need(all(map(math.isfinite, self.weights)), "F182", "a weight that is not finite", c.MORPH_WEIGHTS)
        objects = [d.object for d in self.deformers]
        need(len(set(objects)) == len(objects), "F180", "two deformers of one object", c.DEFORMERS)
