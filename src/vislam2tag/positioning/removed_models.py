"""Models of version 0.2 that were removed, and what to use instead: one message for names, parameters and files."""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType
from typing import Any

REMOVED: Mapping[str, str] = MappingProxyType(
    {
        "knn": "use weighted-knn",
        "probabilistic": "use weighted-knn",
        "extra-trees": "use weighted-knn",
        "combined": "train without --model, which takes the best one",
        "cell-density-networks": "use cell-density",
    }
)
"""What to do instead, by name."""
REMOVED_PARAMETERS: frozenset[tuple[str, str]] = frozenset({("cell-density", "networks")})
"""By model and parameter; an empty value in a file means the model as it is now."""


def removed_model(name: str) -> str | None:
    """Return the message for a removed model, without a full stop at the end; None for any other name."""
    return f"the model {name} was removed; {REMOVED[name]}" if name in REMOVED else None


def removed_parameter(model: str, parameter: str) -> str | None:
    """Return the message for a removed parameter; None for any other."""
    if (model, parameter) not in REMOVED_PARAMETERS:
        return None
    return f"the parameter {parameter} of {model} was removed; use {model} without it"


def without_idle(model: str, parameters: Mapping[str, Any]) -> dict[str, Any]:
    """Return the parameters that a file states, except removed ones that have no effect."""
    return {name: value for name, value in parameters.items() if value or (model, name) not in REMOVED_PARAMETERS}
