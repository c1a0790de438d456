"""Killed at any moment, a run is finished by the next one to the same bytes as if nothing had happened."""

from __future__ import annotations

import random
import signal
import subprocess
import sys
import time
from pathlib import Path
from typing import NamedTuple

import psutil
import pytest

from tests.surveys import bytes_of, make_survey

KILLS = 20
PARTS = 4
"""Parts that may run side by side."""
GRACE_S = 5.0
"""Workers must be gone this long after the main process was killed."""


class Whole(NamedTuple):
    """An undisturbed run: exit code, seconds it took, files it wrote."""

    code: int
    length_s: float
    files: dict[str, str]


@pytest.fixture(scope="module")
def survey(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return make_survey(tmp_path_factory.mktemp("kill") / "survey", floors=2, seconds=20.0, severity="default")


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


@pytest.fixture(scope="module")
def whole(survey: Path, tmp_path_factory: pytest.TempPathFactory) -> Whole:
    """What an undisturbed run makes of the survey."""
    out = tmp_path_factory.mktemp("whole") / "out"
    start = time.monotonic()
    code = run(survey, out)
    return Whole(code, time.monotonic() - start, bytes_of(out))


@pytest.mark.parametrize("part", range(PARTS))
def test_sigkill_at_random_moments(survey: Path, whole: Whole, tmp_path: Path, part: int) -> None:
    moments = random.Random(part)
    unfinished = 0
    for kill in range(KILLS // PARTS):
        out = tmp_path / f"killed{kill}"
        run_and_kill(survey, out, moments.uniform(0.3, 1.0) * whole.length_s)
        unfinished += not (out / "report.html").exists()
        assert run(survey, out) == whole.code
        assert bytes_of(out) == whole.files
    assert unfinished > 0, "all kills came too late to test anything"
