"""The examples in `examples/python` run, and their own checks hold."""

import runpy

import pytest


def test_jacobian_to_scipy(examples, monkeypatch, capsys):
    pytest.importorskip("scipy")
    monkeypatch.chdir(examples.parent)
    result = runpy.run_path(str(examples / "python" / "jacobian_to_scipy.py"))
    assert result["distance_hybr"] < 1e-9
    assert result["distance_krylov"] < 1e-9
    assert "hybr" in capsys.readouterr().out


def test_the_lines_of_the_readme(examples, monkeypatch):
    pytest.importorskip("scipy")
    monkeypatch.chdir(examples.parent)
    text = (examples.parent / "README.md").read_text(encoding="utf-8")
    [code] = [block.split("```")[0] for block in text.split("```python\n")[1:]]
    assert code.count("\n") <= 16
    exec(compile(code, "README.md", "exec"), {})
