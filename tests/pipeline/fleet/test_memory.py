"""What the client holds of a fleet does not grow with it: surveys are opened as their sessions can be handed out."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from contextlib import contextmanager
from pathlib import Path
from types import SimpleNamespace
from typing import Any, NamedTuple

import pytest

from tests.pipeline.fleet.test_catalogue import row
from vislam2tag.pipeline.fleet import process as module
from vislam2tag.pipeline.fleet.catalogue import Fleet
from vislam2tag.pipeline.fleet.process import FleetOutcome, SessionOutcome, process_fleet
from vislam2tag.pipeline.fleet.reduction import SurveyJob, SurveyOutcome
from vislam2tag.pipeline.labels.session import Outcome
from vislam2tag.pipeline.run.selection import OpenedSurvey
from vislam2tag.pipeline.run.workers import Report, process_all
from vislam2tag.settings import Settings


class Held(NamedTuple):
    """The most that the client held at once."""

    surveys: int
    jobs: int


class Counting:
    """Surveys of made-up sessions; counts those that are open."""

    def __init__(self, sessions: int) -> None:
        self.sessions, self.open, self.most = sessions, 0, 0

    @contextmanager
    def label_run(self, *_: Any, **__: Any) -> Any:
        self.open += 1
        self.most = max(self.most, self.open)
        shown = SimpleNamespace(findings=())
        yield SimpleNamespace(tasks=list(range(self.sessions)), settings=Settings(), folder=None, shown=shown)
        self.open -= 1

    def jobs_of(self, tasks: list[int], *_: object) -> list[Any]:
        return [SimpleNamespace(slug=str(task), code="code") for task in tasks]


def made_up(job: module.FleetJob) -> FleetOutcome:
    if isinstance(job, SurveyJob):
        return SurveyOutcome(job.survey, {"state": "done"}, None)
    return SessionOutcome(job.survey, Outcome(job.slug, None, True, 1))


@pytest.fixture
def run(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> Callable[[int, int], Held]:
    def process_made_up(surveys: int, sessions: int) -> Held:
        fleet = tmp_path / f"{surveys}-{sessions}"
        Fleet(fleet).change([row(number, "new") for number in range(surveys)])
        counting, held = Counting(sessions), {"now": 0, "most": 0}
        monkeypatch.setattr(module, "label_run", counting.label_run)
        monkeypatch.setattr(module, "jobs_of", counting.jobs_of)
        monkeypatch.setattr(module, "inputs_of", lambda *_: "inputs")
        survey = SimpleNamespace(sessions=(), findings=())
        monkeypatch.setattr(OpenedSurvey, "at", lambda *_: SimpleNamespace(survey=survey))
        monkeypatch.setattr(module, "shared_survey", lambda found, **_: found)
        monkeypatch.setattr(module, "described", lambda _: {})

        def executor(work: object, todo: Iterable[Any], *, report: Report[Any, Any]) -> None:
            def counted() -> Iterable[Any]:
                for job in todo:
                    held["now"] += 1
                    held["most"] = max(held["most"], held["now"])
                    yield job

            def ended(outcome: FleetOutcome) -> Iterable[Any] | None:
                held["now"] -= isinstance(outcome, SessionOutcome)
                return report(outcome)

            process_all(made_up, counted(), 1, ended)

        totals = process_fleet(fleet, executor=executor)
        assert totals.states == {"done": surveys}
        assert counting.open == 0
        return Held(counting.most, held["most"])

    return process_made_up


def test_what_is_held_does_not_grow_with_surveys_and_sessions(run: Callable[[int, int], Held]) -> None:
    assert run(4, 3) == Held(1, 1)
    assert run(400, 50) == Held(1, 1)


def test_the_catalogue_is_written_a_hundred_times_however_many_surveys_there_are(
    run: Callable[[int, int], Held], tmp_path: Path
) -> None:
    run(1000, 1)
    assert Fleet(tmp_path / "1000-1").record().number == 101
