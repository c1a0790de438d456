"""Damaged files of every kind for every reader: a part of the campaign of benchmarks/fuzz_campaign.py."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

CAMPAIGN = Path(__file__).parents[1] / "benchmarks" / "fuzz_campaign.py"


@pytest.mark.slow
def test_no_reader_falls_over_damaged_files(tmp_path: Path) -> None:
    """No traceback, crash or hang, and at most 2 GB."""
    command = [sys.executable, str(CAMPAIGN), "--ci", "--out", str(tmp_path)]
    one_thread = {**os.environ, "POLARS_MAX_THREADS": "1"}  # of tables of a few rows, others only wait
    done = subprocess.run(command, capture_output=True, text=True, check=False, env=one_thread)
    assert done.returncode == 0, done.stdout[-3000:] + done.stderr[-3000:]
    assert "runs in all, 0 failed now" in done.stdout
