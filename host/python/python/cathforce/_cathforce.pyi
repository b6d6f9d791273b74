"""The compiled part of ``cathforce``."""

import os
from collections.abc import Mapping, Sequence
from typing import Any, ClassVar, final

import numpy as np
import numpy.typing as npt
from typing_extensions import Self

__all__ = [
    "Batch",
    "Model",
    "Simulator",
    "Snapshot",
    "Ticks",
    "read_recording",
    "read_trials",
    "settings",
]

_Path = str | os.PathLike[str]
#: float32, or float64 of a model in double precision.
_Reals = npt.NDArray[np.floating[Any]]
_Flags = npt.NDArray[np.bool_]
_Counts = npt.NDArray[np.unsignedinteger[Any]]

@final
class Model:
    """Rig, vessel and settings, ready to be simulated. It does not change, and any number of simulators share it."""

    MAX_LINKS: ClassVar[int]
    """Largest number of links, and of nodes, inside the vessel."""

    def __new__(
        cls,
        bundle: _Path,
        *,
        settings: Mapping[str, float] | None = None,
        dtype: str = "float32",
        tip: str | None = None,
        guidewire_tip: str | None = None,
        link_length_m: float | None = None,
    ) -> Self:
        """Reads a trial bundle and makes the model of its rig, which takes seconds."""
    @property
    def name(self) -> str: ...
    @property
    def bundle(self) -> str: ...
    @property
    def dtype(self) -> str: ...
    @property
    def columns(self) -> list[str]:
        """Names of the drives' positions, in the order of the columns of an array."""
    @property
    def reach_m(self) -> float:
        """The longest insertion that the links reach [m]."""
    @property
    def tick_s(self) -> float:
        """Time of a tick [s]."""
    @property
    def entry_position_m(self) -> list[float]:
        """Centre of the guide's mouth, x, y, z [m]."""
    @property
    def entry_direction(self) -> list[float]:
        """Unit vector of insertion."""
    @property
    def image(self) -> bytes:
        """The device image, which ``cathforce run`` sends to a board."""
    def value(self, name: str) -> float:
        """Value of a setting."""
    def effects(self) -> list[tuple[str, list[str], list[list[tuple[str, float, float]]]]]:
        """The effects that this rig can have: identifier, names of the coordinates of its place, and plausible
        sizes, each as names with the value without the effect and with it."""

@final
class Ticks:
    """Outputs of ticks: one number, or one vector, for each of them.

    In the shapes below ``…`` is the shape of the call: nothing for one tick, ``(ticks,)`` for many, ``(n,)`` or
    ``(n, ticks)`` of a batch. Forces and moments are those of the instrument on the vessel, in the rig's frame.
    """

    @property
    def shape(self) -> tuple[int, ...]: ...
    @property
    def force_on_vessel_n(self) -> _Reals:
        """Total contact force, (…, 3) [N]."""
    @property
    def moment_on_vessel_n_m(self) -> _Reals:
        """Total moment about the entry, (…, 3) [N·m]."""
    @property
    def drive_force_n(self) -> _Reals:
        """Axial force behind the guide, positive when pushing, (…) [N]."""
    @property
    def drive_torque_n_m(self) -> _Reals:
        """Torque behind the guide, (…) [N·m]."""
    @property
    def guidewire_force_n(self) -> _Reals:
        """The guidewire's axial force behind the guide, (…) [N]; zero without one."""
    @property
    def guidewire_torque_n_m(self) -> _Reals:
        """The guidewire's torque behind the guide, (…) [N·m]."""
    @property
    def peak_contact_force_n(self) -> _Reals:
        """Largest contact force at a node, (…) [N]; after ``Batch.move_to`` the largest of all its ticks."""
    @property
    def peak_node(self) -> _Counts:
        """The node with this force, 0 is the tip, (…)."""
    @property
    def links(self) -> _Counts:
        """Links inside the vessel, (…)."""
    @property
    def tip_m(self) -> _Reals:
        """The end of the instrument, (…, 3) [m]; NaN while it is in the guide."""
    @property
    def unresolved(self) -> _Flags:
        """The forces of the tick cannot be trusted, (…)."""
    @property
    def lost(self) -> _Flags:
        """No result of the tick was finite, (…)."""
    @property
    def refused(self) -> _Flags:
        """The tick refused the position of a drive, which moved too fast or too far, (…)."""
    @property
    def mode(self) -> _Counts:
        """Code of the device's mode, (…); 0 in double precision. Forces are computed in the modes ready (3), armed (4)
        and ramp (5) only."""
    @property
    def fault(self) -> _Counts:
        """Code of the device's fault, (…); 0 is none."""
    @property
    def limited(self) -> _Counts:
        """Bits of the limits that changed the output, (…)."""
    @property
    def haptic_force_n(self) -> _Reals:
        """Force on the operator's linear axis, (…) [N]."""
    @property
    def haptic_torque_n_m(self) -> _Reals:
        """Torque on the operator's rotary axis, (…) [N·m]."""
    @property
    def force_half_width_n(self) -> _Reals:
        """Half width of the band of the force, (…, 3) [N]; NaN where it is not known."""
    @property
    def digest(self) -> _Counts:
        """Rolling hash over all bits of all outputs since the reset, (…); 0 in double precision."""

@final
class Snapshot:
    """A state of a catheter. It stays as it is, however often it is restored."""

class Simulator:
    """One catheter in its vessel."""

    def __new__(cls, model: Model, *, faults: str = "raise") -> Self: ...
    @property
    def model(self) -> Model: ...
    def clear(self) -> None:
        """Back to the state directly after configuration, before the self-test."""
    def reset(
        self,
        insertion_m: float = 0.0,
        rotation_rad: float = 0.0,
        *,
        guidewire_insertion_m: float | None = None,
        guidewire_rotation_rad: float | None = None,
        tendons_m: Sequence[float] | None = None,
        armed: bool = False,
    ) -> None:
        """Lets the instrument come to rest at these positions of the drives.

        ``armed`` switches the operator's output on, as a run does; forces do not depend on it.
        """
    def step(
        self,
        insertion_m: float | None,
        rotation_rad: float | None = None,
        *,
        guidewire_insertion_m: float | None = None,
        guidewire_rotation_rad: float | None = None,
        tendons_m: Sequence[float] | None = None,
        command: str | None = None,
    ) -> Ticks:
        """One tick with the drives at new positions; what is not given stays.

        ``insertion_m`` of None is a tick without a sample of the encoders. ``command``: "self_test", "arm" or
        "disarm".
        """
    def step_many(self, positions: npt.ArrayLike) -> Ticks:
        """Many ticks. ``positions``: (ticks, columns), the columns of ``Model.columns`` [m, rad]."""
    def move_to(self, position: npt.ArrayLike, ticks: int) -> Ticks:
        """Moves all drives evenly to ``position``, (columns,), in a number of ticks."""
    def snapshot(self) -> Snapshot:
        """The state, to come back to."""
    def restore(self, snapshot: Snapshot) -> None:
        """Comes back to a state of the same model."""
    @property
    def position(self) -> _Reals:
        """Where the drives are, (columns,) [m, rad]."""
    @property
    def shape_m(self) -> _Reals:
        """Nodes inside the vessel from the tip on, (nodes, 3) [m]."""
    @property
    def contact_forces_n(self) -> _Reals:
        """Contact force on the vessel around each node, (nodes, 3) [N]."""
    @property
    def tendon_tensions_n(self) -> _Reals:
        """Tension of each driven tendon at its drive and at its anchor, (tendons, 2) [N]."""

class Batch:
    """``n`` independent catheters."""

    def __new__(
        cls, model: Model, n: int, *, parameters: Mapping[str, npt.ArrayLike] | None = None
    ) -> Self: ...
    @property
    def model(self) -> Model: ...
    @property
    def n(self) -> int: ...
    def __len__(self) -> int: ...
    def reset(
        self,
        positions: npt.ArrayLike | None = None,
        *,
        which: npt.ArrayLike | None = None,
        parameters: Mapping[str, npt.ArrayLike] | None = None,
        snapshot: Snapshot | None = None,
        armed: bool = False,
    ) -> None:
        """Lets catheters come to rest at these positions of the drives, (k, columns).

        ``which``: a mask (n,) or indices (k,); all of them without it. ``parameters``: numbers of rig and effects by
        name, one for all or (k,); they replace those of an earlier call. ``snapshot``: the state of a single
        catheter, which all of them take.
        """
    def step(self, positions: npt.ArrayLike) -> Ticks:
        """One tick. ``positions``: (n, columns)."""
    def step_many(self, positions: npt.ArrayLike) -> Ticks:
        """Many ticks. ``positions``: (n, ticks, columns)."""
    def move_to(self, positions: npt.ArrayLike, ticks: int) -> Ticks:
        """Moves all drives evenly to ``positions``, (n, columns). The outputs, (n,), are those of the last tick, with
        the largest contact force of all ticks, and with the flags that any of them has."""
    def snapshot(self, index: int) -> Snapshot:
        """The state of one catheter."""
    def select(self, indices: npt.ArrayLike) -> None:
        """Each catheter becomes a copy of the one with its index, (n,): the resampling of a particle filter."""
    @property
    def positions(self) -> _Reals:
        """Where the drives are, (n, columns) [m, rad]."""
    @property
    def shape_m(self) -> _Reals:
        """Nodes inside the vessel, (n, MAX_LINKS, 3) [m]; NaN beyond them."""
    @property
    def contact_forces_n(self) -> _Reals:
        """Contact force on the vessel around each node, (n, MAX_LINKS, 3) [N]; NaN beyond the nodes."""

def settings() -> list[tuple[str, str, float, float, float | None, str]]: ...
def read_recording(recording: _Path) -> dict[str, Any]: ...
def read_trials(bundle: _Path) -> tuple[str, dict[int, Any], dict[str, Any], list[str]]: ...
