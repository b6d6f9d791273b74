"""Rigs that differ from the nominal one, drawn from the catalogue of effects."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from ._cathforce import Model
from .errors import UsageError
from .settings import settings

#: The name of all effects of the catalogue.
CATALOGUE = "catalogue"
#: An effect is drawn up to this many times its plausible size.
_LARGEST = 1.5


@dataclass(frozen=True)
class Draw:
    """The effect of an episode, or None, and the parameters that it sets."""

    effect: str | None
    parameters: dict[str, float]


class Randomisation:
    """Draws an effect of the catalogue, or numbers of named settings.

    Args:
        model: the nominal rig.
        of: ``"catalogue"``, identifiers of effects (those of a diagnosis, for example), or a dictionary of settings
            with ``(low, high)``. None draws nothing.
        share: share of the draws that are nominal.
    """

    def __init__(
        self,
        model: Model,
        of: str | Iterable[str] | Mapping[str, tuple[float, float]] | None,
        share: float = 0.2,
    ) -> None:
        self._ranges = dict(of) if isinstance(of, Mapping) else {}
        self._share = share
        self._known = settings()
        effects = {own[0]: own for own in model.effects()}
        if of is None or isinstance(of, Mapping):
            wanted: list[str] = []
        elif of == CATALOGUE:
            wanted = list(effects)
        else:
            wanted = [of] if isinstance(of, str) else list(of)
        absent = [name for name in wanted if name not in effects]
        if absent:
            raise UsageError(
                f"this rig cannot have {' or '.join(absent)}\n  fix: \"catalogue\", or some of {', '.join(effects)}"
            )
        unknown = [name for name in self._ranges if name not in self._known]
        if unknown:
            raise UsageError(f"there is no setting {unknown[0]}\n  fix: cathforce.settings() lists them")
        self._effects = [effects[name] for name in wanted]

    @property
    def effects(self) -> tuple[str, ...]:
        """The effects that it draws from."""
        return tuple(own[0] for own in self._effects)

    def draw(self, random: np.random.Generator, positions_m: np.ndarray) -> Draw:
        """The next rig. ``positions_m``: (stations, 3), where an effect with a place may be [m]."""
        parameters = {
            name: float(random.uniform(low, high)) for name, (low, high) in self._ranges.items()
        }
        if not self._effects or random.random() < self._share:
            return Draw(None, parameters)
        effect, place, sizes = self._effects[int(random.integers(len(self._effects)))]
        size: list[tuple[str, float, float]] = sizes[int(random.integers(len(sizes)))]
        amount = float(random.uniform(0.0, _LARGEST))
        for name, off, value in size:
            parameters[name] = self._within(name, off + amount * (value - off))
        if place:
            at = positions_m[int(random.integers(len(positions_m)))]
            parameters.update(zip(place, map(float, at), strict=False))
        return Draw(effect, parameters)

    def _within(self, name: str, value: float) -> float:
        own: Any = self._known[name]
        return float(np.clip(value, own.low, own.high))
