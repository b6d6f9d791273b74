"""What several tests need."""

from __future__ import annotations

import os
from pathlib import Path

import cathforce
import pytest

ROOT = Path(__file__).parents[3]
EXAMPLES = ROOT / "examples"

#: A centre line without a mesh: its lumen takes a moment.
BEND = EXAMPLES / "sticky-bend"


@pytest.fixture(scope="session")
def program() -> str:
    """The program of this build, which the suite names."""
    return os.environ["CATHFORCE_PROGRAM"]


@pytest.fixture(scope="session")
def model() -> cathforce.Model:
    return cathforce.Model(BEND)


@pytest.fixture(scope="session")
def recording(tmp_path_factory: pytest.TempPathFactory, program: str) -> Path:
    """A trial played on a device in a process of its own."""
    from cathforce._command import run

    file = tmp_path_factory.mktemp("recording") / "bend.mcap"
    run(["simulate", BEND, "--duration", "1.5", "--out", file])
    return file


@pytest.fixture(scope="session")
def rough(tmp_path_factory: pytest.TempPathFactory, program: str) -> Path:
    """Two trials with more friction than the rig states, and the noise that it states."""
    from cathforce._command import run

    folder = tmp_path_factory.mktemp("bundles") / "rough"
    for trial in ("0", "1"):
        words = ["simulate", BEND, "--trial", trial, "--set", "wall.friction_coefficient=0.45"]
        run([*words, "--noise", "--duration", "1.6", "--as-trial", folder, "--out", folder.parent / f"{trial}.mcap"])
    return folder
