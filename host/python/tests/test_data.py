"""Recordings and bundles."""

from __future__ import annotations

from pathlib import Path

import cathforce
import numpy as np
import pytest
from conftest import BEND, EXAMPLES


def test_a_recording_is_tables_for_pandas_and_arrow(recording: Path) -> None:
    recorded = cathforce.read(recording)
    assert recorded.info["rig"] == "sticky-bend" and recorded.info["complete"]
    ticks = recorded.pandas()
    assert len(ticks) > 1500 and ticks["t_s"].diff().iloc[1:].between(0.0009, 0.0011).all()
    assert {"fx_N", "mx_N_m", "tip_x_m", "drive_fx_N"} <= set(ticks.columns)
    played = ticks[ticks["t_s"] >= 0]
    assert (played["mode"].iloc[:1000] == "armed").all()
    nodes = recorded.pandas("nodes")
    assert nodes["node"].max() > 5
    measured = recorded.pandas("measured")
    trial = cathforce.read_bundle(BEND).trials[0]
    assert np.array_equal(measured["insertion_m"], trial["insertion_m"][: len(measured)])
    frames = recorded.arrow("frames")
    assert frames.num_rows > 5 * len(ticks)
    assert "HAPTIC" in frames["name"].unique().to_pylist()
    with pytest.raises(cathforce.UsageError, match="one of ticks"):
        recorded.pandas("tick")


def test_what_is_no_recording_is_refused(tmp_path: Path) -> None:
    file = tmp_path / "a.mcap"
    file.write_bytes(b"no recording")
    with pytest.raises(cathforce.InputError, match="not an MCAP file"):
        cathforce.read(file)


@pytest.mark.parametrize("name", ["sticky-bend", "bend-guidewire", "two-tendons"])
def test_a_bundle_is_written_as_it_was_read(tmp_path: Path, name: str) -> None:
    own = cathforce.read_bundle(EXAMPLES / name)
    copy = cathforce.write_bundle(
        tmp_path / "copy", rig=own.rig_toml, trials=own.trials, centreline=own.centreline
    )
    assert copy.name == own.name and list(copy.trials) == list(own.trials)
    for number, columns in own.trials.items():
        assert list(columns) == list(copy.trials[number])
        for column in columns:
            assert np.array_equal(columns[column], copy.trials[number][column], equal_nan=True)
    for branch, stations in own.centreline.items():
        assert np.array_equal(stations, copy.centreline[branch])


def test_a_bundle_that_is_wrong_leaves_nothing(tmp_path: Path) -> None:
    own = cathforce.read_bundle(BEND)
    goal = tmp_path / "new"
    backwards = {"t_s": [0.0, -1.0], "insertion_m": [0.0, 0.0], "rotation_rad": [0.0, 0.0]}
    with pytest.raises(cathforce.InputError, match=r"new/trials/000.csv:3"):
        cathforce.write_bundle(
            goal, rig=own.rig_toml, trials={0: backwards}, centreline=own.centreline
        )
    short = {"t_s": [0.0], "insertion_m": [0.0, 0.0], "rotation_rad": [0.0]}
    with pytest.raises(cathforce.UsageError, match="equally long"):
        cathforce.write_bundle(goal, rig=own.rig_toml, trials={0: short}, centreline=own.centreline)
    assert list(tmp_path.iterdir()) == []
