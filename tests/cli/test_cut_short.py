"""Runs cut short, by Ctrl-C or a full disk: one line, no half file, and the next run goes on to the same bytes."""

from __future__ import annotations

import resource
import shutil
import signal
from collections.abc import Callable
from pathlib import Path

import pytest

from tests.cli.command import the_error, vislam2tag, vislam2tag_process
from tests.struck import Strike, struck
from tests.surveys import bytes_of, make_survey

COPIES = 3


@pytest.fixture(scope="module")
def survey(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Two sessions and copies of them: enough to interrupt a run in their middle; all can be mapped."""
    root = make_survey(tmp_path_factory.mktemp("cut") / "survey", seconds=60.0)
    for session in list(root.glob("floor_0/*/*")):
        for number in range(COPIES):
            copy = shutil.copytree(session, session.with_name(f"copy{number}"))
            poses = (copy / "poses.csv").read_bytes().splitlines(keepends=True)
            (copy / "poses.csv").write_bytes(b"".join(poses[: -1 - number]))  # the same walk twice would be told
    return root


@pytest.fixture(scope="module")
def undisturbed(survey: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The output of an undisturbed run."""
    out = tmp_path_factory.mktemp("whole") / "out"
    assert vislam2tag("process", survey, "--out", out, "--jobs", "1").returncode == 0
    return out


@pytest.fixture(scope="module")
def whole(undisturbed: Path) -> dict[str, str]:
    """What an undisturbed run writes."""
    return bytes_of(undisturbed)


@pytest.mark.parametrize(
    ("jobs", "sessions", "sent"), [(1, 2, signal.SIGTERM), (2, 0, signal.SIGINT), (2, 2, signal.SIGINT)]
)
def test_an_interrupt_is_130_with_one_line_and_the_next_run_goes_on(
    survey: Path, whole: dict[str, str], tmp_path: Path, jobs: int, sessions: int, sent: signal.Signals
) -> None:
    out = tmp_path / "out"
    strike = Strike(2 * sessions + 2, "/sessions/", sent)  # each removes an old result, then writes its own
    done = struck(out, strike, "process", survey, "--out", out, "--jobs", str(jobs))
    message = the_error(done, 130) + "\n"
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


@pytest.mark.parametrize("file", ["run.json", "sensors/", "report.html"])
def test_no_space_is_2_with_one_line_and_the_next_run_goes_on(
    survey: Path, undisturbed: Path, whole: dict[str, str], tmp_path: Path, file: str
) -> None:
    out = tmp_path / "out"
    raw = bytes_of(survey)
    full = full_after(min((undisturbed / name).stat().st_size for name in whole if name.startswith(file)) - 1)
    error = the_error(vislam2tag_process("process", survey, "--out", out, "--jobs", "2", before=full))
    assert error.startswith(f"error: {out / file}")
    assert "cannot be written (File too large); free space or choose another --out, then run the same" in error
    assert bytes_of(out).items() <= whole.items()
    assert not (out / ".partial").exists()
    assert bytes_of(survey) == raw
    assert vislam2tag("process", survey, "--out", out, "--jobs", "1").returncode == 0
    assert bytes_of(out) == whole
