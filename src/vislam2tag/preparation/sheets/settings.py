"""How sheets are made."""

from __future__ import annotations

from pydantic import Field

from vislam2tag.common.records import FiniteRecord


class SheetSettings(FiniteRecord):
    """Paper and image of landmarks that are printed (docs/how-to/sheets.md)."""

    paper: str = "A4"
    """Size of the paper of landmarks whose file names no sheet: A4, Letter, A3, A2, A1 or A0."""
    width_m: float | None = Field(default=None, ge=0.01)
    """Width of images whose file names none, metres; as wide as the paper holds where not given."""
    seed: int = 0
    """Another seed, another set of images."""
