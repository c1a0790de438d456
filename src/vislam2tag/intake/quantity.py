"""One quantity that enters: its name, unit and range, and what to report about values outside the range."""

from __future__ import annotations

from dataclasses import dataclass

import polars as pl

from vislam2tag.common.finding_kinds import FindingKind
from vislam2tag.common.findings import Finding, Severity


@dataclass(frozen=True)
class Quantity:
    """A quantity with the range in which a value can be true; both bounds are included."""

    name: str
    """In the plural, as a message names it: ``signal strengths``."""
    unit: str
    least: float
    greatest: float
    kind: FindingKind
    cause: str
    """What values outside the range usually come from, a clause: ``the sign was lost, or ...``."""
    cure: str
    """What to do, a clause: ``correct the file``."""
    severity: Severity = Severity.WARNING

    def contains(self, values: pl.Expr) -> pl.Expr:
        """Whether values are finite and in the range; null stays null."""
        return values.is_finite() & values.is_between(self.least, self.greatest)

    @property
    def range_text(self) -> str:
        """The range in words: ``from -126 to -1 dBm``."""
        return f"from {self.least:g} to {self.greatest:g} {self.unit}"

    def outside(self, file: str, lines: list[int], done: str) -> list[Finding]:
        """Report the 1-based lines whose values are outside the range; ``done`` says what happens to them."""
        if not lines:
            return []
        message = f"{self.name} must be {self.range_text}; {done}. Possible cause: {self.cause}. {self.cure}"
        return [Finding.at_lines(self.kind, file, lines, message, self.severity)]
