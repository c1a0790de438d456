"""k nearest neighbours that all count alike, as the field's papers have them."""

from __future__ import annotations

from typing import Any

from vislam2tag.positioning.models.weighted_knn import NearestNeighbours
from vislam2tag.positioning.registry import register


def plain(**parameters: Any) -> NearestNeighbours:
    """Make the model in which all neighbours count alike."""
    return NearestNeighbours(**{"k": 3, "exponent": 0.0} | parameters)


register("knn", plain)
