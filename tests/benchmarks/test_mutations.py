"""Some kinds of the campaign of benchmarks/mutations.py on a small survey, and how the campaign judges."""

from __future__ import annotations

from pathlib import Path

import polars as pl
import pytest
from mutation_inputs import run
from mutation_kinds import KINDS
from mutation_results import Table
from mutation_tables import Rows

from mutations import NAMED, Answer, answer, changed_by, items, judged
from tests.docs.figures import RESULTS

SEED = 3


@pytest.fixture(scope="module")
def base(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("input")
    command = f"simulate {{out}} --floors 1 --devices 1 --sessions 1 --minutes 0.5 --severity none --seed {SEED}"
    code, text = run(command, out=folder / "survey")
    assert code == 0, text
    return folder


@pytest.fixture(scope="module")
def clean(base: Path, tmp_path_factory: pytest.TempPathFactory) -> Answer:
    return answer(base, "survey", tmp_path_factory.mktemp("clean") / "run")


@pytest.mark.parametrize(
    ("kind", "outcome"),
    [
        ("landmarks: id twice", "reported"),
        ("landmarks: pixels", "reported"),
        ("landmarks: semicolons", "harmless"),
        ("landmarks: shifted", "missed"),
        ("poses: mm", "reported"),
        ("poses: times in ms", "reported"),
        ("poses: turned frame", "harmless"),
        ("Wi-Fi: positive", "reported"),
        ("Wi-Fi: masked addresses", "reported"),
        ("Wi-Fi: dashes", "harmless"),
        ("corrections: unknown landmark", "reported"),
    ],
)
def test_changes_of_meaning_are_reported_or_harmless(
    kind: str, outcome: str, base: Path, clean: Answer, tmp_path: Path
) -> None:
    changed = answer(base, "survey", tmp_path / "run", lambda folder: changed_by(NAMED[kind], SEED, folder))
    found, said, differences = judged(NAMED[kind], clean, changed)
    assert found == outcome, (said, differences)


def test_kinds_have_names_of_their_own_and_reasons() -> None:
    assert len(NAMED) == len(KINDS)
    assert sum(not kind.undetectable for kind in KINDS) >= 40
    assert not [kind.name for kind in KINDS if kind.undetectable and kind.expected]


def test_findings_of_an_output_are_counted_and_statements_are_not() -> None:
    found = items("findings: lost_sign 5, time_unit 2\nreport: /x\nwarning: a  sentence\n")
    assert found == {"lost_sign": 5, "time_unit": 2, "warning: a sentence": 1}


def test_tables_keep_their_form(tmp_path: Path) -> None:
    file = tmp_path / "poses.csv"
    file.write_text("12; 1,500000; -2,000000\n13; 1,600000; x\n")
    rows = Rows.read(file)
    rows.change((1,), lambda cells: [f"{2 * float(cells[0]):.6f}"])
    assert file.read_text() == "12; 3,000000; -2,000000\n13; 3,200000; x\n"


def test_results_differ_by_rows_positions_and_values(tmp_path: Path) -> None:
    table = Table("t.csv", ("id",), ("x", "y"), ("level",))
    old = pl.DataFrame({"id": ["a", "b"], "x": [0.0, 1.0], "y": [0.0, 1.0], "level": [-60.0, -70.0]})
    old.write_csv(tmp_path / "t.csv")
    assert table.read(tmp_path) is not None
    assert table.difference(old, old.sample(fraction=1.0, shuffle=True, seed=2)) == ""
    assert table.difference(old, old.with_columns(pl.col("x") + 0.04)) == ""
    assert table.difference(old, old.with_columns(pl.col("x") + 0.2)) == "t.csv: positions moved by 0.20 m on average"
    assert table.difference(old, old.with_columns(level=-60)) == "t.csv: 50% of level are the same"
    assert table.difference(old, old.head(1)) == "t.csv: 2 rows, 1 changed, 1 in common"
    assert table.difference(old, None) == "t.csv: no table"


def test_the_page_lists_all_kinds() -> None:
    rows = (RESULTS / "input-mutations.md").read_text(encoding="utf-8").splitlines()
    assert [kind.name for kind in KINDS] == [
        row.split(" | ")[0].removeprefix("| ") for row in rows if "/ missed" in row and ": kinds" in row
    ]
