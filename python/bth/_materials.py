"""How surfaces look."""

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class Gloss:
    """How glossy a material is, as in glTF 2.0, and the textures that shape its surface.

    metallic: 0 to 1; to be multiplied by blue of `metallic_roughness_texture`.
    roughness: from 0, smooth, to 1; to be multiplied by green of `metallic_roughness_texture`.
    normal_texture: red to the right, green up, blue out of the surface, 0 to 1 for -1 to 1.
    normal_scale: factor of the first two components of these normals.
    occlusion_texture: its red is the share of light from all around that reaches the surface.
    occlusion_strength: how much that counts, from 0 to 1.

    Textures are indices of the object's textures, or None; their texels are linear.
    """

    metallic: float
    roughness: float
    metallic_roughness_texture: int | None
    normal_texture: int | None
    normal_scale: float
    occlusion_texture: int | None
    occlusion_strength: float


@dataclass(frozen=True)
class Material:
    """How a material looks, as in glTF 2.0. Colors are linear, with the primaries of sRGB.

    base_color: red, green, blue and alpha; to be multiplied by the texel of the texture and the vertex color.
    base_color_texture, emissive_texture: indices of the object's textures, or None.
    emissive: red, green and blue of the emitted radiance; to be multiplied by the texel of the texture.
    alpha: "opaque"; "mask", where there is a surface where alpha is at least `alpha_cutoff`; "blend", where alpha is the share of light that
        the surface stops.
    double_sided: whether the back of triangles is seen too.
    unlit: whether the base color is shown as it is, without light.
    gloss: how glossy it is, as Gloss; None in files without glossy materials.
    """

    name: str
    base_color: tuple
    base_color_texture: int | None
    emissive: tuple
    emissive_texture: int | None
    alpha: str
    alpha_cutoff: float
    double_sided: bool
    unlit: bool
    gloss: Gloss | None


@dataclass(frozen=True, eq=False)
class Texture:
    """A texture: an image file, and how it lies on the surface.

    image: equal for textures of the same image of a file.
    data: the image file (PNG, JPEG or WebP), bytes. Red, green and blue of texels of colors are sRGB;
        alpha and the texels of Gloss are linear.
    wrap: for u and for v "repeat", "mirror" or "clamp".
    nearest: whether the nearest texel is taken; else four are interpolated, after they have been made linear.
    uv_set: the set of its texture coordinates: 0 for `texcoord` of hits, 1 for `second_texcoord`.
    transform: (2, 3) float32, from (u, v, 1) to coordinates of the image; (0, 0) is its upper left corner, (1, 1) its lower right one.
    """

    image: int
    data: bytes
    wrap: tuple
    nearest: bool
    uv_set: int
    transform: np.ndarray

    def coordinates(self, texcoord):
        """Coordinates of the image at texture coordinates (..., 2) of its set, of the same shape and float64."""
        transform = self.transform.astype(np.float64)
        return np.asarray(texcoord, np.float64) @ transform[:, :2].T + transform[:, 2]


def material(row):
    """What the native module says of a material; None where the file keeps no more than its name."""
    if row is None:
        return None
    *rest, gloss = row
    return Material(*rest, None if gloss is None else Gloss(*gloss))


def texture(row):
    *rest, transform = row
    return Texture(*rest, np.array(transform, np.float32))
