"""Progress where no terminal is: a line now and then for work of hours, none where nobody wants any."""

from __future__ import annotations

import io
from contextlib import redirect_stderr

import pytest

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
