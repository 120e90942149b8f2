"""A glTF file of meshes and materials, which the compiler reads; scenes are manifests beside it."""

import json
import os

import numpy as np


class Library:
    """Meshes and materials, collected and then written as NAME.gltf with NAME.bin."""

    def __init__(self, folder, name):
        self.name, self._folder = name, folder
        self._views, self._accessors, self._bytes = [], [], bytearray()
        self.meshes, self.materials, self.textures, self.images = [], [], [], []
        self._of_key = {}

    def once(self, rows, key, make):
        """The index in a list of what `make` returns, which is called once for a key."""
        place = (id(rows), key)
        if place not in self._of_key:
            row = make()
            if row is None:
                return None
            rows.append(row)
            self._of_key[place] = len(rows) - 1
        return self._of_key[place]

    def accessor(self, values):
        """The index of an accessor of rows of two to four float32, or of indices."""
        are_indices = values.ndim == 1
        values = np.ascontiguousarray(values, "<u4" if are_indices else "<f4")
        self._views.append({"buffer": 0, "byteOffset": len(self._bytes), "byteLength": values.nbytes})
        self._bytes += values.tobytes()
        kind, shape = (5125, "SCALAR") if are_indices else (5126, f"VEC{values.shape[1]}")
        row = {"bufferView": len(self._views) - 1, "componentType": kind, "count": len(values), "type": shape}
        if shape == "VEC3" and len(values):
            row |= {"min": values.min(axis=0).tolist(), "max": values.max(axis=0).tolist()}
        self._accessors.append(row)
        return len(self._accessors) - 1

    def image(self, name, data):
        """The index of an image file, which is written next to the model."""
        def write():
            stem, ending = os.path.splitext(os.path.basename(name.rstrip("]")))
            file = f"{self.name}-{len(self.images)}{ending.lower()}"
            with open(os.path.join(self._folder, file), "wb") as to:
                to.write(data)
            return {"uri": file, "name": stem}
        return self.once(self.images, name, write)

    def write(self):
        document = {
            "asset": {"version": "2.0", "generator": "bth.usd"}, "meshes": self.meshes, "materials": self.materials,
            "textures": self.textures, "images": self.images, "accessors": self._accessors, "bufferViews": self._views,
            "buffers": [{"uri": f"{self.name}.bin", "byteLength": len(self._bytes)}],
            "samplers": [{"wrapS": s, "wrapT": t} for s in _WRAPS.values() for t in _WRAPS.values()],
        }
        used = sorted({name for row in self.materials for name in row.get("extensions", ())})
        with open(os.path.join(self._folder, f"{self.name}.bin"), "wb") as file:
            file.write(self._bytes)
        with open(os.path.join(self._folder, f"{self.name}.gltf"), "w") as file:
            json.dump({name: rows for name, rows in document.items() if rows} | ({"extensionsUsed": used} if used else {}), file)


_WRAPS = {"repeat": 10497, "clamp": 33071, "mirror": 33648}


def sampler(s, t):
    names = list(_WRAPS)
    return 3 * names.index(s) + names.index(t)
