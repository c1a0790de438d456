"""Progress where no terminal is: a line now and then for work of hours, none where nobody wants any.

Runs cut short, by Ctrl-C or a full disk: one line, no half file, and the next run goes on to the same bytes.
"""

from __future__ import annotations

import io
import resource
import shutil
import signal
from collections.abc import Callable
from contextlib import redirect_stderr
from pathlib import Path

import pytest

from tests.cli.command import the_error, vislam2tag, vislam2tag_process
from tests.struck import Strike, struck
from tests.surveys import bytes_of, make_survey
from vislam2tag.cli.progress import session_bar
from vislam2tag.cli.terminal import _shown


@pytest.fixture(autouse=True)
def _progress_is_wanted(monkeypatch: pytest.MonkeyPatch) -> None:
    """Whatever an earlier test's ``--quiet`` left in this process."""
    monkeypatch.setitem(_shown, "progress", True)


def printed(sessions: int, failed: tuple[int, ...] = (), *, lines: bool = True) -> list[str]:
    with redirect_stderr(io.StringIO()) as told, session_bar("sessions", lines=lines) as bar:
        for number in range(sessions):
            bar.advance(sessions, f"walk {number}" if number in failed else None, rows=10)
    return told.getvalue().splitlines()


def test_sessions_rate_failures_and_time_left_are_told_now_and_then() -> None:
    lines = printed(1000, failed=(3, 700))
    assert lines[0] == "failed walk 3"
    told = [line for line in lines if not line.startswith("failed")]
    assert len(told) == 20
    assert told[0].startswith("50 of 1000 sessions, ")
    assert "sessions/s" in told[0]
    assert ", 1 failed, " in told[0]
    assert told[0].endswith(" s left")
    assert ", 2 failed, 0 s left" in told[-1]


def test_few_sessions_get_a_line_each() -> None:
    assert [line.partition(",")[0] for line in printed(3)] == [f"{number} of 3 sessions" for number in (1, 2, 3)]


def test_parts_of_a_long_session_are_told_and_none_twice() -> None:
    with redirect_stderr(io.StringIO()) as told, session_bar("sessions", lines=True) as bar:
        for tenth in range(1, 11):
            bar.reach(tenth / 10, 2)
        bar.advance(2, None)
        bar.reach(1.5, 2)
    lines = told.getvalue().splitlines()
    assert [line.partition(" of 2 sessions, ")[0] for line in lines] == [
        *(f"{tenth / 10:.2f}" for tenth in range(1, 11)),
        "1.50",
    ]
    assert all(line.endswith(" s left") for line in lines)


def test_nothing_is_told_where_nobody_wants_it(monkeypatch: pytest.MonkeyPatch) -> None:
    assert printed(40, lines=False) == []
    monkeypatch.setitem(_shown, "progress", False)
    assert printed(40) == []


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


@pytest.mark.slow
@pytest.mark.parametrize(
    ("jobs", "sessions", "sent"), [(1, 2, signal.SIGTERM), (2, 0, signal.SIGINT), (2, 2, signal.SIGINT)]
)
def test_an_interrupt_is_130_with_one_line_and_the_next_run_goes_on(
    survey: Path, whole: dict[str, str], tmp_path: Path, jobs: int, sessions: int, sent: signal.Signals
) -> None:
    out = tmp_path / "out"
    strike = Strike(3 * sessions + 2, "/sessions/", sent)  # each removes an old result, writes its own and renames it
    done = struck(out, strike, "process", survey, "--out", out, "--jobs", str(jobs))
    message = the_error(done, 130) + "\n"
    assert not (out / ".partial").exists()
    kept = {name: digest for name, digest in bytes_of(out).items() if name.startswith("sessions/")}
    assert sessions <= len(kept) < 2 + 2 * COPIES
    contains = f"{out} contains the labels of {len(kept)} sessions; run the same command again to go on"
    assert message == f"interrupted: {contains if kept else f'no session was finished in {out}'}\n"
    assert kept.items() <= whole.items()
    assert vislam2tag("process", survey, "--out", out, "--jobs", "1").returncode == 0
    assert bytes_of(out) == whole


@pytest.mark.slow
@pytest.mark.parametrize(
    ("step", "text", "there"),
    [
        (1, "", "nothing was written to {out}"),
        (1, "/.vislam2tag-files", "nothing was written to {out}"),
        (1, "/diagnosis.json", "{out} contains labels; run the same command again to go on"),
    ],
)
def test_an_interrupted_run_says_what_is_on_the_disk(
    survey: Path, tmp_path: Path, step: int, text: str, there: str
) -> None:
    out = tmp_path / "out"
    done = struck(out, Strike(step, text, signal.SIGINT), "run", survey, "--out", out, "--jobs", "1")
    assert the_error(done, 130) == f"interrupted: {there.format(out=out)}"
    assert (out / "labels/summary.json").is_file() == ("labels" in there)


@pytest.mark.slow
def test_an_interrupted_evaluation_and_check_say_what_is_on_the_disk(survey: Path, tmp_path: Path) -> None:
    for command, file, without in (
        ("evaluate", "evaluation.json", "{out} contains no evaluation"),
        ("check", "check.html", "{out}/check.json written; run the same command again"),
    ):
        out = tmp_path / command
        strike = Strike(1, f"/{file}", signal.SIGINT)
        done = struck(out, strike, command, survey, "--out", out, "--jobs", "1")
        assert the_error(done, 130) == f"interrupted: {without.format(out=out)}"
        assert not (out / file).exists()


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
