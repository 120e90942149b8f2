"""Errors of the bakers, with the codes of docs/reference.md."""

from .. import Error


def coded(code: str, message: str) -> Error:
    """An error with a code: what is wrong with a model, or what it lacks."""
    error = Error(f"{code}: {message}")
    error.code = code
    return error


def lacks_geometry() -> Error:
    what = "the file has no positions and triangles, which surfaces are made of"
    return coded("BTH-P001", f"{what} (hint: compile the model without --no-geometry)")


def lacks_texture_coordinates() -> Error:
    what = "the model has no texture coordinates, which place the texels of a texture"
    return coded("BTH-P001", f"{what} (hint: write vertex colours to a .ply, or compile the .bth file with --attributes all)")


def lacks_surface() -> Error:
    return coded("BTH-P001", "there is no triangle with an area to be seen at this time (hint: python -m bth info shows what is in the file)")
