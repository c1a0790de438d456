"""What nobody expected keeps its traceback, in the order of the sessions, whichever process met it."""

from __future__ import annotations

import logging
from pathlib import Path

import pytest

from tests.surveys import make_survey
from vislam2tag.common.errors import OutputError
from vislam2tag.pipeline.labels import session
from vislam2tag.pipeline.labels.process import process
from vislam2tag.pipeline.run.claims import claim
from vislam2tag.pipeline.run.failures import LOG_FILE, log_of, unexpected
from vislam2tag.pipeline.run.workers import process_all


def halve(number: int) -> str:
    """Work of the tests: fails for odd numbers."""
    try:
        if number % 2:
            raise ArithmeticError(f"{number} is odd")
    except ArithmeticError as error:
        return unexpected(f"job {number}", error)
    return str(number // 2)


@pytest.mark.parametrize("workers", [1, 3])
def test_tracebacks_come_in_the_order_of_the_jobs(tmp_path: Path, workers: int) -> None:
    outcomes: list[str] = []
    with claim(tmp_path / "out", {}):
        process_all(halve, list(range(6)), workers, outcomes.append)
    text = (tmp_path / "out" / LOG_FILE).read_text()
    told = [line for line in text.splitlines() if line.startswith(("ERROR", "ArithmeticError"))]
    assert told == [
        line
        for number in (1, 3, 5)
        for line in (f"ERROR job {number}: unexpected ArithmeticError", f"ArithmeticError: {number} is odd")
    ]
    assert "test_failures.py" in text
    assert sum("please report this with its traceback (OUT/log.txt" in outcome for outcome in outcomes) == 3


def test_what_ends_a_run_is_logged_and_names_the_file(tmp_path: Path) -> None:
    with pytest.raises(ZeroDivisionError) as caught, claim(tmp_path / "out", {}):
        raise ZeroDivisionError
    assert log_of(caught.value) == str(tmp_path / "out" / LOG_FILE)
    assert "Traceback" in (tmp_path / "out" / LOG_FILE).read_text()
    with pytest.raises(OutputError) as told, claim(tmp_path / "out", {}):
        raise OutputError("the disk is full")
    assert log_of(told.value) is None
    assert not (tmp_path / "out" / LOG_FILE).exists(), "it is of the last run, which had nothing to log"


def test_work_that_raises_loses_nothing_that_was_logged(caplog: pytest.LogCaptureFixture) -> None:
    def work(number: int) -> str:
        if number == 2:
            raise KeyboardInterrupt
        return halve(number)

    with pytest.raises(KeyboardInterrupt):
        process_all(work, [1, 2, 3], 1, lambda _: None)
    assert [record.levelno for record in caplog.records] == [logging.ERROR]
    assert "1 is odd" in caplog.text


def test_a_session_that_fails_unexpectedly_is_told_in_a_line_and_logged(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    survey = make_survey(tmp_path / "survey", devices=("LG",), seconds=20.0)
    nothing: dict[str, str] = {}
    monkeypatch.setattr(session, "mappable_session", lambda *_, **__: nothing["no such table"])
    summary = process(survey, tmp_path / "out")
    (error,) = summary.failures.values()
    assert "unexpected KeyError: 'no such table'; please report this with its traceback (OUT/log.txt" in error
    assert "Traceback" in (tmp_path / "out" / LOG_FILE).read_text()
