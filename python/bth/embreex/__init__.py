"""A drop-in for `embreex`: change `from embreex import …` to `from bth.embreex import …`, or call `bth.embreex.install()` before it is imported."""

import sys

from . import mesh_construction, rtcore, rtcore_scene


def install():
    """Lets `import embreex` find this package."""
    sys.modules["embreex"] = sys.modules[__name__]
    for module in (mesh_construction, rtcore, rtcore_scene):
        sys.modules["embreex." + module.__name__.rpartition(".")[2]] = module
