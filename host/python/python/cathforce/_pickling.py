"""How a model is made again in another process."""

from __future__ import annotations

from typing import Any

from ._cathforce import Model


def model(bundle: str, keywords: dict[str, Any]) -> Model:
    return Model(bundle, **keywords)
