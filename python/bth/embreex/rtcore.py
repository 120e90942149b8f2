"""Devices, which have nothing to do here."""

from .. import _native


class EmbreeDevice:
    def __repr__(self):
        return f"bth {_native.__version__} ({_native.isa()})"
