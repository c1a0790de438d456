"""Tables of text whose cells change while separator, decimal mark and header stay."""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

_NUMBER = re.compile(r"-?\d+(?:[.,]\d+)?(?:[eE][+-]?\d+)?")


@dataclass
class Rows:
    """A table: cells without blanks, with decimal points."""

    path: Path
    separator: str
    decimal: str
    head: list[str]
    """Names of columns; empty if the file has none."""
    rows: list[list[str]]

    @classmethod
    def read(cls, path: Path) -> Rows:
        """Read a file whose fields are separated by semicolons or else by commas."""
        lines = path.read_text(encoding="utf-8", errors="surrogateescape").splitlines()
        separator = ";" if lines and ";" in lines[0] else ","
        cells = [[cell.strip() for cell in line.split(separator)] for line in lines if line]
        head = cells.pop(0) if cells and not _NUMBER.fullmatch(cells[0][0]) else []
        comma = separator == ";" and any("," in cell and _NUMBER.fullmatch(cell) for row in cells[:9] for cell in row)
        if comma:
            cells = [[cell.replace(",", ".") if _NUMBER.fullmatch(cell) else cell for cell in row] for row in cells]
        blank = f"{separator} " if lines and f"{separator} " in lines[-1] else separator
        return cls(path, blank, "," if comma else ".", head, cells)

    def write(self) -> None:
        """Write the table back to its file."""
        lines = [self.separator.join(self.head)] if self.head else []
        lines += [self.separator.join(map(self._cell, row)) for row in self.rows]
        text = "\n".join(lines) + "\n"
        self.path.write_text(text, encoding="utf-8", errors="surrogateescape")

    def _cell(self, cell: str) -> str:
        return cell.replace(".", ",") if self.decimal == "," and re.fullmatch(r"-?\d+\.\d+", cell) else cell

    def at(self, columns: Sequence[str | int]) -> list[int]:
        """Numbers of columns that are given by name or number."""
        return [column if isinstance(column, int) else self.head.index(column) for column in columns]

    def change(
        self,
        columns: Sequence[str | int],
        new: Callable[[list[str]], Sequence[str]],
        where: Callable[[list[str]], bool] = lambda _: True,
    ) -> None:
        """Replace the cells of these columns, row by row, and write the table."""
        at = self.at(columns)
        for row in self.rows:
            if where(row):
                for place, cell in zip(at, new([row[place] for place in at]), strict=True):
                    row[place] = cell
        self.write()
