"""A command's own messages come first; what Polars prints of damage that ours tell of does not come at all."""

from __future__ import annotations

import contextlib
import subprocess
import sys
from pathlib import Path

import polars as pl
import pytest

from tests.cli.command import the_error, vislam2tag_process
from vislam2tag.common.files.table_files import read_parquet

_PROGRAM = """
import os, sys
from vislam2tag.cli.native_output import native_output_last
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
    told = vislam2tag_process("label", table, "--labels", tmp_path)
    assert the_error(told) == f"error: {table}: cannot be read as CSV or Parquet (it is damaged)"


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
