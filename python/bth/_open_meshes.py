"""The warning about surfaces that have no inside."""

import sys
import warnings


class OpenMeshWarning(UserWarning):
    """Insides were asked of a scene with a surface that is not closed (docs/inside.md)."""


def warn_if_open(scene):
    """Warns once for each scene, at its first query of insides, if a visible object is open."""
    if scene._looked_for_open:
        return
    scene._looked_for_open = True
    obj = next(
        (obj for obj in scene._visible_objects() if scene.is_object_closed(obj) is False), None
    )
    if obj is None:
        return
    name = scene.object_names[obj]
    named = f" ({name})" if name else ""
    message = (
        f"object {obj}{named} is not closed, so it has no inside: "
        "answers about inside and outside are those of a ray along an axis "
        "(hint: Scene.is_object_closed tells which objects are closed)"
    )
    warnings.warn(message, OpenMeshWarning, stacklevel=_depth_of_caller())


def _depth_of_caller():
    """The `stacklevel` for `warn_if_open` at which the code that uses this package is."""
    depth, frame = 1, sys._getframe(1)
    while (
        frame.f_back is not None and frame.f_globals.get("__name__", "").partition(".")[0] == "bth"
    ):
        depth, frame = depth + 1, frame.f_back
    return depth
