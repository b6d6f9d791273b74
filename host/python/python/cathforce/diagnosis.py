"""Diagnosis of the gap between model and measurement."""

from __future__ import annotations

import os
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

from ._command import Progress, answer

Source = str | os.PathLike[str]


@dataclass(frozen=True)
class Estimate:
    """A parameter with its 90 % interval, in ``unit``."""

    value: float
    low: float
    high: float
    unit: str


@dataclass(frozen=True)
class NamedEffect:
    """An effect that the data name."""

    id: str
    parameters: Mapping[str, Estimate]
    #: Calibrated probability that the effect is there; None where it was asked for.
    confidence: float | None
    #: Share of the held-out gap that it closes, 0 to 1.
    shrink: float
    #: It closes a part of the gap that matters beside the nominal error.
    material: bool


@dataclass(frozen=True)
class Figures:
    """An error before and after the explanation, and of a perfect model; the key names the unit."""

    before: float
    after: float
    floor: float


@dataclass(frozen=True)
class Place:
    """A cell of the gap."""

    channel: str
    phase: str
    regime: str
    #: Arc along the vessel, from and to [m].
    arc_m: tuple[float, float] | None
    time_share: float
    gap_share: float
    note: str
    descriptors: Mapping[str, Any]


@dataclass(frozen=True)
class Experiment:
    """The motion to record next."""

    segment: str
    what: str
    separates: tuple[str, ...]


@dataclass(frozen=True)
class Diagnosis:
    """Where the gap lies, which effect causes it, and how far it shrinks.

    ``raw`` holds the whole answer, as ``cathforce gap diagnose --json`` prints it.
    """

    bundle: str
    #: "no_gap", "named", "partial" or "unknown".
    verdict: str
    #: Best explanation first.
    effects: tuple[NamedEffect, ...]
    confusable: tuple[tuple[str, ...], ...]
    #: Every effect that was tried alone, and the share of the gap that it closes.
    ranking: Mapping[str, float]
    gap: Mapping[str, Figures]
    held_out: tuple[int, ...]
    where: tuple[Place, ...]
    next_experiment: Experiment | None
    remarks: tuple[str, ...]
    raw: Mapping[str, Any] = field(repr=False)


def _effect(own: Mapping[str, Any]) -> NamedEffect:
    parameters = {
        name: Estimate(of["value"], of["low"], of["high"], of["unit"])
        for name, of in own["parameters"].items()
    }
    return NamedEffect(own["id"], parameters, own["confidence"], own["shrink"], own["material"])


def _place(own: Mapping[str, Any]) -> Place:
    arc = own.get("arc_m")
    return Place(
        channel=own["channel"],
        phase=own["phase"],
        regime=own["regime"],
        arc_m=None if arc is None else (arc[0], arc[1]),
        time_share=own["time_share"],
        gap_share=own["gap_share"],
        note=own["note"],
        descriptors=own.get("descriptors") or {},
    )


def _diagnosis(raw: Mapping[str, Any]) -> Diagnosis:
    following = raw.get("next_experiment")
    figures = {
        name: Figures(of["before"], of["after"], of["floor"])
        for name, of in raw["gap"].items()
        if isinstance(of, dict) and "floor" in of
    }
    return Diagnosis(
        bundle=raw["bundle"],
        verdict=raw["verdict"],
        effects=tuple(map(_effect, raw["effects"])),
        confusable=tuple(map(tuple, raw["confusable"])),
        ranking={own["id"]: own["shrink"] for own in raw["ranking"]},
        gap=figures,
        held_out=tuple(raw["held_out"]),
        where=tuple(map(_place, raw["where"])),
        next_experiment=following
        and Experiment(
            following["segment"], following.get("what", ""), tuple(following["separates"])
        ),
        remarks=tuple(raw["remarks"]),
        raw=raw,
    )


def _sources(given: Source | Sequence[Source]) -> list[str]:
    if isinstance(given, (str, os.PathLike)):
        return [os.fspath(given)]
    return [os.fspath(source) for source in given]


def diagnose(
    bundle: Source | Sequence[Source],
    *,
    hold_back: Iterable[int] = (),
    effects: Iterable[str] = (),
    report: Source | None = None,
    progress: Progress | None = None,
) -> Diagnosis:
    """Diagnoses a trial bundle, or recordings of runs of one rig.

    Args:
        bundle: folder of the bundle, or one or several recordings (MCAP).
        hold_back: numbers of trials that are left out.
        effects: fit these effects and no others; ``cathforce gap effects`` lists them.
        report: file of a self-contained web page with the answer.
        progress: called with a line now and then, for a diagnosis takes minutes.

    Raises:
        InputError: the bundle is wrong; the text names file and line.
        UsageError: a trial or an effect is not there.
    """
    words = ["gap", "diagnose", *_sources(bundle)]
    for number in hold_back:
        words += ["--hold-back", str(number)]
    for effect in effects:
        words += ["--effect", effect]
    if report is not None:
        words += ["--report", os.fspath(report)]
    return _diagnosis(answer(words, progress=progress))
