"""Diagnosis and calibration."""

from __future__ import annotations

import _thread
import json
import subprocess
import threading
import time
from pathlib import Path

import cathforce
import pytest
from conftest import BEND


def test_a_diagnosis_is_that_of_the_command_line(rough: Path, program: str) -> None:
    lines: list[str] = []
    found = cathforce.diagnose(rough, effects=["contact.friction"], progress=lines.append)
    assert found.verdict in ("named", "partial") and lines
    [effect] = found.effects
    [estimate] = effect.parameters.values()
    assert estimate.low < 0.45 < estimate.high
    assert found.gap["force_rms_N"].after < found.gap["force_rms_N"].before
    words = [program, "gap", "diagnose", str(rough), "--effect", "contact.friction", "--json"]
    said = subprocess.run(words, capture_output=True, text=True, check=True)
    own, other = (dict(answer) for answer in (found.raw, json.loads(said.stdout)))
    assert own.pop("seconds") > 0.0 and other.pop("seconds") > 0.0
    assert own == other


def test_a_calibration_finds_what_the_trials_were_made_with(rough: Path, tmp_path: Path) -> None:
    found = cathforce.calibrate(
        rough,
        {"wall.friction_coefficient": (0.1, 0.8)},
        budget=40,
        state=tmp_path / "state.json",
    )
    [own] = found.parameters
    assert own.interval is not None and own.interval[0] < 0.45 < own.interval[1]
    assert own.told_by_data and found.settings == {"wall.friction_coefficient": own.fitted}
    assert found.errors[0].after < found.errors[0].before


def test_errors_have_the_texts_of_the_command_line(rough: Path) -> None:
    with pytest.raises(cathforce.InputError, match="nowhere/rig.toml: cannot be read"):
        cathforce.diagnose("nowhere")
    with pytest.raises(cathforce.UsageError, match="contact.friction"):
        cathforce.diagnose(rough, effects=["contact.fricton"])
    with pytest.raises(cathforce.UsageError, match=r"0\.6 is not below 0\.1"):
        cathforce.calibrate(rough, {"wall.friction_coefficient": (0.6, 0.1)})


def test_ctrl_c_ends_the_program_too(tmp_path: Path) -> None:
    timer = threading.Timer(2.0, _thread.interrupt_main)
    began = time.monotonic()
    timer.start()
    with pytest.raises(KeyboardInterrupt):
        cathforce.diagnose(BEND)
    assert time.monotonic() - began < 15.0
    listed = subprocess.run(["ps", "-eo", "args"], capture_output=True, text=True, check=True)
    assert f"diagnose {BEND}" not in listed.stdout
