"""Settings that somebody names, fitted to measured trials."""

from __future__ import annotations

import os
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

from ._command import Progress, answer
from .diagnosis import Source, _sources

#: Names, or names with their bounds or None.
Parameters = Iterable[str] | Mapping[str, "tuple[float, float] | None"]


@dataclass(frozen=True)
class Parameter:
    """A fitted setting, in ``unit``."""

    name: str
    unit: str
    bounds: tuple[float, float]
    start: float
    fitted: float
    #: 90 % interval.
    interval: tuple[float, float] | None
    at_bound: bool
    #: The data tell it better than its prior does.
    told_by_data: bool


@dataclass(frozen=True)
class Error:
    """RMS of a quantity: of the nominal model, fitted, on trials held out, and of a perfect model."""

    quantity: str
    unit: str
    before: float
    after: float
    held_out: float | None
    floor: float


@dataclass(frozen=True)
class Calibration:
    """The fitted settings. ``raw`` holds the whole answer of ``cathforce calibrate --json``."""

    parameters: tuple[Parameter, ...]
    errors: tuple[Error, ...]
    method: str
    evaluations: int
    #: Of these, what an interrupted run had done.
    resumed: int
    #: Pairs of which the data tell a combination only, with their correlation.
    not_identifiable: tuple[tuple[str, str, float], ...]
    notes: tuple[str, ...]
    raw: Mapping[str, Any] = field(repr=False)

    @property
    def settings(self) -> dict[str, float]:
        """The fitted values, as :class:`cathforce.Simulator` takes them."""
        return {own.name: own.fitted for own in self.parameters}


def _parameter(own: Mapping[str, Any]) -> Parameter:
    interval = own["interval"]
    return Parameter(
        name=own["name"],
        unit=own["unit"],
        bounds=(own["bounds"][0], own["bounds"][1]),
        start=own["start"],
        fitted=own["fitted"],
        interval=None if interval is None else (interval[0], interval[1]),
        at_bound=own["at_bound"],
        told_by_data=own["told_by_data"],
    )


def _error(own: Mapping[str, Any]) -> Error:
    names = ("quantity", "unit", "before", "after", "held_out", "floor")
    return Error(**{name: own[name] for name in names})


def _calibration(raw: Mapping[str, Any]) -> Calibration:
    pairs = (
        (own["parameters"][0], own["parameters"][1], own["correlation"])
        for own in raw["not_identifiable"]
    )
    return Calibration(
        parameters=tuple(map(_parameter, raw["parameters"])),
        errors=tuple(map(_error, raw["errors"])),
        method=raw["method"],
        evaluations=raw["evaluations"],
        resumed=raw["resumed"],
        not_identifiable=tuple(pairs),
        notes=tuple(raw["notes"]),
        raw=raw,
    )


def _asked(parameters: Parameters) -> str:
    if not isinstance(parameters, Mapping):
        return ",".join(parameters)
    texts = (
        name if bounds is None else f"{name}={bounds[0]!r}..{bounds[1]!r}"
        for name, bounds in parameters.items()
    )
    return ",".join(texts)


def calibrate(
    bundle: Source | Sequence[Source],
    parameters: Parameters,
    *,
    method: str = "auto",
    budget: int | None = None,
    seed: int = 1,
    hold_back: Iterable[int] = (),
    state: Source | None = None,
    resume: bool = False,
    settings: Source | None = None,
    progress: Progress | None = None,
) -> Calibration:
    """Fits settings to all trials of bundles and recordings.

    Args:
        bundle: folder of a bundle or a recording, or several of them.
        parameters: names of settings or effects, or a dictionary of names with bounds ``(low, high)`` or None.
        method: "auto", "cross-entropy", "cma-es" or "multi-start".
        budget: most evaluations of the search, each of which simulates every trial once.
        seed: the same seed gives the same answer.
        hold_back: trials that are not fitted, and on which the error is reported.
        state: file that keeps what is known; an interrupted call leaves it there.
        resume: go on from that file.
        settings: settings file to write the result into.
        progress: called with a line now and then.
    """
    words = ["calibrate", *_sources(bundle), "--parameters", _asked(parameters)]
    words += ["--method", method, "--seed", str(seed)]
    for number in hold_back:
        words += ["--hold-back", str(number)]
    if budget is not None:
        words += ["--budget", str(budget)]
    if state is not None:
        words += ["--state", os.fspath(state)]
    if resume:
        words += ["--resume"]
    if settings is not None:
        words += ["--settings", os.fspath(settings)]
    return _calibration(answer(words, progress=progress))
