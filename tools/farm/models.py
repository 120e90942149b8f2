"""Models and scenes for the tests."""


def model(rings):
    """A closed solid of revolution with a rough profile, as OBJ."""
    radius = lambda i: (0 if i in (0, rings) else 8 + (i * 7) % 5)
    turn = [(4, 0), (3, 3), (0, 4), (-3, 3), (-4, 0), (-3, -3), (0, -4), (3, -3)]
    lines = [f"v {radius(i) * x} {10 * i} {radius(i) * y}" for i in range(rings + 1) for x, y in turn]
    for i in range(rings):
        for j in range(8):
            a, b = 8 * i + j + 1, 8 * i + (j + 1) % 8 + 1
            lines.append(f"f {a} {b} {b + 8} {a + 8}")
    return "\n".join(lines) + "\n"


def scene(folder, objects, frames):
    """A manifest of so many objects that move over so many frames."""
    text = f"version = 1\nframes = {{ first = 0, last = {frames - 1}, rate = 12 }}\n"
    for i in range(objects):
        (folder / f"{i}.obj").write_text(model(40 + 10 * i))
        text += f'[[objects]]\nname = "o{i}"\nmodel = "{i}.obj"\n'
        text += f'[[nodes]]\nname = "n{i}"\nobject = "o{i}"\ntranslation = [{100 * i}, 0, 0]\n'
        text += f'[[tracks]]\nnode = "n{i}"\nproperty = "translation"\ntimes = [0, 1]\n'
        text += f"values = [[{100 * i}, 0, 0], [{100 * i}, {20 * i}, 50]]\n"
    (folder / "s.manifest").write_text(text)
    return folder / "s.manifest"
