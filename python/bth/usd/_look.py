"""Preview materials of USD as materials of glTF."""

import os

import numpy as np
from pxr import Ar, UsdShade  # type: ignore[import-untyped]

from ._gltf import sampler

_TEXTURES = ("diffuseColor", "normal", "emissiveColor", "roughness", "occlusion")
_WRAPS = {"repeat": "repeat", "mirror": "mirror", "clamp": "clamp", "black": "clamp", "useMetadata": "repeat"}


class Looks:
    """The materials of a stage, in a library."""

    def __init__(self, library, dropped):
        self._library, self._dropped = library, dropped

    def of(self, material, double_sided, color):
        """The index of a material, and the name of the primvar of its texture coordinates.

        material: a UsdShade.Material that may be invalid. color: of what has no material, or None for colors at corners.
        """
        surface = _surface(material)
        if surface is None:
            if material:
                self._dropped["materials without a preview surface"] += 1
            key = ("plain", double_sided, None if color is None else tuple(color))
            factor = [1.0, 1.0, 1.0] if color is None else [float(x) for x in color]
            row = {
                "name": "displayColor", "doubleSided": double_sided,
                "pbrMetallicRoughness": {"baseColorFactor": [*np.clip(factor, 0, 1), 1.0], "metallicFactor": 0.0, "roughnessFactor": 1.0},
            }
            return self._library.once(self._library.materials, key, lambda: row), None
        names = set()
        path = str(material.GetPath())
        row = lambda: self._row(path, surface, double_sided, names)
        index = self._library.once(self._library.materials, (path, double_sided), row)
        if not names:
            names = {name for name in (_reader_of(surface, i) for i in _TEXTURES) if name}
        return index, (sorted(names) or [None])[0]

    def _row(self, path, surface, double_sided, names):
        value = lambda name, default: _value(surface, name, default)
        texture = lambda name, *channels: self._texture(surface, name, names, channels)
        diffuse, metal, rough = value("diffuseColor", (0.18,) * 3), value("metallic", 0.0), value("roughness", 0.5)
        if value("useSpecularWorkflow", 0):
            metal = 0.0
            self._dropped["specular colors"] += 1
        opacity, cutoff = value("opacity", 1.0), value("opacityThreshold", 0.0)
        base = {"baseColorFactor": [*(float(x) for x in np.clip(diffuse, 0, 1)), float(np.clip(opacity, 0, 1))]}
        row = {"name": path, "doubleSided": double_sided, "pbrMetallicRoughness": base}
        base |= {"metallicFactor": float(np.clip(metal, 0, 1)), "roughnessFactor": float(np.clip(rough, 0, 1))}
        if (of := texture("diffuseColor", "rgb")) is not None:
            base |= {"baseColorTexture": of, "baseColorFactor": [1.0, 1.0, 1.0, base["baseColorFactor"][3]]}
        seen = [_source(surface, name) for name in ("metallic", "roughness")]
        if all(seen) and seen[0][0].GetPath() == seen[1][0].GetPath() and [s[1] for s in seen] == ["b", "g"]:
            if (of := texture("roughness", "g")) is not None:
                base |= {"metallicRoughnessTexture": of, "metallicFactor": 1.0, "roughnessFactor": 1.0}
        elif any(seen):
            self._dropped["textures of metallic and roughness that are not one image's blue and green"] += 1
        if (of := texture("normal", "rgb")) is not None:
            row["normalTexture"] = of
        if (of := texture("occlusion", "r")) is not None:
            row["occlusionTexture"] = of
        emissive = np.maximum(value("emissiveColor", (0.0,) * 3), 0)
        if (of := texture("emissiveColor", "rgb")) is not None:
            row["emissiveTexture"], emissive = of, np.ones(3)
        strength = float(max(1.0, np.max(emissive)))
        if np.any(emissive):
            row["emissiveFactor"] = [float(x) / strength for x in emissive]
            if strength > 1:
                row["extensions"] = {"KHR_materials_emissive_strength": {"emissiveStrength": strength}}
        opaque = _source(surface, "opacity")
        if opaque and not (_source(surface, "diffuseColor") and opaque[0].GetPath() == _source(surface, "diffuseColor")[0].GetPath()
                           and opaque[1] == "a"):
            self._dropped["textures of opacity that are not the alpha of the base color"] += 1
            opaque = None
        if cutoff > 0:
            row |= {"alphaMode": "MASK", "alphaCutoff": float(cutoff)}
        elif opaque or opacity < 1:
            row["alphaMode"] = "BLEND"
        for name in ("clearcoat", "displacement"):
            if _source(surface, name) or value(name, 0.0):
                self._dropped[f"{name} of materials"] += 1
        return row

    def _texture(self, surface, name, names, channels):
        """The texture of an input as glTF has it; None without one that can be read."""
        source = _source(surface, name)
        if not source or source[0].GetIdAttr().Get() != "UsdUVTexture":
            if source:
                self._dropped[f"inputs of materials that are computed ({name})"] += 1
            return None
        shader, output = source
        if output not in channels:
            self._dropped[f"channels of textures ({name} from {output})"] += 1
            return None
        file = shader.GetInput("file").Get() if shader.GetInput("file") else None
        resolved = file.resolvedPath if file else ""
        asset = Ar.GetResolver().OpenAsset(Ar.ResolvedPath(resolved)) if resolved else None
        if asset is None:
            self._dropped["images that are not there"] += 1
            return None
        inner = resolved.rpartition("[")[2].rstrip("]") if resolved.endswith("]") else resolved
        if os.path.splitext(inner)[1].lower() not in (".png", ".jpg", ".jpeg", ".webp"):
            self._dropped[f"images in a format that is not kept ({os.path.splitext(inner)[1].lower()})"] += 1
            return None
        for part in ("scale", "bias"):
            given = shader.GetInput(part)
            neutral = (1, 1, 1, 1) if part == "scale" else (0, 0, 0, 0)
            if given and given.Get() is not None and name != "normal" and tuple(given.Get()) != neutral:
                self._dropped[f"{part} of textures"] += 1
        reader = _reader_of(surface, name)
        if reader:
            names.add(reader)
        if len(names) > 1:
            self._dropped["second sets of texture coordinates"] += 1
        wraps = [_WRAPS.get(_value(shader, f"wrap{axis}", "useMetadata"), "repeat") for axis in "ST"]
        image = self._library.image(resolved, bytes(asset.GetBuffer()))
        row = {"source": image, "sampler": sampler(*wraps)}
        texture = {"index": self._library.once(self._library.textures, (image, *wraps), lambda: row)}
        if name == "occlusion":
            texture["strength"] = 1.0
        st = _source(shader, "st")
        if st and st[0].GetIdAttr().Get() == "UsdTransform2d":
            self._dropped["transforms of texture coordinates"] += 1
        return texture


def _surface(material):
    if not material:
        return None
    shader = material.ComputeSurfaceSource()
    shader = shader[0] if isinstance(shader, tuple) else shader
    return shader if shader and shader.GetIdAttr().Get() == "UsdPreviewSurface" else None


def _value(shader, name, default):
    """The value of an input that is not computed by a shader."""
    given = shader.GetInput(name)
    if not given:
        return default
    found = [a.Get() for a in UsdShade.Utils.GetValueProducingAttributes(given) if not UsdShade.Output.IsOutput(a)]
    return found[0] if found and found[0] is not None else default


def _source(shader, name):
    """The shader that computes an input, and the name of its output; None without one."""
    given = shader.GetInput(name)
    for attribute in UsdShade.Utils.GetValueProducingAttributes(given) if given else ():
        if UsdShade.Output.IsOutput(attribute):
            return UsdShade.Shader(attribute.GetPrim()), UsdShade.Output(attribute).GetBaseName()
    return None


def _reader_of(surface, name):
    """The primvar by which the texture of an input is looked up; None without one."""
    source = _source(surface, name)
    if not source or source[0].GetIdAttr().Get() != "UsdUVTexture":
        return None
    while source:
        shader = source[0]
        if str(shader.GetIdAttr().Get()).startswith("UsdPrimvarReader"):
            return str(_value(shader, "varname", "st"))
        source = _source(shader, "st") or _source(shader, "in")
    return None
