"""Cathforce: contact forces of a catheter by the tick of the device, bit for bit.

>>> import cathforce
>>> simulator = cathforce.Simulator("my-rig")
>>> ticks = simulator.move_to([0.05, 0.0], ticks=1000)
>>> ticks.force_on_vessel_n[-1]

Lengths are in metres, forces in newtons, angles in radians, times in seconds; names say so.
"""

from __future__ import annotations

from ._cathforce import Model, Snapshot, Ticks
from .errors import (
    CathforceError,
    CathforceWarning,
    CommandError,
    FaultError,
    InputError,
    UsageError,
)
from .simulation import Batch, Simulator

__all__ = [
    "Batch",
    "CathforceError",
    "CathforceWarning",
    "CommandError",
    "FaultError",
    "InputError",
    "Model",
    "Simulator",
    "Snapshot",
    "Ticks",
    "UsageError",
]
