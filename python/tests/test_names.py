"""Our names in docs/names.md exist, in Python, in the header and in the sources in Rust."""

import pathlib
import re

import pytest

import bth

ROOT = pathlib.Path(__file__).resolve().parents[2]
PAGE = ROOT / "docs" / "names.md"

pytestmark = pytest.mark.skipif(not PAGE.exists(), reason="not in the repository")


def column(number):
    """The names in code in a column of the first table, without arguments."""
    rows = [line.split("|")[1:-1] for line in PAGE.read_text().split("## ")[0].splitlines() if line.startswith("|")][2:]
    assert len(rows) > 10
    return [name for row in rows for name in re.findall(r"`([A-Za-z_]+)`", row[number])]


def test_names_of_python():
    names = column(1)
    assert len(names) > 12
    for name in names:
        assert hasattr(bth, name) or hasattr(bth.Scene, name), name


def test_names_of_rust():
    sources = "\n".join(path.read_text() for path in (ROOT / "src" / "bth" / "src").rglob("*.rs"))
    names = column(2)
    assert len(names) > 12
    for name in names:
        assert re.search(rf"\bpub (unsafe )?fn {name}\b", sources), name


def test_names_of_c():
    header = (ROOT / "src" / "bth-capi" / "include" / "bth.h").read_text()
    names = column(3)
    assert len(names) > 12
    for name in names:
        assert re.search(rf"\b{name}\s*\(|#define {name}\b", header), name
