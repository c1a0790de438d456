"""The paper's Table IV: floors and errors with a random 30 % held out, then with each device held out."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import groupby

from vislam2tag.common.text_tables import csv_rows, latex_escaped, latex_table, markdown_table
from vislam2tag.positioning.benchmark.record import BenchmarkRow
from vislam2tag.positioning.benchmark.rows import ALL

TITLE = "Table IV: positioning by test data"
RANDOM, DEVICE = "random", "device"
SPLITS = (RANDOM, DEVICE)
MODELS = ("multi-cel", "regression-net")
"""The paper's two, by our names; their parameters are the paper's where none is chosen."""
HEADS = ("floor hit", "mean / m", "median / m")
_COLUMNS = ("floor_hit", "mean_m", "median_m")
_RANDOM_NAME = "random 30 %"
PAPER: Mapping[tuple[str, str], tuple[float, float, float]] = {
    (_RANDOM_NAME, "multi-cel"): (0.992, 2.08, 1.52),
    (_RANDOM_NAME, "regression-net"): (0.988, 2.59, 2.12),
    ("Galaxy", "multi-cel"): (0.987, 2.68, 2.02),
    ("Galaxy", "regression-net"): (0.979, 3.36, 2.53),
    ("LG", "multi-cel"): (0.992, 2.59, 1.71),
    ("LG", "regression-net"): (0.967, 2.93, 1.94),
    ("OnePlus", "multi-cel"): (0.968, 3.06, 1.76),
    ("OnePlus", "regression-net"): (0.981, 3.80, 2.82),
    ("S20", "multi-cel"): (0.999, 2.05, 1.74),
    ("S20", "regression-net"): (0.993, 2.84, 2.37),
}
"""Share on the right floor, mean and median error in the plane (metres) of giaIndoorLoc, by test data and model."""


@dataclass(frozen=True)
class Table4Row:
    """One model on one part; each figure is ours (the mean over seeds), then the paper's."""

    test: str
    model: str
    here: tuple[float | None, ...]
    paper: tuple[float | None, ...]

    def cells(self) -> tuple[str, ...]:
        """Figures as text in the order of :data:`HEADS`, each followed by the paper's; a dash where there is none."""
        pairs = zip(self.here, self.paper, strict=True)
        return tuple(_shown(value, column) for column, pair in enumerate(pairs) for value in pair)


@dataclass(frozen=True)
class Table4:
    """Rows by test data, then model."""

    rows: tuple[Table4Row, ...]

    @property
    def heads(self) -> tuple[str, ...]:
        """Heads of the columns after test data and model."""
        return tuple(head for own in HEADS for head in (own, "paper"))

    def texts(self) -> dict[str, str]:
        """The table as ``csv``, ``tex`` (package booktabs) and ``md``."""
        return {"csv": self._csv(), "tex": self._latex(), "md": self._markdown()}

    def _csv(self) -> str:
        rows = [("test", "model", *_COLUMNS, *(f"paper_{name}" for name in _COLUMNS))]
        for row in self.rows:
            numbers = ("" if value is None else f"{value:.10g}" for value in (*row.here, *row.paper))
            rows.append((row.test, row.model, *numbers))
        return csv_rows(rows)

    def _markdown(self) -> str:
        rows = ((row.test, row.model, *row.cells()) for row in self.rows)
        return markdown_table(TITLE, ("test data", "model", *self.heads), rows, texts=2)

    def _latex(self) -> str:
        groups = (
            [(latex_escaped(row.test), latex_escaped(row.model), *row.cells()) for row in group]
            for _, group in groupby(self.rows, key=lambda row: row.test)
        )
        return latex_table(TITLE, (("Test data", "Model", *self.heads),), groups, texts=2)


def table_4(rows: Sequence[BenchmarkRow]) -> Table4:
    """Pick the rows of the paper's splits; models and devices that it has not stand without its numbers."""
    chosen = [row for row in rows if row.split in SPLITS and row.fold != ALL]
    return Table4(tuple(_row(row) for row in sorted(chosen, key=lambda row: SPLITS.index(row.split))))


def _row(row: BenchmarkRow) -> Table4Row:
    test = _RANDOM_NAME if row.split == RANDOM else row.fold
    here = tuple(row.figures[name].value for name in _COLUMNS)
    return Table4Row(test, row.model, here, PAPER.get((test, row.model), (None,) * len(_COLUMNS)))


def _shown(value: float | None, column: int) -> str:
    if value is None:
        return "-"
    return f"{value:.3f}" if column == 0 else f"{value:.2f}"
