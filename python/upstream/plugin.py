"""A plugin for pytest that puts bth in the place of embreex before tests import it."""

import importlib.util

import bth.embreex

bth.embreex.install()
if importlib.util.find_spec("trimesh"):
    import bth.trimesh

    bth.trimesh.install()
