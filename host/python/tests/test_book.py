"""The code of the page `docs/how-to/use-from-python.md`, and what it says that it prints."""

from __future__ import annotations

import contextlib
import io
import re
import shutil
from pathlib import Path
from typing import Any

import pytest
from conftest import BEND, ROOT

PAGE = ROOT / "docs/how-to/use-from-python.md"


def test_the_code_of_the_page_does_what_it_says(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    shutil.copytree(BEND, tmp_path / "examples/sticky-bend")
    monkeypatch.chdir(tmp_path)
    blocks = re.findall(r"```python\n(.*?)```", PAGE.read_text(encoding="utf-8"), re.DOTALL)
    assert len(blocks) >= 8
    names: dict[str, Any] = {}
    compared = 0
    for block in blocks:
        said = io.StringIO()
        with contextlib.redirect_stdout(said):
            exec(compile(block, str(PAGE), "exec"), names)
        expected = re.findall(r"^print\(.*\)  # (.*)$", block, re.MULTILINE)
        assert said.getvalue().splitlines() == expected
        compared += len(expected)
    assert compared == 5
    assert names["simulator"].position[0] == pytest.approx(0.075)


def test_the_page_reads_a_recording_as_it_says(recording: Path) -> None:
    names: dict[str, Any] = {}
    page = PAGE.read_text(encoding="utf-8")
    [block] = re.findall(r"```python\n(from cathforce import read.*?)```", page, re.DOTALL)
    exec(compile(block, str(PAGE), "exec"), names)
    assert names["largest_force_n"](recording) > 0.0
