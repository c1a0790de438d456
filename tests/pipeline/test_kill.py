"""Killed at any moment, a run is finished by the next one to the same bytes as if nothing had happened."""

from __future__ import annotations

import random
import signal
import subprocess
import sys
import time
from pathlib import Path

import psutil
import pytest

from tests.surveys import bytes_of, make_survey

KILLS = 20
GRACE_S = 5.0
"""Workers must be gone this long after the main process was killed."""


@pytest.fixture(scope="module")
def survey(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return make_survey(
        tmp_path_factory.mktemp("kill") / "survey", floors=2, sessions=2, seconds=20.0, severity="default"
    )


def command(survey: Path, out: Path) -> list[str]:
    return [sys.executable, "-m", "vislam2tag", "process", str(survey), "--out", str(out), "--jobs", "2"]


def run(survey: Path, out: Path) -> int:
    done = subprocess.run(command(survey, out), capture_output=True, timeout=120, check=False)
    assert b"Traceback" not in done.stderr
    return done.returncode


def run_and_kill(survey: Path, out: Path, after_s: float) -> None:
    with subprocess.Popen(command(survey, out), stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL) as process:
        time.sleep(after_s)
        children = psutil.Process(process.pid).children(recursive=True) if process.poll() is None else []
        process.send_signal(signal.SIGKILL)
    _, alive = psutil.wait_procs(children, timeout=GRACE_S)
    assert not alive, "worker processes outlived the main process"


def test_sigkill_at_random_moments(survey: Path, tmp_path: Path) -> None:
    start = time.monotonic()
    code = run(survey, tmp_path / "whole")
    length_s = time.monotonic() - start
    whole = bytes_of(tmp_path / "whole")
    moments = random.Random(5)
    unfinished = 0
    for kill in range(KILLS):
        out = tmp_path / f"killed{kill}"
        run_and_kill(survey, out, moments.uniform(0.3, 1.0) * length_s)
        unfinished += not (out / "report.html").exists()
        assert run(survey, out) == code
        assert bytes_of(out) == whole
    assert unfinished > KILLS / 4, "most kills came too late to test anything"
