"""The paper's Table III: the walks of each device, as CSV, Markdown and LaTeX."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from vislam2tag.common.text_tables import csv_rows, latex_escaped, latex_table, markdown_table
from vislam2tag.dataset.statistics.record import WalkTotals

TITLE = "Table III: walks by device"
HEADS = ("trajectories", "duration / min", "walked distance / m", "average velocity / m/s")
ALL = "all"
"""Name of the row of totals."""
PAPER: Mapping[str, Sequence[float | None]] = {
    "Galaxy": (24, 54.77, 2559.39, 0.99),
    "LG": (18, 77.56, 3701.38, 0.92),
    "OnePlus": (24, 51.49, 2351.40, 0.94),
    "S20": (15, 68.18, 2624.85, 0.98),
    ALL: (81, 252.00, 11237.02, None),
}
"""The paper's numbers for giaIndoorLoc; the totals are sums of its rows. Its velocities exceed its own distance over
duration (0.64 to 0.80 m/s): how they were made is not said. Ours are distance over duration."""
PAPER_FINGERPRINTS = 2049
"""Labelled fingerprints of giaIndoorLoc, by two people in under two hours (paper, section VII)."""
_NONE = "-"
_COLUMNS = ("trajectories", "duration_min", "distance_m", "velocity_m_s")


@dataclass(frozen=True)
class Table3:
    """Rows by device, the total last; with the paper's numbers beside them or without."""

    rows: tuple[tuple[str, tuple[float | None, ...]], ...]
    beside_paper: bool

    @classmethod
    def of(cls, by_device: Mapping[str, WalkTotals], total: WalkTotals, *, beside_paper: bool = False) -> Table3:
        """Make the table of statistics; devices that only the paper has are left out."""
        rows = [*by_device.items(), (ALL, total)]
        return cls(tuple((device, _numbers(walks)) for device, walks in rows), beside_paper)

    @property
    def heads(self) -> tuple[str, ...]:
        """Heads of the columns after the device."""
        return tuple(head for own in HEADS for head in ((own, "paper") if self.beside_paper else (own,)))

    def texts(self) -> list[tuple[str, tuple[str, ...]]]:
        """Each device with its numbers as text, a dash where there is none."""
        return [(device, tuple(self._beside(device, numbers))) for device, numbers in self.rows]

    def _beside(self, device: str, numbers: Sequence[float | None]) -> list[str]:
        own = _shown(numbers)
        if not self.beside_paper:
            return own
        paper = _shown(PAPER.get(device, (None,) * len(HEADS)))
        return [text for pair in zip(own, paper, strict=True) for text in pair]


def csv_text(table: Table3) -> str:
    """One line for each device; empty where there is no number."""
    paper = [f"paper_{name}" for name in _COLUMNS] if table.beside_paper else []
    rows = [("device", *_COLUMNS, *paper)]
    for device, numbers in table.rows:
        beside = PAPER.get(device, (None,) * len(_COLUMNS)) if table.beside_paper else ()
        rows.append((device, *("" if number is None else f"{number:.10g}" for number in (*numbers, *beside))))
    return csv_rows(rows)


def markdown_text(table: Table3) -> str:
    """A table for reading."""
    rows = ((device, *texts) for device, texts in table.texts())
    return markdown_table(TITLE, ("device", *table.heads), rows, texts=1)


def latex_text(table: Table3) -> str:
    """A ``tabular`` (package booktabs)."""
    rows = [(latex_escaped(device), *texts) for device, texts in table.texts()]
    return latex_table(TITLE, (("Device", *table.heads),), (rows[:-1], rows[-1:]), texts=1)


def _numbers(walks: WalkTotals) -> tuple[float | None, ...]:
    minutes = None if walks.duration_s is None else round(walks.duration_s / 60, 2)
    return walks.trajectories, minutes, walks.distance_m, walks.velocity_m_s


def _shown(numbers: Sequence[float | None]) -> list[str]:
    """Trajectories as a whole number, all else with two decimals."""
    return [
        _NONE if number is None else f"{number:.0f}" if column == 0 else f"{number:.2f}"
        for column, number in enumerate(numbers)
    ]
