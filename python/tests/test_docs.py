"""The examples of docs/python.md and the typed program run."""

import pathlib
import re

import pytest
import typed

PAGE = pathlib.Path(__file__).resolve().parents[2] / "docs" / "python.md"


@pytest.mark.skipif(not PAGE.exists(), reason="not in the repository")
def test_quick_start(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    example = re.search(r"```python\n(import bth\n.*?)```", PAGE.read_text(), re.S)[1]
    exec(compile(example, str(PAGE), "exec"), {})
    assert "[ True False]" in capsys.readouterr().out
    assert (tmp_path / "tetrahedron.bth").exists()


def test_typed_program(tmp_path):
    typed.main(tmp_path)
