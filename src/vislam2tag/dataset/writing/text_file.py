"""A CSV file that grows table by table, so that only one piece is in memory."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import BinaryIO

import polars as pl


@dataclass
class CsvFile:
    """Appends tables of the same columns; the first brings the header."""

    file: BinaryIO
    separator: str
    null: str
    _started: bool = field(default=False)

    def add(self, table: pl.DataFrame) -> None:
        """Append the rows of a table; one without rows still brings the header."""
        table.write_csv(self.file, include_header=not self._started, separator=self.separator, null_value=self.null)
        self._started = True


@contextmanager
def csv_file(path: Path, separator: str = ",", null: str = "") -> Iterator[CsvFile]:
    """Open a new CSV file; ``null`` is written for what is not known."""
    with path.open("wb") as file:
        yield CsvFile(file, separator, null)
