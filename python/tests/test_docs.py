"""The examples of docs/python.md and the typed program run, and print what the page says."""

import pathlib
import re

import pytest
import typed

PAGE = pathlib.Path(__file__).resolve().parents[2] / "docs" / "python.md"


@pytest.mark.skipif(not PAGE.exists(), reason="not in the repository")
def test_examples(tmp_path, monkeypatch, capsys):
    pytest.importorskip("trimesh")
    monkeypatch.chdir(tmp_path)
    examples = re.findall(r"```python\n(.*?)```", PAGE.read_text(), re.S)
    assert len(examples) >= 7
    names, checked = {}, 0
    for example in examples:
        exec(compile(example, str(PAGE), "exec"), names)
        printed = " ".join(capsys.readouterr().out.split())
        # What stands behind a print is what it prints.
        for said in re.findall(r"^ *print\(.*\)  +# (.*)$", example, re.M):
            for part in said.split(", ") if "for " in example else [said]:
                assert " ".join(part.split()) in printed, (part, printed)
                checked += 1
    assert checked > 15 and (tmp_path / "tetrahedron.bth").exists()


def test_typed_program(tmp_path):
    typed.main(tmp_path)
