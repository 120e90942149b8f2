"""A plugin for pytest that puts bth in the place of embreex and of Open3D's class before tests import them."""

import importlib.util
import sys
import types

import bth.embreex

bth.embreex.install()
if importlib.util.find_spec("trimesh"):
    import bth.trimesh

    bth.trimesh.install()
if importlib.util.find_spec("open3d"):
    import open3d

    import bth.open3d

    open3d.t.geometry.RaycastingScene = bth.open3d.RaycastingScene
    # What the tests of Open3D take from a module of its repository.
    sys.modules["open3d_test"] = types.SimpleNamespace(list_devices=lambda **_: [open3d.core.Device("CPU:0")])
