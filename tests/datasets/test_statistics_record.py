from __future__ import annotations

import csv
import io

from vislam2tag.datasets.statistics_record import (
    ALL,
    PAPER,
    Table3,
    WalkTotals,
    table_3_csv,
    table_3_latex,
    table_3_markdown,
)

LG = WalkTotals(trajectories=18, duration_s=4653.6, distance_m=3701.375, velocity_m_s=0.7954)
POINTS = WalkTotals(trajectories=2)
ROWS = {"LG": LG, "My_phone": POINTS}


def test_minutes_metres_and_a_dash_for_what_is_not_known() -> None:
    texts = dict(Table3.of(ROWS, LG).texts())
    assert texts["LG"] == ("18", "77.56", "3701.38", "0.80")
    assert texts["My_phone"] == ("2", "-", "-", "-")
    assert list(texts) == ["LG", "My_phone", "all"]


def test_the_papers_numbers_stand_beside_for_the_papers_phones() -> None:
    table = Table3.of(ROWS, LG, beside_paper=True)
    texts = dict(table.texts())
    assert texts["LG"] == ("18", "18", "77.56", "77.56", "3701.38", "3701.38", "0.80", "0.92")
    assert texts["My_phone"][1::2] == ("-",) * 4
    assert texts["all"][1::2] == ("81", "252.00", "11237.02", "-")
    assert table.heads[:2] == ("trajectories", "paper")


def test_csv_has_numbers_and_empty_cells() -> None:
    lines = list(csv.DictReader(io.StringIO(table_3_csv(Table3.of(ROWS, LG, beside_paper=True)))))
    assert (lines[0]["duration_min"], lines[0]["paper_velocity_m_s"]) == ("77.56", "0.92")
    assert lines[2]["paper_distance_m"] == "11237.02"
    assert (lines[1]["distance_m"], lines[1]["paper_trajectories"]) == ("", "")
    assert "paper" not in table_3_csv(Table3.of(ROWS, LG))


def test_latex_escapes_and_rules_off_the_total() -> None:
    text = table_3_latex(Table3.of(ROWS, LG))
    assert "My\\_phone & 2 & - & - & - \\\\\n\\midrule\nall & 18" in text
    assert text.count("&") == 4 * 4


def test_markdown_has_a_column_for_each_head() -> None:
    head, rule, *rows = table_3_markdown(Table3.of(ROWS, LG)).splitlines()[2:]
    assert {line.count("|") for line in (head, rule, *rows)} == {6}


def test_the_papers_totals_are_sums_of_its_rows() -> None:
    devices = [numbers for device, numbers in PAPER.items() if device != ALL]
    sums = [round(sum(number or 0 for number in column), 2) for column in zip(*devices, strict=True)]
    assert sums[:3] == list(PAPER[ALL])[:3]
