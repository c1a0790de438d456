"""Runs cut short, by Ctrl-C or a full disk: one line, no half file, and the next run goes on to the same bytes."""

from __future__ import annotations

import os
import resource
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path

import psutil
import pytest

from tests.cli.command import the_error, vislam2tag, vislam2tag_process
from tests.surveys import bytes_of, make_survey

COPIES = 9
GRACE_S = 5.0
"""Workers must be gone this long after the main process has ended."""


@pytest.fixture(scope="module")
def survey(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Two sessions and copies of them: enough to interrupt a run in their middle; all can be mapped."""
    root = make_survey(tmp_path_factory.mktemp("cut") / "survey", seconds=60.0)
    for session in list(root.glob("floor_0/*/*")):
        for number in range(COPIES):
            shutil.copytree(session, session.with_name(f"copy{number}"))
    return root


@pytest.fixture(scope="module")
def whole(survey: Path, tmp_path_factory: pytest.TempPathFactory) -> dict[str, str]:
    """What an undisturbed run writes."""
    out = tmp_path_factory.mktemp("whole") / "out"
    assert vislam2tag("process", survey, "--out", out, "--jobs", "1").returncode == 0
    return bytes_of(out)


def wait_for_sessions(out: Path, running: subprocess.Popen[str], number: int) -> None:
    """Wait until so many sessions are done; for 0 until the run has begun and its workers are starting."""
    while not (out / "run.json").exists() or len(list(out.glob("sessions/*.json"))) < number:
        assert running.poll() is None, running.communicate()
        time.sleep(0.005)


def interrupt(survey: Path, out: Path, jobs: int, sessions: int) -> tuple[int, str]:
    """Start a run, press Ctrl-C after some sessions (the terminal tells all its processes); exit code and message."""
    command = [sys.executable, "-m", "vislam2tag", "process", str(survey), "--out", str(out), "--jobs", str(jobs)]
    running = subprocess.Popen(
        command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, start_new_session=True
    )
    wait_for_sessions(out, running, sessions)
    children = psutil.Process(running.pid).children(recursive=True)
    os.killpg(running.pid, signal.SIGINT)
    stdout, stderr = running.communicate(timeout=30)
    assert stdout == ""
    _, alive = psutil.wait_procs(children, timeout=GRACE_S)
    assert not alive, "worker processes outlived the main process"
    return running.returncode, stderr


@pytest.mark.parametrize(("jobs", "sessions"), [(1, 2), (2, 0), (2, 2)])
def test_an_interrupt_is_130_with_one_line_and_the_next_run_goes_on(
    survey: Path, whole: dict[str, str], tmp_path: Path, jobs: int, sessions: int
) -> None:
    out = tmp_path / "out"
    code, message = interrupt(survey, out, jobs, sessions)
    assert code == 130
    assert message.count("\n") == 1
    assert message.startswith("interrupted: ")
    assert message.endswith(f" sessions are done and kept in {out}; run the same command again to go on\n")
    assert not (out / ".partial").exists()
    kept = {name: digest for name, digest in bytes_of(out).items() if name.startswith("sessions/")}
    assert sessions <= len(kept) < 2 + 2 * COPIES
    assert kept.items() <= whole.items()
    assert vislam2tag("process", survey, "--out", out, "--jobs", "1").returncode == 0
    assert bytes_of(out) == whole


def full_after(size_bytes: int) -> Callable[[], None]:
    """Let the process write no file greater than this: the writes fail as on a full disk."""
    return lambda: resource.setrlimit(resource.RLIMIT_FSIZE, (size_bytes, size_bytes))


@pytest.mark.parametrize(("size_bytes", "file"), [(100, "run.json"), (200_000, "sensors/"), (3_000_000, "report.html")])
def test_no_space_is_2_with_one_line_and_the_next_run_goes_on(
    survey: Path, whole: dict[str, str], tmp_path: Path, size_bytes: int, file: str
) -> None:
    out = tmp_path / "out"
    raw = bytes_of(survey)
    error = the_error(vislam2tag_process("process", survey, "--out", out, "--jobs", "2", before=full_after(size_bytes)))
    assert error.startswith(f"error: {out / file}")
    assert "cannot be written (File too large); free space or choose another --out, then run the same" in error
    assert bytes_of(out).items() <= whole.items()
    assert not (out / ".partial").exists()
    assert bytes_of(survey) == raw
    assert vislam2tag("process", survey, "--out", out, "--jobs", "1").returncode == 0
    assert bytes_of(out) == whole
