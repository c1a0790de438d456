"""The main job: a survey folder goes in; tables, results, summary and report come out."""

from __future__ import annotations

import json
import multiprocessing
import os
import platform
import signal
import threading
from collections.abc import Callable, Iterator
from concurrent.futures import Future, ProcessPoolExecutor, as_completed
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager
from dataclasses import dataclass, replace
from multiprocessing.connection import wait
from pathlib import Path

import numpy as np
import polars as pl

from vislam2tag import __version__
from vislam2tag.errors import OutputError, UsageError
from vislam2tag.findings import Finding, Severity
from vislam2tag.mapping import strategy_named
from vislam2tag.pipeline.session import Job, Outcome, process_session
from vislam2tag.pipeline.store import OutputFolder, claim
from vislam2tag.report.html import write_report
from vislam2tag.report.summary import summarise
from vislam2tag.results import SessionResult, Summary
from vislam2tag.sessions import open_survey
from vislam2tag.settings import Settings
from vislam2tag.survey.corrections import CORRECTIONS_FILE, read_corrections
from vislam2tag.survey.model import SessionRef, Survey

Progress = Callable[[Outcome, int], None]
"""Called after each session with its outcome and the total number of sessions."""


@dataclass(frozen=True)
class Selection:
    """Which sessions of a survey to process; an empty tuple means all."""

    floors: tuple[int, ...] = ()
    devices: tuple[str, ...] = ()


def process(
    survey_root: Path,
    out: Path,
    settings: Settings | None = None,
    *,
    selection: Selection | None = None,
    jobs: int = 1,
    progress: Progress | None = None,
) -> Summary:
    """Process a survey: map every session, label every reading, write tables, results, summary and report.

    With ``jobs`` > 1 sessions run in that many processes (call it from under ``if __name__ == "__main__":``).
    Raises SurveyError where ``survey_root`` is no survey, UsageError for a selection that matches nothing,
    OutputError where ``out`` cannot be written or is not ours; a bad session is only counted in ``Summary.failed``.
    """
    settings = settings or Settings()
    selection = selection or Selection()
    strategy_named(settings.strategy, settings)
    survey = open_survey(survey_root, settings.default_landmark_sigma_m)
    refs = _selected(survey, selection)
    survey = _with_exclusions(survey)
    with claim(out, _run_record(settings, selection)) as folder:
        folder.keep_only({ref.slug for ref in refs})
        _process_all(_jobs(survey, refs, settings, folder), jobs, progress)
        return _reduce(survey, refs, settings, folder)


def _selected(survey: Survey, selection: Selection) -> list[SessionRef]:
    """Return the chosen sessions, without those that corrections exclude."""
    for wanted, have, option in (
        (selection.floors, {ref.key.floor for ref in survey.sessions}, "--floor"),
        (selection.devices, {ref.key.device for ref in survey.sessions}, "--device"),
    ):
        unknown = [value for value in wanted if value not in have]
        if unknown:
            there = ", ".join(str(value) for value in sorted(have, key=str))
            raise UsageError(f"{option} {unknown[0]}: the survey has no session of it; there are: {there}")
    corrections = read_corrections(survey.root)
    return [
        ref
        for ref in survey.sessions
        if (not selection.floors or ref.key.floor in selection.floors)
        and (not selection.devices or ref.key.device in selection.devices)
        and not corrections.excludes(ref.key)
    ]


def _with_exclusions(survey: Survey) -> Survey:
    """Say in the survey's findings which sessions corrections leave out."""
    corrections = read_corrections(survey.root)
    excluded = [
        Finding(
            kind="excluded_session",
            file=CORRECTIONS_FILE,
            count=1,
            severity=Severity.INFO,
            message=f"{ref.key} is left out{entry.because()}",
        )
        for ref in survey.sessions
        for entry in corrections.for_session(ref.key).exclude_session[:1]
    ]
    return replace(survey, findings=(*survey.findings, *excluded))


def _run_record(settings: Settings, selection: Selection) -> dict[str, object]:
    return {
        "settings": settings.model_dump(mode="json"),
        "selection": {"floors": list(selection.floors), "devices": list(selection.devices)},
        "versions": {
            "vislam2tag": __version__,
            "python": platform.python_version(),
            "numpy": np.__version__,
            "polars": pl.__version__,
        },
    }


def _jobs(survey: Survey, refs: list[SessionRef], settings: Settings, folder: OutputFolder) -> Iterator[Job]:
    corrections = read_corrections(survey.root)
    landmarks = survey.site.landmarks
    for ref in refs:
        here = landmarks.select(np.flatnonzero(landmarks.floor == ref.key.floor).tolist())
        yield Job(ref, here, corrections, settings, folder)


def _process_all(jobs: Iterator[Job], workers: int, progress: Progress | None) -> None:
    todo = list(jobs)
    report = progress or _silent
    if workers <= 1:
        for job in todo:
            report(process_session(job), len(todo))
        return
    with _pool(min(workers, max(len(todo), 1))) as pool:
        futures: list[Future[Outcome]] = [pool.submit(process_session, job) for job in todo]
        try:
            for future in as_completed(futures):
                report(future.result(), len(todo))
        except BrokenProcessPool as error:
            raise OutputError(
                "a worker process was ended from outside (out of memory?); "
                "run again with fewer --jobs, what is done is kept"
            ) from error
        finally:
            for future in futures:
                future.cancel()


def _silent(_outcome: Outcome, _total: int) -> None:
    """Report nothing."""


@contextmanager
def _pool(workers: int) -> Iterator[ProcessPoolExecutor]:
    """Worker processes of one thread each, so that they do not compete for the cores."""
    before = os.environ.get("POLARS_MAX_THREADS")
    os.environ["POLARS_MAX_THREADS"] = "1"
    try:
        context = multiprocessing.get_context("spawn")
        with ProcessPoolExecutor(workers, mp_context=context, initializer=_start_worker) as pool:
            yield pool
    finally:
        if before is None:
            del os.environ["POLARS_MAX_THREADS"]
        else:
            os.environ["POLARS_MAX_THREADS"] = before


def _start_worker() -> None:
    """Leave interrupts to the main process, and end at once when it dies (it may be killed)."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    threading.Thread(target=_end_with_parent, daemon=True).start()


def _end_with_parent() -> None:
    parent = multiprocessing.parent_process()
    if parent is not None:
        wait([parent.sentinel])
        os._exit(1)


def _reduce(survey: Survey, refs: list[SessionRef], settings: Settings, folder: OutputFolder) -> Summary:
    """Reduce the sessions' results, one at a time, to summary and report."""

    def results() -> Iterator[SessionResult]:
        for ref in refs:
            result = folder.result(ref.slug)
            if result is not None:
                yield result

    summary = summarise(results(), settings.strategy, __version__)
    folder.write("report.html", lambda path: write_report(path, survey, settings, results(), summary))
    folder.write_text("summary.json", json.dumps(summary.model_dump(mode="json"), indent=1) + "\n")
    return summary
