"""Which values a network's parameters may have; checked when it is fitted, as scikit-learn's models do."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

from vislam2tag.errors import UsageError
from vislam2tag.positioning.networks.layers import InputScale

_RANGES = {
    "epochs": (1, math.inf),
    "batch_size": (1, math.inf),
    "learning_rate": (1e-9, 1.0),
    "weight_decay": (0.0, 1.0),
    "patience": (1, math.inf),
    "validation_share": (0.0, 0.9),
    "seed": (0, 2**32 - 1),
    "dropout": (0.0, 0.95),
    "head_dropout": (0.0, 0.95),
    "cell_m": (0.1, 1e4),
    "overlap": (0.0, 2.0),
    "class_weight": (0.0, math.inf),
    "code_weight": (0.0, math.inf),
}
_WIDTHS = ("backbone", "heads", "head")


def refuse_impossible(parameters: Mapping[str, Any]) -> None:
    """Raise UsageError for the first value that cannot be, of the kind its parameter has.

    Names that are not known here may have any value.
    """
    for name, (least, most) in _RANGES.items():
        value = parameters.get(name, least)
        if not least <= value <= most:
            raise UsageError(f"{name} {value!r}: expected {_between(least, most)}")
    for name in _WIDTHS:
        widths = parameters.get(name, ())
        if not all(isinstance(width, int) and width >= 1 for width in widths):
            raise UsageError(f"{name} {widths!r}: expected the widths of layers, like [512, 256], or [] for none")
    scale = parameters.get("input_scale", InputScale.MIN_MAX)
    if scale not in list(InputScale):
        raise UsageError(f"input_scale {scale!r}: expected one of {', '.join(InputScale)}")


def _between(least: float, most: float) -> str:
    return f"{least:g} or more" if math.isinf(most) else f"{least:g} to {most:g}"
