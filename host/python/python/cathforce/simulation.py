"""One catheter, and many of them."""

from __future__ import annotations

import os
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from . import _cathforce
from ._cathforce import Model

if TYPE_CHECKING:
    from typing_extensions import Self

Bundle = str | os.PathLike[str] | Model


def _model(bundle: Bundle, keywords: dict[str, Any]) -> Model:
    given = {name: value for name, value in keywords.items() if value is not None}
    if isinstance(bundle, Model):
        if given:
            from .errors import UsageError

            raise UsageError(
                f"{', '.join(given)}: a model has them already\n  fix: give them to Model(…)"
            )
        return bundle
    return Model(bundle, **given)


class Simulator(_cathforce.Simulator):
    """One catheter in its vessel, computed by the tick of the device.

    Args:
        bundle: folder of a trial bundle, or a :class:`Model` that several simulators share.
        settings: numbers by the names that ``cathforce config list`` lists, effects included, for example
            ``{"effects.wall.stiffness.factor": 0.5}``.
        dtype: ``"float32"``, which has the bits of the device, or ``"float64"`` for studies: the model
            without the device's limits, modes and digest.
        tip, guidewire_tip: a common tip instead of the rig's own, as ``--tip`` on the command line.
        link_length_m: length of a link of the shaft [m]; otherwise from the bundle's trials.
        faults: ``"raise"`` makes a fault of the device a :class:`FaultError`; ``"report"`` leaves it to
            :attr:`Ticks.fault`.

    A simulator begins at rest with the instrument in the guide. It may be used from several threads; long
    calls release the interpreter's lock, and Ctrl-C ends them between two ticks.
    """

    def __new__(
        cls,
        bundle: Bundle,
        *,
        settings: Mapping[str, float] | None = None,
        dtype: str | None = None,
        tip: str | None = None,
        guidewire_tip: str | None = None,
        link_length_m: float | None = None,
        faults: str = "raise",
    ) -> Self:
        keywords = dict(
            settings=None if settings is None else dict(settings),
            dtype=dtype,
            tip=tip,
            guidewire_tip=guidewire_tip,
            link_length_m=link_length_m,
        )
        made = super().__new__(cls, _model(bundle, keywords), faults=faults)
        made.reset()
        return made

    def __init__(self, *_: object, **__: object) -> None:
        pass


class Batch(_cathforce.Batch):
    """``n`` independent catheters of one rig, stepped together on all cores.

    Each has the bits of a single :class:`Simulator`, in whatever company it is. A batch reports faults in
    :attr:`Ticks.fault` and positions that a device refused in :attr:`Ticks.refused`; it raises neither.

    Args:
        bundle, settings, dtype, tip, guidewire_tip, link_length_m: as of :class:`Simulator`.
        n: number of catheters.
        parameters: numbers of rig and effects by name; one for all, or an array (n,) with one for each.
    """

    def __new__(
        cls,
        bundle: Bundle,
        n: int,
        *,
        parameters: Mapping[str, Any] | None = None,
        settings: Mapping[str, float] | None = None,
        dtype: str | None = None,
        tip: str | None = None,
        guidewire_tip: str | None = None,
        link_length_m: float | None = None,
    ) -> Self:
        keywords = dict(
            settings=None if settings is None else dict(settings),
            dtype=dtype,
            tip=tip,
            guidewire_tip=guidewire_tip,
            link_length_m=link_length_m,
        )
        given = None if parameters is None else dict(parameters)
        return super().__new__(cls, _model(bundle, keywords), n, parameters=given)

    def __init__(self, *_: object, **__: object) -> None:
        pass
