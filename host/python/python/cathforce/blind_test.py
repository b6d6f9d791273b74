"""Blind tests of the diagnosis: cases whose true effects are sealed until every case is answered.

``cathforce gap blind-test make`` draws the cases and ``seal`` seals them.
"""

from __future__ import annotations

import json
import os
from pathlib import Path
from typing import Any

from ._command import Progress, answer, run
from .diagnosis import Diagnosis, Source, _diagnosis
from .errors import InputError, UsageError


def _cases(folder: Source) -> list[str]:
    """The sealed cases, in order."""
    file = Path(folder) / "seals.json"
    if not file.exists():
        raise UsageError(
            f"{file}: there is no such file, so nothing is sealed\n  fix: `cathforce gap blind-test seal`"
        )
    try:
        return sorted(json.loads(file.read_text(encoding="utf-8"))["labels"])
    except (ValueError, KeyError, TypeError) as error:
        raise InputError(f"{file}: these are no seals of a blind test ({error})") from error


def _answer_file(folder: Source, case: str) -> Path:
    return Path(folder) / "answers" / f"{case}.json"


def _answers(folder: Source) -> dict[str, Diagnosis]:
    """The answers that are there."""
    files = {case: _answer_file(folder, case) for case in _cases(folder)}
    return {
        case: _diagnosis(json.loads(file.read_text(encoding="utf-8")))
        for case, file in files.items()
        if file.exists()
    }


def _run_case(folder: str, case: str) -> str:
    """Answers one case, unless it is answered."""
    run(["gap", "blind-test", "run", folder, "--case", case])
    return case


def run_blind_test(folder: Source, *, progress: Progress | None = None) -> dict[str, Diagnosis]:
    """Diagnoses every sealed case that has no answer yet; the answers are kept in ``folder/answers``.

    Args:
        folder: of the blind test.
        progress: called with a line for each case.

    Returns:
        The answer of each case.
    """
    _cases(folder)
    run(["gap", "blind-test", "run", os.fspath(folder)], progress=progress)
    return _answers(folder)


def score_blind_test(folder: Source) -> dict[str, Any]:
    """Reveals the sealed effects and scores the answers, as ``cathforce gap blind-test score --json`` does.

    Raises:
        InputError: a case is not answered, or a label is not the one that was sealed.
    """
    [score] = answer(["gap", "blind-test", "score", os.fspath(folder)])
    return dict(score)
