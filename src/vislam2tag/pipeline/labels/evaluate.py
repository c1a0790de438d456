"""Evaluation of a survey: every session, strategy and kind of truth, with tables and a page."""

from __future__ import annotations

import dataclasses
import json
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Unpack

from vislam2tag import __version__
from vislam2tag.common.errors import SurveyError, UsageError
from vislam2tag.common.files.given_files import AnyPath, path_or_none
from vislam2tag.common.files.own_files import OwnFiles
from vislam2tag.common.findings import Finding
from vislam2tag.common.progress import Progress, silent
from vislam2tag.estimation.strategy import (
    Factory,
    MappingStrategy,
    refuse_elsewhere,
    strategies_for_poses,
    strategy_known_as,
    strategy_named,
)
from vislam2tag.labeling.settings import ProcessSettings
from vislam2tag.pipeline.labels.evaluate_session import (
    TRAJECTORIES,
    EvaluationJob,
    StationOutcome,
    evaluate_session,
    evaluate_station,
    station_jobs,
    with_station,
)
from vislam2tag.pipeline.labels.label_run import removed_findings, run_record
from vislam2tag.pipeline.run.claims import claim
from vislam2tag.pipeline.run.output import OutputFolder, without_sessions
from vislam2tag.pipeline.run.selection import OpenedSurvey, RunChoices
from vislam2tag.pipeline.run.workers import Executor
from vislam2tag.quality.evaluation.dense import dense_rows, survey_drift
from vislam2tag.quality.evaluation.metrics import dense_csv, latex_text, rows_csv, sessions_csv, table_rows
from vislam2tag.quality.evaluation.odd_truth import judgement_of_points, odd_points
from vislam2tag.quality.evaluation.record import SessionEvaluation, SurveyEvaluation
from vislam2tag.quality.evaluation.trajectory_files import READERS
from vislam2tag.site.landmark_states import names_shown
from vislam2tag.views.quality_pages import write_evaluation_page

PROGRAM = "vislam2tag evaluate"
RECORD_FILE, PAGE_FILE = "evaluation.json", "report.html"
ERRORS_FILE, LATEX_FILE, SESSIONS_FILE, DENSE_FILE = "errors.csv", "errors.tex", "sessions.csv", "dense.csv"
_OF_RUN = (RECORD_FILE, ERRORS_FILE, LATEX_FILE, SESSIONS_FILE, DENSE_FILE)


def evaluate(
    survey_root: AnyPath,
    out: AnyPath,
    settings: ProcessSettings | None = None,
    *,
    strategies: Sequence[str | Factory | MappingStrategy] = (),
    truth: AnyPath | None = None,
    clock_drift: bool = False,
    progress: Progress[SessionEvaluation] = silent,
    tell: Callable[[Sequence[Finding]], None] = lambda _: None,
    **choices: Unpack[RunChoices],
) -> SurveyEvaluation:
    """Evaluate strategies (none named: all) on a survey against all its ground truth (docs/how-to/evaluate.md).

    A strategy is a name, ``NAME.py:CLASS``, or a class, a function or an object of your own.

    ``truth`` is a folder with a truth file for each session, called by its slug, instead of those in the sessions'
    folders. With ``clock_drift`` a total station's clock may run at another rate than the phone's. ``landmarks``,
    ``selection`` and ``jobs`` are as :class:`~vislam2tag.pipeline.run.selection.RunChoices` says. ``progress`` is
    called twice for a total station's sessions. ``tell`` is called with the sessions whose results were removed because
    the survey no longer contains them. A bad session is only counted in ``SurveyEvaluation.failed``.

    Raises SurveyError if ``survey_root`` is not a survey or has no truth at all, UsageError for an unknown strategy
    or a selection that matches nothing, OutputError if ``out`` cannot be written or is not ours.
    """
    out, truth, settings = Path(out), path_or_none(truth), settings or ProcessSettings()
    names = tuple(dict.fromkeys(map(strategy_known_as, strategies))) or strategies_for_poses()
    for name in names:
        strategy_named(name, settings.mapping)
        if choices.get("jobs", 1) > 1:
            refuse_elsewhere(name)
    if truth is not None and not truth.is_dir():
        raise UsageError(
            f"--truth {truth}: not a folder; expected a folder with a file for each session, such as SLUG.tum"
        )
    opened = OpenedSurvey.at(survey_root, settings, **choices)
    survey, refs, output = opened.survey, opened.refs, OutputFolder(out)
    tasks = opened.tasks(refs)
    todo = [EvaluationJob(task, settings, names, truth, output, clock_drift) for task in tasks]
    _refuse_without_truth(survey.root, todo, truth)
    opened.refuse_output(out, output.own().stems)
    run = run_record(survey.root, opened.landmark_file, settings) | {
        "selection": dataclasses.asdict(opened.selection),
        "strategies": list(names),
        "clock_drift": clock_drift,
    }
    own = OwnFiles.of((*_OF_RUN, PAGE_FILE), (TRAJECTORIES,), (ref.slug for ref in refs))
    with claim(out, run, PROGRAM, own) as folder:
        folder.discard(*_OF_RUN, folders=(TRAJECTORIES,))  # so that no results of an earlier run remain
        gone = sorted({*folder.own().stems} - {*own.stems})
        folder.change_own(lambda before: without_sessions(before, set(gone)))
        tell(removed_findings(gone))
        found = _evaluated(todo, opened.run_all, progress)
        evaluation = _summed(settings, names, [found[ref.slug] for ref in refs])
        _write(folder, evaluation, survey.root.resolve().name)
    return evaluation


def _evaluated(
    todo: list[EvaluationJob], run_all: Executor, progress: Progress[SessionEvaluation]
) -> dict[str, SessionEvaluation]:
    """Evaluate each session by itself, then those before a total station by device, which share a clock."""
    found: dict[str, SessionEvaluation] = {}
    devices = station_jobs(todo)
    total = len(todo) + sum(map(len, devices))

    def report(session: SessionEvaluation) -> None:
        found[session.slug] = session
        progress(session, total)

    def add(outcome: StationOutcome) -> None:
        for slug, tracked in outcome.items():
            news = found[slug].model_copy(update={"error": None, "missing": tracked.missing})
            found[slug] = with_station(found[slug], tracked)
            progress(news, total)

    run_all(evaluate_session, todo, report=report)
    run_all(evaluate_station, devices, report=add)
    return found


def _refuse_without_truth(root: Path, todo: Sequence[EvaluationJob], folder: Path | None) -> None:
    """Raise SurveyError before the work if no session can have a truth, which may be in a ``folder`` of its own."""
    if any(_may_have_truth(job) for job in todo):
        return
    if folder is not None and todo:
        there = sorted(path.name for path in folder.iterdir())
        own = any((job.ref.folder / f"truth{suffix}").is_file() for job in todo for suffix in READERS)
        raise SurveyError(
            f"--truth {folder}: no file has the name of a session: expected names like {todo[0].ref.slug}.tum (or "
            f"{', '.join(READERS)}), and found {names_shown(there) or 'no file'}. Rename the files"
            + (", or remove --truth to use the truth files in the sessions' folders" if own else "")
        )
    if todo:
        raise SurveyError(
            f"{root}: there is no ground truth to compare labels with. Add control points (floor_K/refmarker.csv, and "
            "refMarker.csv in the sessions), a total station's track (tachy.csv) or a truth file (truth.csv, .tum, "
            ".euroc or .kitti in a session, or with --truth). vislam2tag check needs none"
        )


def _may_have_truth(job: EvaluationJob) -> bool:
    folder, stem = job.truth_place
    if any((folder / f"{stem}{suffix}").is_file() for suffix in READERS) or station_jobs([job]):
        return True
    return len(job.task.floor.control_points.ids) > 0


def _summed(settings: ProcessSettings, names: Sequence[str], sessions: Sequence[SessionEvaluation]) -> SurveyEvaluation:
    pressed = [(session.floor, session.presses) for session in sessions]
    odd = odd_points(pressed)
    return SurveyEvaluation(
        version=__version__,
        strategies=list(names),
        max_sigma_m=settings.labels.model_dump(mode="json")["max_sigma_m"],
        rows=table_rows(sessions),
        dense=dense_rows(sessions, names),
        drift=survey_drift(sessions, names),
        retention={name: _mean([session.retention.get(name) for session in sessions]) for name in names},
        sessions=list(sessions),
        odd_points=odd,
        judgement=judgement_of_points(pressed, len(odd)),
    )


def _mean(values: Sequence[float | None]) -> float | None:
    known = [value for value in values if value is not None]
    return round(sum(known) / len(known), 4) if known else None


def _write(folder: OutputFolder, evaluation: SurveyEvaluation, title: str) -> None:
    """Write the tables, the page, and last the record, which marks the output as complete."""
    folder.put_text(ERRORS_FILE, rows_csv(evaluation.rows))
    folder.put_text(LATEX_FILE, latex_text(evaluation.rows))
    folder.put_text(SESSIONS_FILE, sessions_csv(evaluation.sessions))
    if evaluation.dense:
        folder.put_text(DENSE_FILE, dense_csv(evaluation.dense))
    folder.write(PAGE_FILE, lambda path: write_evaluation_page(path, title, evaluation))
    folder.put_text(RECORD_FILE, json.dumps(evaluation.model_dump(mode="json"), indent=1) + "\n")
