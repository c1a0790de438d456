"""A survey from its raw files to a data set: labels, checks, data set; unchanged results are kept."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TypeAlias, TypeVar, Unpack

from pydantic import ValidationError

from vislam2tag.common.files.given_files import AnyPath, path_or_none, read_bytes, read_json
from vislam2tag.common.files.own_files import OWN_FILES, OwnFiles
from vislam2tag.common.findings import Finding
from vislam2tag.common.progress import Progress, silent
from vislam2tag.common.records import Record
from vislam2tag.common.tabular import Result
from vislam2tag.datasets.folder import RUN_DATASET, is_dataset
from vislam2tag.datasets.labelled import RUN_LABELS
from vislam2tag.labeling.results import CONFLICTS_PAGE, RESULTS, RUN_FILE, Summary
from vislam2tag.pipeline.datasets.build import BuildOptions, build_dataset
from vislam2tag.pipeline.datasets.finish import PAGE_FILE as DATASET_PAGE
from vislam2tag.pipeline.labels.check import CHECK_FILE, check
from vislam2tag.pipeline.labels.check import PAGE_FILE as CHECK_PAGE
from vislam2tag.pipeline.labels.diagnose import DiagnosedSession, diagnose
from vislam2tag.pipeline.labels.process import process
from vislam2tag.pipeline.labels.session import Outcome
from vislam2tag.pipeline.run.claims import claim
from vislam2tag.pipeline.run.keys import code_key, key_of
from vislam2tag.pipeline.run.output import OutputFolder
from vislam2tag.pipeline.run.selection import SurveyRunArguments, given_settings, refuse_among_sessions
from vislam2tag.quality.diagnosis.record import Diagnosis
from vislam2tag.quality.self_check_record import SessionCheck, SurveyCheck
from vislam2tag.sessions.registry import open_survey
from vislam2tag.settings import Settings
from vislam2tag.site.links import left_out_of, shared_survey
from vislam2tag.views.conflict_page import write_conflict_page
from vislam2tag.views.run_dashboard import Page, RunFigures, write_dashboard

LABELS, DIAGNOSIS, CHECK, DATASET, INDEX = RUN_LABELS, "diagnosis", "check", RUN_DATASET, "index.html"
DIAGNOSIS_FILE = "diagnosis.json"
PROGRAM = "vislam2tag run"
_STEPS_FILE, _FIGURES_FILE = "steps.json", "figures.json"
_OWN = OwnFiles.of(
    (
        *(DIAGNOSIS_FILE, CONFLICTS_PAGE, INDEX, _STEPS_FILE, _FIGURES_FILE),
        *(f"{LABELS}/{OWN_FILES}", f"{DATASET}/{OWN_FILES}"),
        *(f"{CHECK}/{CHECK_FILE}", f"{CHECK}/{CHECK_PAGE}"),
    )
)
_Record = TypeVar("_Record", bound=Record)
_Made = TypeVar("_Made")
_StepProgress: TypeAlias = Progress[tuple[str, str | None]]
"""Called for each session with the step and the reason if it failed."""


class SurveyRun(Result):
    """Result of a run."""

    labels: Summary
    check: SurveyCheck
    faults: tuple[str, ...]
    """Faults of the survey, one sentence each; `diagnose` shows the evidence and corrects them."""
    correctable: bool = False
    """Whether `diagnose --apply` is the next step for these faults."""
    kept: tuple[str, ...]
    """Steps that were skipped because they were done and their inputs had not changed."""


def run_survey(
    survey_root: AnyPath,
    out: AnyPath,
    settings: Settings | None = None,
    *,
    follow_links: bool = False,
    progress: _StepProgress = silent,
    tell: Callable[[Sequence[Finding]], None] = lambda _: None,
    **arguments: Unpack[SurveyRunArguments],
) -> SurveyRun:
    """Make ``labels``, ``diagnosis.json``, ``conflicts.html``, ``check``, ``dataset`` and ``index.html`` in ``out``.

    ``progress`` is called for each session with the step and the reason if it failed. ``tell`` is called with findings
    about the site's files and with files that are skipped because links lead outside the survey. ``landmarks``,
    ``follow_links`` and ``jobs`` are as those of :func:`~vislam2tag.pipeline.labels.process.process`. Raises what the
    steps raise; completed steps are kept.
    """
    survey_root, out, landmarks = Path(survey_root), Path(out), path_or_none(arguments.get("landmarks"))
    jobs = arguments.get("jobs", 1)
    settings = (settings or Settings()).with_given(given_settings(arguments))
    survey = open_survey(
        survey_root, settings.survey.landmark_sigma_m, landmarks, use_planned=settings.survey.use_planned
    )
    refuse_among_sessions(survey, out)
    name = survey_root.resolve().name
    with claim(out, {"survey": name}, PROGRAM, _OWN) as folder:
        steps = _Steps(folder)
        summary = process(
            survey_root,
            out / LABELS,
            settings,
            landmarks=landmarks,
            jobs=jobs,
            replace=True,
            follow_links=follow_links,
            progress=_named("label", progress),
            tell=tell,
        )
        labels, walkable = _labels_key(out / LABELS), settings.walkable.model_dump(mode="json")
        shown = shared_survey(survey, follow_links=follow_links)
        pages = {"left_out": [finding.message for finding in left_out_of(shown.findings)]}
        diagnosis = steps.unless_done(
            DIAGNOSIS,
            key_of(labels, code_key(diagnose.__module__)),
            lambda: _kept(out / DIAGNOSIS_FILE, Diagnosis),
            lambda: _diagnose(survey_root, settings, landmarks, jobs, progress, folder),
        )
        folder.write(CONFLICTS_PAGE, lambda path: write_conflict_page(path, shown, diagnosis.references))
        checked = steps.unless_done(
            CHECK,
            key_of(labels, walkable, pages, code_key(check.__module__)),
            lambda: _kept(out / CHECK / CHECK_FILE, SurveyCheck) if (out / CHECK / CHECK_PAGE).is_file() else None,
            lambda: check(
                survey_root,
                settings,
                out=out / CHECK,
                landmarks=landmarks,
                jobs=jobs,
                walkable=settings.walkable,
                follow_links=follow_links,
                progress=_named("check", progress),
            ),
        )
        steps.unless_done(
            DATASET,
            key_of(
                labels,
                walkable,
                pages | {"follow_links": follow_links},
                settings.dataset.model_dump(mode="json"),
                code_key(build_dataset.__module__),
            ),
            lambda: is_dataset(out / DATASET) or None,
            lambda: _collect(survey_root, out, settings, checked, follow_links, jobs, progress, tell),
        )
        faults = [fault.summary for fault in diagnosis.open]
        before = _figures_before(folder, RunFigures.of(summary, checked, faults))
        results = (summary, checked, faults)
        folder.write(INDEX, lambda path: write_dashboard(path, shown, out / LABELS, results, before, _PAGES))
        return SurveyRun(
            labels=summary,
            check=checked,
            faults=tuple(faults),
            correctable=diagnosis.correctable,
            kept=tuple(steps.kept),
        )


def _named(step: str, progress: _StepProgress) -> Progress[SessionCheck | Outcome | DiagnosedSession]:
    """Progress of one step, reported with the step's name."""
    return lambda outcome, total: progress((step, outcome.error), total)


def _diagnose(
    survey: Path,
    settings: Settings,
    landmarks: Path | None,
    jobs: int,
    progress: _StepProgress,
    folder: OutputFolder,
) -> Diagnosis:
    found = diagnose(survey, settings, landmarks=landmarks, jobs=jobs, progress=_named("diagnose", progress))
    folder.put_text(DIAGNOSIS_FILE, found.model_dump_json(indent=1) + "\n")
    return found


def _collect(
    survey: Path,
    out: Path,
    settings: Settings,
    checked: SurveyCheck,
    follow_links: bool,
    jobs: int,
    progress: _StepProgress,
    tell: Callable[[Sequence[Finding]], None],
) -> bool:
    build_dataset(
        out / LABELS,
        out / DATASET,
        settings.dataset,
        BuildOptions(
            name=survey.resolve().name,
            surveys=survey,
            walked=checked.walked,
            replace=True,
            follow_links=follow_links,
        ),
        jobs=jobs,
        progress=lambda step, total: progress((step.stage, step.error), total),
        tell=tell,
    )
    return True


_PAGES = {
    "report": Page(f"{LABELS}/report.html", "Report", "every walk on the plan, lost frames with causes, all findings"),
    "conflicts": Page(CONFLICTS_PAGE, "Conflicts", "measurements of landmarks that agree, and those that contradict"),
    "check": Page(f"{CHECK}/{CHECK_PAGE}", "Check", "accuracy of the labels, bad landmarks, coverage by room"),
    "dataset": Page(f"{DATASET}/{DATASET_PAGE}", "Data set", "fingerprints, coverage, splits, statistics"),
}


class _Figures(Record):
    """Figures of the last run, and of the last one before it that differed."""

    now: RunFigures
    before: RunFigures | None = None


def _figures_before(folder: OutputFolder, now: RunFigures) -> RunFigures | None:
    """Figures of the last run that differed from these, which are kept; None without one."""
    last = _kept(folder.root / _FIGURES_FILE, _Figures)
    if last is not None and last.now == now:
        return last.before
    before = None if last is None else last.now
    folder.put_text(_FIGURES_FILE, _Figures(now=now, before=before).model_dump_json(indent=1) + "\n")
    return before


def _kept(path: Path, kind: type[_Record]) -> _Record | None:
    """Earlier result of a step; None if it is missing or damaged, so that the step runs again."""
    try:
        return kind.model_validate_json(read_bytes(path))
    except (OSError, ValidationError):
        return None


class _Steps:
    """Keys of the steps that are done, in a file of the output folder."""

    def __init__(self, folder: OutputFolder) -> None:
        self._folder = folder
        try:
            self._keys = {str(name): str(key) for name, key in read_json(folder.root / _STEPS_FILE).items()}
        except (OSError, ValueError, AttributeError):
            self._keys = {}
        self.kept: list[str] = []

    def unless_done(self, step: str, key: str, kept: Callable[[], _Made | None], work: Callable[[], _Made]) -> _Made:
        """Run a step and record it, unless it was done with this key and its result is ``kept``; return the result."""
        if self._keys.get(step) == key and (there := kept()) is not None:
            self.kept.append(step)
            return there
        made = work()
        self._keys[step] = key
        self._folder.put_text(_STEPS_FILE, json.dumps(self._keys, indent=1, sort_keys=True) + "\n")
        return made


def _labels_key(labels: Path) -> str:
    """SHA-256 of the inputs of labels, by session, and of their outcome."""
    files = [labels / RUN_FILE, *sorted((labels / RESULTS).glob("*.json"))]
    return key_of({path.name: hashlib.sha256(read_bytes(path)).hexdigest() for path in files})
