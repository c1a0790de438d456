"""Names from files reach the terminal as text; one module prints for all commands.

Tables on a narrow terminal: no number is cut, and each part says which row it is of.

A command's own messages come first; what Polars prints of damage that ours tell of does not come at all.
"""

from __future__ import annotations

import contextlib
import io
import re
import subprocess
import sys
from pathlib import Path

import polars as pl
import pytest
from rich.table import Table

from tests.cli.command import the_error, vislam2tag, vislam2tag_process
from tests.surveys import make_survey
from vislam2tag import cli
from vislam2tag.cli.tables import table, tables_that_fit
from vislam2tag.cli.terminal import visible_console
from vislam2tag.common.files.table_files import read_parquet

EVIL = "LG\x1b]0;owned\x07\x1b[2J\u202e"


@pytest.fixture(scope="module")
def survey(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A survey whose device is called by escape sequences; one of its sessions cannot be read."""
    root = make_survey(tmp_path_factory.mktemp("evil") / "survey", devices=("LG",), sessions=2, seconds=5.0)
    floor = root / "floor_0"
    (floor / "LG").rename(floor / EVIL)
    (broken, *_) = (floor / EVIL).iterdir()
    for file in broken.iterdir():
        file.write_bytes(b"\x1b[31m\n" * 9)
    return root


@pytest.mark.parametrize("command", ["inspect", "process", "check", "evaluate", "survey-landmarks"])
def test_escape_sequences_in_names_are_not_obeyed(survey: Path, tmp_path: Path, command: str) -> None:
    out = () if command == "inspect" else ("--out", tmp_path / "x.csv", "--jobs", "1")
    done = vislam2tag(command, survey, *out)
    said = done.stdout + done.stderr
    assert r"\u001b]0;owned" in said
    log = tmp_path / "x.csv" / "log.txt"
    said += log.read_text() if log.exists() else ""
    assert not re.search("[\x00-\x08\x0b-\x1f\x7f-\x9f\u202e]", said)


def test_styles_are_still_obeyed(monkeypatch: pytest.MonkeyPatch) -> None:
    stream = io.StringIO()
    monkeypatch.setenv("TERM", "xterm")
    console = visible_console(file=stream, force_terminal=True)
    console.print(f"[red]{EVIL}[/]")
    shown = stream.getvalue()
    assert "\x1b[31m" in shown
    assert EVIL not in shown


def test_no_other_module_prints() -> None:
    """``Console`` for annotations is imported below ``TYPE_CHECKING`` alone, four spaces in at the top of a module."""
    for module in sorted(Path(cli.__file__).parent.glob("*.py")):
        text = module.read_text()
        if module.name != "terminal.py":
            assert "typer.echo" not in text, module.name
            assert not re.search(r"\bConsole\(", text), module.name
            assert not re.search(r"(?<![\w.])print\((?!settings_page)", text), module.name


def shown_table(made: Table, width: int) -> str:
    out = io.StringIO()
    console = visible_console(file=out, width=width)
    for part in tables_that_fit(made, console):
        console.print(part)
    return out.getvalue()


@pytest.mark.parametrize("width", [60, 80, 200])
def test_no_number_is_cut(width: int) -> None:
    heads = tuple(f"error at {percent} %" for percent in range(10, 100, 10))
    numbers = {name: [f"{ord(name[0])}.{i}456789" for i in range(9)] for name in ("all", "best")}
    rows = [(name, "local-corrected", *cells) for name, cells in numbers.items()]
    shown = shown_table(table("Errors", ("trajectories", "strategy"), heads, rows), width)
    assert max(map(len, shown.splitlines())) <= width
    assert all(cell in shown for cells in numbers.values() for cell in cells)
    assert "…" not in shown
    parts = shown.count("strategy")
    assert shown.count("Errors") == parts
    assert parts == 1 if width == 200 else parts > 1


@pytest.mark.parametrize("width", [40, 60, 80])
def test_neither_heads_nor_cells_of_numbers_are_cut_or_broken(width: int) -> None:
    heads = ("elevation", "along x", "landmarks", "control points")
    row = ("0", "a drawing of the ground floor by hand.svg", "-", "0.00 to 41.00 m", "12", "1234")
    shown = shown_table(table("Floors", ("floor", "plan"), heads, [row]), width)
    assert max(map(len, shown.splitlines())) <= width
    assert "…" not in shown
    assert {"elevation", "0.00 to 41.00 m", "landmarks", "1234"} <= set(re.split(r"\s{2,}|\n", shown))


_PROGRAM = """
import os, sys
from vislam2tag.cli.terminal import native_output_last
with native_output_last():
    os.write(2, {!r})
    print("ours", file=sys.stderr)
    {}
print("after", file=sys.stderr)
"""


def said(by_library: bytes, then: str = "pass") -> str:
    program = _PROGRAM.format(by_library, then)
    return subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=False).stderr


def test_what_libraries_say_comes_last_and_their_panics_not_at_all() -> None:
    assert said(b"[ WARN ] of a library\n") == "ours\n[ WARN ] of a library\nafter\n"
    assert said(b"\nthread 'x' (1) panicked at a.rs:1:2:\nassertion failed\n") == "ours\nafter\n"


def test_a_crash_is_still_told() -> None:
    assert "Aborted" in said(b"", "os.abort()")


def test_a_table_that_polars_panics_over_is_one_message(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    table = tmp_path / "scans.parquet"
    pl.DataFrame({"time_ns": [1, None, 3] * 100, "x": [0.5, None, 1.5] * 100}).write_parquet(table, statistics=False)
    if not _damaged_until_polars_panics(table, capfd):
        pytest.skip("this version of Polars panics over no byte of it")
    ended = vislam2tag_process("label", table, "--labels", tmp_path)
    assert the_error(ended) == (
        f"error: {table}: cannot be read as CSV, Parquet or XLSX (it is damaged); save the table as CSV and pass that"
    )


def _damaged_until_polars_panics(table: Path, capfd: pytest.CaptureFixture[str]) -> bool:
    """Change one byte after the other until Polars' reader panics over what its own checks and ours let pass."""
    data = table.read_bytes()
    for at in range(4, 200):
        table.write_bytes(data[:at] + b"\xff" + data[at + 1 :])
        with contextlib.suppress(OSError, pl.exceptions.PolarsError):
            read_parquet(table)
        if "panicked at" in capfd.readouterr().err:
            return True
    return False
