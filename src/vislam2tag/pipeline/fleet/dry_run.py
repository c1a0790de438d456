"""What ``fleet process`` would do, and why, survey by survey: nothing is written."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

from vislam2tag.common.errors import OutputError, SurveyError
from vislam2tag.labeling.settings import ProcessSettings
from vislam2tag.pipeline.fleet.catalogue import Fleet
from vislam2tag.pipeline.fleet.layout import LABELS, SURVEYS
from vislam2tag.pipeline.fleet.process import chosen
from vislam2tag.pipeline.labels.dry_run import dry_run
from vislam2tag.pipeline.run.workers import Executor
from vislam2tag.site.stored_survey import survey_at_hand


@dataclass(frozen=True)
class PlannedSurvey:
    """A survey that a run would look at."""

    survey: str
    kept: int
    """Sessions that are done and unchanged."""
    reasons: dict[str, int]
    """Sessions that would be processed, by why; one may have several reasons."""
    to_process: int
    """How many these are."""
    error: str | None
    """Why the survey cannot be opened."""


def fleet_dry_run(
    fleet: Path,
    settings_for: Callable[[Path], ProcessSettings] = lambda _: ProcessSettings(),
    *,
    surveys: Sequence[str] = (),
    jobs: int = 1,
    executor: Executor | None = None,
) -> Iterator[PlannedSurvey]:
    """Say of each survey what :func:`.process_fleet` with these arguments would process; raises as that."""
    for row in chosen(Fleet(fleet), surveys):
        name = row["survey"]
        try:
            with survey_at_hand(fleet / SURVEYS / name) as root:
                found = dry_run(root, fleet / LABELS / name, settings_for(root), jobs=jobs, executor=executor)
        except (OutputError, SurveyError) as error:
            yield PlannedSurvey(name, 0, {}, 0, str(error))
            continue
        run = [one for one in found if one.reasons]
        reasons = Counter(reason.value for one in run for reason in one.reasons)
        yield PlannedSurvey(name, len(found) - len(run), dict(sorted(reasons.items())), len(run), None)
