"""``cell-density`` with networks averaged in."""

from __future__ import annotations

from typing import Any

from vislam2tag.positioning.models.cell_density import CellDensity
from vislam2tag.positioning.registry import register


def with_networks(**parameters: Any) -> CellDensity:
    """Make the model with two networks, which see levels differently."""
    return CellDensity(**{"networks": (1.7, 1.0)} | parameters)


register("cell-density-networks", with_networks)
