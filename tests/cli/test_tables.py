"""Tables on a narrow terminal: no number is cut, and each part says which row it is of."""

from __future__ import annotations

import io
import re

import pytest

from vislam2tag.cli.tables import table
from vislam2tag.cli.terminal import visible_console


@pytest.mark.parametrize("width", [60, 80, 200])
def test_no_number_is_cut(width: int) -> None:
    heads = tuple(f"error at {percent} %" for percent in range(10, 100, 10))
    made = table("Errors", ("trajectories", "strategy"), heads)
    numbers = {name: [f"{ord(name[0])}.{i}456789" for i in range(9)] for name in ("all", "best")}
    for name, cells in numbers.items():
        made.add_row(name, "local-corrected", *cells)
    out = io.StringIO()
    visible_console(file=out, width=width).print(made)
    shown = out.getvalue()
    assert max(map(len, shown.splitlines())) <= width
    assert all(cell in shown for cells in numbers.values() for cell in cells)
    assert "…" not in shown
    parts = shown.count("strategy")
    assert shown.count("Errors") == parts
    assert parts == 1 if width == 200 else parts > 1


@pytest.mark.parametrize("width", [40, 60, 80])
def test_neither_heads_nor_cells_of_numbers_are_cut_or_broken(width: int) -> None:
    made = table("Floors", ("floor", "plan"), ("elevation", "along x", "landmarks", "control points"))
    made.add_row("0", "a drawing of the ground floor by hand.svg", "-", "0.00 to 41.00 m", "12", "1234")
    out = io.StringIO()
    visible_console(file=out, width=width).print(made)
    shown = out.getvalue()
    assert max(map(len, shown.splitlines())) <= width
    assert "…" not in shown
    assert {"elevation", "0.00 to 41.00 m", "landmarks", "1234"} <= set(re.split(r"\s{2,}|\n", shown))
