"""Materials, textures, vertex colors, second sets of texture coordinates and images
(format-spec/README.md, "Materials"), F149, F160 to F162, and F220 to F222."""

import math
import struct
from collections import namedtuple

import bth_container as c
from bth_container import NONE, Invalid, kind_name

Parameters = namedtuple(
    "Parameters",
    "base_color emissive alpha_cutoff alpha_mode flags base_color_texture emissive_texture reserved",
)
Gloss = namedtuple(
    "Gloss",
    "metallic roughness normal_scale occlusion_strength metallic_roughness_texture normal_texture"
    " occlusion_texture reserved",
)
Texture = namedtuple("Texture", "image wrap filter transform uv_set reserved")
Image = namedtuple("Image", "name first length")


def amount(x):
    """Whether a number is finite and not negative."""
    return math.isfinite(x) and x >= 0


class MaterialsView:
    """The materials of an object."""

    def __init__(self, view):
        self.view = view
        rows = view.rows(c.MATERIAL_PARAMETERS, "<8f8I")
        self.parameters = [Parameters(r[:4], r[4:7], r[7], *r[8:12], r[12:]) for r in rows]
        self.gloss = [Gloss(*r) for r in view.rows(c.GLOSS_PARAMETERS, "<4f4I")]
        rows = view.rows(c.TEXTURES, "<16s3I6f3I")
        self.textures = [Texture(r[0], r[1:3], r[3], r[4:10], r[10], r[11:]) for r in rows]
        self.color_corners = view.rows(c.COLOR_CORNERS, "<3I")
        self.colors = view.rows(c.COLORS, "<4H")
        self.second_corners = view.rows(c.SECOND_CORNERS, "<3I")
        self.second_uvs = view.rows(c.SECOND_UVS, "<2f")

    def describe(self):
        """Counts, as a JSON-able value."""
        return {
            "parameters": len(self.parameters),
            "gloss": len(self.gloss),
            "textures": len(self.textures),
            "vertex_colors": len(self.colors),
            "second_uvs": len(self.second_uvs),
        }

    def check(self):
        """F149, F160, F161, and F220 to F222."""

        def need(condition, number, message, kind):
            if not condition:
                raise self.view.invalid(number, message, kind)

        known = len(self.view.bytes(c.MATERIALS)) // 16
        count = len(self.parameters)
        need(count in (0, known), "F149", f"{count} rows for {known} materials", c.MATERIAL_PARAMETERS)
        for p in self.parameters:
            good = all(map(amount, (*p.base_color, *p.emissive, p.alpha_cutoff))) and p.base_color[3] <= 1
            good = good and p.alpha_mode <= 2 and p.flags <= 3 and not any(p.reserved)
            textures = (p.base_color_texture, p.emissive_texture)
            good = good and all(t == NONE or t < len(self.textures) for t in textures)
            need(good, "F149", f"{p}", c.MATERIAL_PARAMETERS)
        need(len(self.gloss) in (0, known), "F222", f"{len(self.gloss)} rows", c.GLOSS_PARAMETERS)
        for g in self.gloss:
            good = all(0 <= x <= 1 for x in (g.metallic, g.roughness, g.occlusion_strength))
            textures = (g.metallic_roughness_texture, g.normal_texture, g.occlusion_texture)
            good = good and all(t == NONE or t < len(self.textures) for t in textures)
            good = good and math.isfinite(g.normal_scale) and g.reserved == 0
            need(good, "F222", f"{g}", c.GLOSS_PARAMETERS)
        for t in self.textures:
            good = max(t.wrap) <= 2 and t.filter <= 1 and all(map(math.isfinite, t.transform))
            need(good and t.uv_set <= 1 and not any(t.reserved), "F160", f"{t}", c.TEXTURES)
        for corners, rows, number, kind in (
            (self.color_corners, self.colors, "F161", c.COLOR_CORNERS),
            (self.second_corners, self.second_uvs, "F220", c.SECOND_CORNERS),
        ):
            need(len(corners) in (0, self.view.triangles), number, f"{len(corners)} rows", kind)
            for corner in corners:
                need(max(corner) < len(rows), number, f"row {max(corner)}", kind)
        for uv in self.second_uvs:
            need(all(map(math.isfinite, uv)), "F221", f"{uv}", c.SECOND_UVS)


def check_images(container, materials):
    """F162. `materials` are those of all objects."""
    images = [Image(*r) for r in struct.iter_unpack("<16s2Q", container.section(NONE, c.IMAGES))]
    size, end, before = len(container.section(NONE, c.IMAGE_BYTES)), 0, None
    entry = container.by_key.get((NONE, c.IMAGES))

    def fail(message):
        raise Invalid("F162", message, kind_name(c.IMAGES), entry.offset if entry else None)

    for image in images:
        if before is not None and before >= image.name:
            fail("names do not ascend")
        if image.first != end or image.length == 0 or image.first + image.length > size:
            fail(f"{image.length} bytes at {image.first}")
        before, end = image.name, image.first + image.length
    if end != size:
        fail(f"images of {end} of {size} bytes")
    names = {image.name for image in images}
    for view in materials:
        for texture in view.textures:
            if texture.image not in names:
                raise view.view.invalid("F162", f"no image {texture.image.hex()}", c.TEXTURES)
