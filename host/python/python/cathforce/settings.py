"""All numbers that can be set by name."""

from __future__ import annotations

from dataclasses import dataclass

from . import _cathforce


@dataclass(frozen=True)
class Setting:
    """A number that ``settings`` and ``parameters`` take."""

    name: str
    #: Empty for a pure number.
    unit: str
    low: float
    high: float
    #: None for numbers that rig.toml states.
    default: float | None
    doc: str


def settings() -> dict[str, Setting]:
    """Every setting by its name, as ``cathforce config list`` has them."""
    return {row[0]: Setting(*row) for row in _cathforce.settings()}
