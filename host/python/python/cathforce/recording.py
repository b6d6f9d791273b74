"""Recordings as tables."""

from __future__ import annotations

import os
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

from ._cathforce import read_recording

if TYPE_CHECKING:
    import pandas
    import pyarrow

Columns = Mapping[str, Any]

#: Tables of a recording.
TABLES = ("ticks", "nodes", "measured", "frames")


@dataclass(frozen=True)
class Recording:
    """A recording, read whole. Columns are numpy arrays; their names say the units.

    ``ticks``: one row a tick, as ``cathforce export`` has them, with the moment, the device's ``digest`` (NaN in
    ticks whose frames do not carry it) and the ``command`` that the tick took. What is not known is NaN, of whole
    numbers and flags −1.
    ``nodes``: one row a node and shape, 25 shapes a second.
    ``measured``: the trial that was played; a channel that was never measured has no column.
    ``frames``: every frame in the order in which it crossed the bus.
    """

    info: Mapping[str, Any]
    ticks: Columns = field(repr=False)
    nodes: Columns = field(repr=False)
    measured: Columns = field(repr=False)
    frames: Columns = field(repr=False)

    def _table(self, name: str) -> Columns:
        if name not in TABLES:
            from .errors import UsageError

            raise UsageError(f"there is no table `{name}`\n  fix: one of {', '.join(TABLES)}")
        table: Columns = getattr(self, name)
        return table

    def pandas(self, table: str = "ticks") -> pandas.DataFrame:
        """A table as a data frame of pandas."""
        import pandas

        return pandas.DataFrame(dict(self._table(table)))

    def arrow(self, table: str = "ticks") -> pyarrow.Table:
        """A table of Arrow, over the same memory where Arrow allows it."""
        import pyarrow

        return pyarrow.table(dict(self._table(table)))


def read(recording: str | os.PathLike[str]) -> Recording:
    """Reads a recording (MCAP) that ``cathforce run``, ``play`` or ``simulate`` wrote.

    Quantities that the bus carries in turns come from a replay through the same tick, bit by bit.
    """
    return Recording(**read_recording(recording))
