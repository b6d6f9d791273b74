"""Cathforce: contact forces of a catheter by the tick of the device, bit for bit.

>>> import cathforce
>>> simulator = cathforce.Simulator("my-rig")
>>> ticks = simulator.move_to([0.05, 0.0], ticks=1000)
>>> ticks.force_on_vessel_n[-1]

Lengths are in metres, forces in newtons, angles in radians, times in seconds; names say so.
"""

from __future__ import annotations

from importlib.metadata import PackageNotFoundError
from importlib.metadata import version as _version

from ._cathforce import Model, Snapshot, Ticks
from .blind_test import run_blind_test, score_blind_test
from .bundle import Bundle, read_bundle, write_bundle
from .calibration import Calibration, calibrate
from .diagnosis import Diagnosis, diagnose
from .errors import (
    CathforceError,
    CathforceWarning,
    CommandError,
    FaultError,
    InputError,
    UsageError,
)
from .recording import Recording, read
from .settings import Setting, settings
from .simulation import Batch, Simulator

try:
    __version__ = _version("cathforce")
except PackageNotFoundError:  # Used from the source folder.
    __version__ = "unknown"

__all__ = [
    "Batch",
    "Bundle",
    "Calibration",
    "CathforceError",
    "CathforceWarning",
    "CommandError",
    "Diagnosis",
    "FaultError",
    "InputError",
    "Model",
    "Recording",
    "Setting",
    "Simulator",
    "Snapshot",
    "Ticks",
    "UsageError",
    "calibrate",
    "diagnose",
    "read",
    "read_bundle",
    "run_blind_test",
    "score_blind_test",
    "settings",
    "write_bundle",
]
