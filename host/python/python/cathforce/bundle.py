"""Trial bundles, read and written."""

from __future__ import annotations

import csv
import os
import shutil
import tempfile
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from ._cathforce import read_trials
from .errors import InputError, UsageError

if TYPE_CHECKING:
    import pandas

Columns = Mapping[str, Any]

_BRANCH = ("s_m", "x_m", "y_m", "z_m", "radius_m")


@dataclass(frozen=True)
class Bundle:
    """A rig, its vessel and what was measured on it.

    ``trials``: columns of each trial by its number, numpy arrays whose names say the units; NaN where nothing was
    measured.
    ``centreline``: arrays (stations, 5) of ``s_m, x_m, y_m, z_m, radius_m`` [m] by the names of the branches.
    """

    path: Path
    name: str
    rig_toml: str = field(repr=False)
    trials: Mapping[int, Columns] = field(repr=False)
    centreline: Mapping[str, Any] = field(repr=False)
    #: What looks wrong but prevents nothing.
    warnings: tuple[str, ...]

    def pandas(self, trial: int) -> pandas.DataFrame:
        """A trial as a data frame of pandas."""
        import pandas

        if trial not in self.trials:
            there = ", ".join(f"{number:03}" for number in self.trials)
            raise UsageError(f"{self.path}: there is no trial {trial:03}, there are: {there}")
        return pandas.DataFrame(dict(self.trials[trial]))


def read_bundle(bundle: str | os.PathLike[str]) -> Bundle:
    """Reads a trial bundle whole, as strictly as the command line does."""
    name, trials, branches, said = read_trials(bundle)
    text = (Path(bundle) / "rig.toml").read_text(encoding="utf-8")
    return Bundle(Path(bundle), name, text, trials, branches, tuple(said))


def write_bundle(
    folder: str | os.PathLike[str],
    *,
    rig: str,
    trials: Mapping[int, Columns],
    centreline: Mapping[str, Any] | None = None,
    vessel: str | os.PathLike[str] | None = None,
    readme: str | None = None,
) -> Bundle:
    """Writes a trial bundle and reads it back, so that one that is wrong is refused with file and line.

    Args:
        folder: the new folder; it must not exist yet. On an error nothing of it is left.
        rig: text of ``rig.toml``.
        trials: columns by the numbers of the trials; a dictionary of arrays or a data frame with the columns of
            the trial bundle, such as ``t_s``, ``insertion_m``, ``rotation_rad``, ``fx_N``. NaN is an empty field.
        centreline: arrays (stations, 5) of ``s_m, x_m, y_m, z_m, radius_m`` [m] by the names of the branches.
        vessel: STL file of the lumen in millimetres. A bundle needs a centre line or a vessel.
        readme: text of ``README.md``: how it was measured.
    """
    goal = Path(folder)
    if goal.exists():
        raise UsageError(f"{goal} is there already\n  fix: name a folder that is not there yet")
    goal.parent.mkdir(parents=True, exist_ok=True)
    part = Path(tempfile.mkdtemp(prefix=f".{goal.name}.", dir=goal.parent))
    try:
        (part / "rig.toml").write_text(rig, encoding="utf-8")
        if readme is not None:
            (part / "README.md").write_text(readme, encoding="utf-8")
        if vessel is not None:
            shutil.copyfile(vessel, part / "vessel.stl")
        if centreline is not None:
            _write_centreline(part / "centreline.csv", centreline)
        (part / "trials").mkdir()
        for number, columns in trials.items():
            _write_trial(part / "trials" / f"{number:03}.csv", number, columns)
        try:
            read_trials(part)
        except InputError as error:
            # The folder that was asked for is the one that the reader knows.
            raise InputError(str(error).replace(str(part), str(goal))) from None
        part.chmod(0o755)
        part.rename(goal)
    except BaseException:
        shutil.rmtree(part, ignore_errors=True)
        raise
    return read_bundle(goal)


def _write_centreline(file: Path, branches: Mapping[str, Any]) -> None:
    with file.open("w", newline="", encoding="utf-8") as out:
        rows = csv.writer(out, lineterminator="\n")
        rows.writerow(("branch", *_BRANCH))
        for name, stations in branches.items():
            array = np.asarray(stations, dtype=float)
            if array.ndim != 2 or array.shape[1] != len(_BRANCH):
                raise UsageError(
                    f"centreline {name}: the shape is {array.shape}, and it must be (stations, 5): "
                    f"{', '.join(_BRANCH)}"
                )
            rows.writerows((name, *map(_text, station)) for station in array)


def _write_trial(file: Path, number: int, columns: Columns) -> None:
    arrays = {str(name): np.asarray(columns[name], dtype=float) for name in columns}
    lengths = {name: array.shape for name, array in arrays.items()}
    if len(set(lengths.values())) > 1 or any(array.ndim != 1 for array in arrays.values()):
        shapes = ", ".join(f"{name} {shape}" for name, shape in lengths.items())
        raise UsageError(f"trial {number:03}: columns must be equally long: {shapes}")
    with file.open("w", newline="", encoding="utf-8") as out:
        rows = csv.writer(out, lineterminator="\n")
        rows.writerow(arrays)
        for row in zip(*arrays.values(), strict=True):
            rows.writerow(map(_text, row))


def _text(value: float) -> str:
    """A number that reads back exactly; nothing for NaN."""
    return "" if np.isnan(value) else repr(float(value))
