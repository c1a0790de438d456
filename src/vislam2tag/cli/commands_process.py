"""Commands that label whole surveys: ``process``, ``run`` and ``demo``."""

from __future__ import annotations

import os
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from vislam2tag import api
from vislam2tag.cli.next_steps import next_step
from vislam2tag.cli.options import (
    ALL_CORES,
    AsJson,
    ConfigFile,
    DryRun,
    ExecutorName,
    ExecutorOptions,
    FollowLinks,
    Jobs,
    LandmarkFile,
    Replace,
    SessionOptions,
    SurveyFolder,
    setting,
    settings_from,
)
from vislam2tag.cli.progress import contents_there, interrupted_with, labels_there, session_bar
from vislam2tag.cli.records import argument, command, option
from vislam2tag.cli.tables import print_warnings
from vislam2tag.cli.terminal import answer, say, visible_console
from vislam2tag.common.files.store import shown
from vislam2tag.common.garbage import keep_freed_memory
from vislam2tag.common.plugins import STRATEGIES
from vislam2tag.labeling.settings import LabelRule
from vislam2tag.settings import Settings

if TYPE_CHECKING:
    from rich.table import Table


DEFAULT_STRATEGY = Settings().strategy
STRATEGY_HELP = (
    f"Mapping strategy: {', '.join(STRATEGIES.names())}, or NAME.py:CLASS for your own.  [default: {DEFAULT_STRATEGY}]"
)


@dataclass(frozen=True, kw_only=True)
class ProcessOptions:
    """Arguments and options of ``vislam2tag process``."""

    survey: SurveyFolder
    out: Path = option(..., "Output folder: new, empty or from an earlier run.")
    landmarks: LandmarkFile = None
    strategy: str | None = option(
        None,
        STRATEGY_HELP,
        sets=("strategy",),
    )
    sessions: SessionOptions
    replace: Replace = False
    follow_links: FollowLinks = False
    dry_run: DryRun = False
    jobs: Jobs = ALL_CORES
    where: ExecutorOptions
    json: AsJson = False
    config: ConfigFile = None
    label_rule: LabelRule | None = setting("labels.rule", hidden=True)
    max_gap_s: float | None = setting("labels.max_gap_s", hidden=True)
    visit_radius_m: float | None = setting("mapping.visit_radius_m", hidden=True)
    max_sigma_m: float | None = setting("labels.max_sigma_m")
    max_step_m: float | None = setting("mapping.max_step_m", hidden=True)
    together: bool | None = setting("together")
    use_planned: bool | None = setting("survey.use_planned")
    allow_for_pose_lag: bool | None = setting("mapping.smoother.allow_for_pose_lag", hidden=True)


@command
def process_command(given: ProcessOptions) -> None:
    """Map all sessions of a survey and label their readings.

    Writes OUT/trajectory, wifi, sensors, ble and rtt (a Parquet file for each session with such data), OUT/sessions (a
    JSON file for each session), OUT/summary.json, OUT/run.json (settings and versions) and OUT/report.html. Sessions
    that are finished in OUT and unchanged are not processed again. After an interruption, run the same command to
    continue.

    Exit code: 0 all sessions mapped (see the report for findings), 1 a session cannot be read or mapped, or landmark
    ids or corrections.toml do not match, 2 wrong usage or not a survey, 3 no frame has a position, 130 interrupted.

    \b
    Examples:
      vislam2tag process survey --out labels
      vislam2tag process survey --out labels --floor 1 --floor 4 --device LG \\
          --strategy local
      vislam2tag process survey --out labels --max-sigma-m 0.3 \\
          --landmarks completed.csv
      vislam2tag process survey --out labels --together
      vislam2tag process survey --out labels --strategy NAME.py:CLASS
      vislam2tag process survey --out labels --dry-run
      vislam2tag process s3://walks/hospital --out s3://labels/hospital \\
          --executor dask --scheduler tcp://10.0.0.5:8786
    """
    keep_freed_memory()
    if given.jobs > 1:  # threads of this process would compete with its workers, which have one each
        os.environ.setdefault("POLARS_MAX_THREADS", "1")
    settings = settings_from(given, given.survey)
    with given.where.opened(given.jobs) as executor:
        if given.dry_run:
            _print_dry_run(given, settings, executor)
        summary = _process_with_progress(given, settings, executor)
    answer(
        summary,
        given.json,
        lambda: _print_process(summary, given),
        failed=summary.problem is not None,
        nothing=not summary.frames_placed,
    )


def _print_process(summary: api.Summary, given: ProcessOptions) -> None:
    _print_summary(summary, given.out)
    for fault in summary.faults:
        say(f"wrong: {fault}")
    say(f"diagnosis of the survey: {summary.judgement.sentence}")
    for sentence in _unlabelled(summary):
        say(sentence)
    next_step(_after_process(summary, together=given.together), survey=given.survey, out=given.out)


def _after_process(summary: api.Summary, *, together: bool | None) -> str:
    """Name of the next step."""
    from vislam2tag.views.run_summary import joining_helps

    found = {
        "process, ask": "one_place_helps" in summary.site_findings,
        "process, unsure": not together and joining_helps(summary) and not summary.faults and not summary.failed,
        "process, failed": summary.problem is not None or bool(_lost_readings(summary) or _unlabelled(summary)),
        "process, faults": bool(summary.faults),
    }
    return next((name for name, so in found.items() if so), "process")


def _print_dry_run(given: ProcessOptions, settings: Settings, executor: api.Executor) -> None:
    from vislam2tag.pipeline.labels.process import dry_run

    found = dry_run(
        given.survey,
        given.out,
        settings,
        executor=executor,
        landmarks=given.landmarks,
        selection=given.sessions.selection,
        replace=given.replace,
    )

    def show() -> None:
        for one in found:
            if one.reasons:
                say(f"{one.session}: {', '.join(reason.value for reason in one.reasons)}")
        if not found:
            say("nothing to process: all sessions of the survey are excluded")
            next_step("process, failed", survey=given.survey)
            return
        count = sum(bool(one.reasons) for one in found)
        say(f"{count} of {len(found)} sessions would be processed; the others are finished and unchanged")
        next_step("process, dry run", survey=given.survey, out=given.out)

    answer(found, given.json, show, nothing=not found)


def _process_with_progress(given: ProcessOptions, settings: Settings, executor: api.Executor) -> api.Summary:
    compared, to_compare, sessions = 0, 0, 0

    def compare(_: object, total: int) -> None:
        nonlocal compared, to_compare, sessions
        compared, to_compare, sessions = compared + 1, total, sessions or total
        bar.advance(to_compare + sessions, None)

    on_cluster = given.where.executor is ExecutorName.DASK
    with interrupted_with(lambda: labels_there(given.out)), session_bar("sessions", lines=on_cluster) as bar:
        return api.process(
            given.survey,
            given.out,
            settings,
            executor=executor,
            landmarks=given.landmarks,
            selection=given.sessions.selection,
            replace=given.replace,
            follow_links=given.follow_links,
            progress=lambda outcome, total: bar.advance(to_compare + total, outcome.error, outcome.rows),
            comparing=compare,
            tell=print_warnings,
        )


def _print_summary(summary: api.Summary, out: Path) -> None:
    from vislam2tag.views.run_summary import accuracy_sentence, counted_sessions

    say(
        f"{counted_sessions(summary)}, {summary.duration_s / 60:.1f} min, {summary.distance_m:.0f} m; "
        f"frames labelled: {share_text(summary.frames)}"
    )
    for table, counts in summary.readings.items():
        say(f"{table}: {sum(counts.values())} rows, labelled: {share_text(counts)}")
    for name, counts in (("findings about the site", summary.site_findings), ("findings", summary.findings)):
        if counts:
            say(f"{name}: " + ", ".join(f"{kind} {count}" for kind, count in counts.items()))
    for sentence in (*_lost_readings(summary), *(f"warning: {message}" for message in summary.lost)):
        say(sentence)
    if accuracy := accuracy_sentence(summary):
        say(accuracy)
    for found in summary.contradictions:
        say(
            f"{found.called} contradicts the other landmarks in {found.sessions} of {found.seen} sessions, by up to "
            f"{found.greatest_m:.2f} m: measure it again"
        )
    say(f"report: {shown(out / 'report.html')}")


_LOST = ("masked_addresses", "lost_sign", "levels_not_dbm")
"""After these findings readings have no address or no level."""


def _lost_readings(summary: api.Summary) -> list[str]:
    """Why most radio readings cannot be used, sentences; empty if they can."""
    from vislam2tag.common.findings import described

    rows = sum(sum(summary.readings.get(table, {}).values()) for table in ("wifi", "ble"))
    counts = {kind: summary.findings.get(kind, 0) for kind in _LOST}
    lost = {kind: count for kind, count in counts.items() if 2 * count > rows}
    return [f"warning: {kind} {count}: {' '.join(described(kind))}" for kind, count in lost.items()]


def _unlabelled(summary: api.Summary) -> list[str]:
    """Which kinds of rows have no label at all, sentences; a diagnosis of the landmarks does not show that."""
    from vislam2tag.core.status import labelled_share

    wifi = summary.readings.get("wifi", {})
    see = "see the warnings above" if summary.lost else "see the findings in the report"
    kinds = {"frames": summary.frames, "rows of wifi": wifi}
    unlabelled = [
        f"warning: none of {sum(counts.values())} {kind} is labelled: {see}"
        for kind, counts in kinds.items()
        if labelled_share(counts) == 0
    ]
    return [
        *unlabelled,
        *([f"warning: no row of wifi was read: {see}"] if summary.lost and not sum(wifi.values()) else []),
    ]


def share_text(counts: dict[str, int]) -> str:
    """The share of labelled frames or rows, and the number of those with an uncertain position."""
    from vislam2tag.core.status import labelled_share

    share = labelled_share(counts)
    if share is None:
        return "none"
    uncertain = counts.get(api.Status.UNCERTAIN.label, 0)
    return f"{100 * share:.1f} %" + (f" ({uncertain} uncertain)" if uncertain else "")


_PARTS = {
    "labels/sessions": "labels",
    "diagnosis.json": "a diagnosis",
    "check/check.json": "a check",
    "dataset/dataset.json": "a data set",
    "index.html": "the page",
}


@dataclass(frozen=True, kw_only=True)
class RunOptions:
    """Arguments and options of ``vislam2tag run``."""

    survey: SurveyFolder
    out: Path = option(..., "Output folder: new, empty or from an earlier run.")
    landmarks: LandmarkFile = None
    strategy: str | None = option(None, STRATEGY_HELP, sets=("strategy",))
    follow_links: FollowLinks = False
    jobs: Jobs = ALL_CORES
    json: AsJson = False
    config: ConfigFile = None
    use_planned: bool | None = setting("survey.use_planned")


@command
def run_command(given: RunOptions) -> None:
    """Label a survey, check the labels and build a data set, with one page that links everything.

    Writes OUT/labels (see process), OUT/diagnosis.json and OUT/conflicts.html (see diagnose), OUT/check (see check),
    OUT/dataset (see dataset) and OUT/index.html. Run it again after a correction or a new walk. Finished parts that did
    not change are kept. Each step is also a command with more options.

    Exit code: 0 all sessions mapped (see the report for findings), 1 a session cannot be read or mapped, or landmark
    ids or corrections.toml do not match, 2 wrong usage or not a survey, 3 no frame has a position, 130 interrupted.

    \b
    Examples:
      vislam2tag run survey --out out
      vislam2tag run survey --out out --config settings.toml
      vislam2tag run survey --out out --strategy NAME.py:CLASS
    """
    settings = settings_from(given, given.survey)
    with interrupted_with(lambda: contents_there(given.out, _PARTS)), session_bar("sessions") as bar:
        made = api.run_survey(
            given.survey,
            given.out,
            settings,
            landmarks=given.landmarks,
            follow_links=given.follow_links,
            jobs=given.jobs,
            progress=lambda step, total: bar.step(f"sessions: {step[0]}", total, step[1]),
            tell=print_warnings,
        )
    answer(
        made,
        given.json,
        lambda: _print_run(made, given.survey, given.out),
        failed=made.labels.problem is not None,
        nothing=not made.labels.frames_placed,
    )


def _print_run(made: api.SurveyRun, survey: Path, out: Path) -> None:
    from vislam2tag.views.run_summary import counted_sessions

    labelled = share_text(made.labels.frames)
    say(f"{counted_sessions(made.labels)}; frames labelled: {labelled}")
    for sentence in (*_lost_readings(made.labels), *(f"warning: {message}" for message in made.labels.lost)):
        say(sentence)
    for floor in made.check.floors:
        say(f"floor {floor.number}: expected mean error {floor.expected_m:.2f} m")
    for bad in made.check.bad_landmarks:
        where = f" ({bad.room})" if bad.room else ""
        say(f"floor {bad.floor}: landmark {bad.landmark}{where} is {bad.size_m:.2f} m from its stated position")
    for fault in made.faults:
        say(f"wrong: {fault}")
    for sentence in _unlabelled(made.labels):
        say(sentence)
    if made.kept:
        say(f"unchanged and kept: {', '.join(made.kept)}")
    say(f"page: {out / 'index.html'}")
    next_step(_after_run(made), survey=survey, dataset=out / "dataset")


def _after_run(made: api.SurveyRun) -> str:
    """Name of the next step."""
    if made.faults:
        return "run, faults" if made.correctable else "run, by hand"
    lost = _lost_readings(made.labels) or _unlabelled(made.labels)
    return "process, failed" if made.labels.problem is not None or lost else "run"


@command
def demo_command(
    *,
    out: Path = argument("New folder, or the folder of an earlier demo.", Path("vislam2tag-demo")),
    seed: int = option(1, "Seed of the generated building and walks."),
    jobs: Jobs = ALL_CORES,
    json: AsJson = False,
) -> None:
    """Simulate a survey, label it with each strategy, and compare the labels with the true positions.

    Writes OUT/survey (raw files as a phone writes them), OUT/STRATEGY (labels and report.html of each strategy) and
    OUT/scores.csv.

    Exit code: 0 written, 2 wrong usage, or OUT contains other files, 130 interrupted.

    \b
    Examples:
      vislam2tag demo
      vislam2tag demo somewhere --seed 7
    """
    scores = api.demo(out, jobs=jobs, seed=seed, say=lambda line: say(line, err=json))
    answer(scores, json, lambda: _print_demo(scores, out))


def _print_demo(scores: dict[str, api.ErrorSummary], out: Path) -> None:
    from vislam2tag.pipeline.demo import SURVEY

    visible_console().print(_table(scores))
    say(f"simulated survey: {out / SURVEY}")
    say(f"report, open it in a browser: {out / Settings().strategy / 'report.html'}")
    next_step("demo", survey=out / SURVEY)


def _table(scores: dict[str, api.ErrorSummary]) -> Table:
    from rich.table import Table

    table = Table(title="Label error at every camera frame (each walk counts once)")
    table.add_column("strategy")
    for column in ("mean", "median", "p75", "p95", "max"):
        table.add_column(f"{column} [m]", justify="right")
    table.add_column("labelled", justify="right")
    for strategy, errors in scores.items():
        figures = (errors.mean_m, errors.median_m, errors.p75_m, errors.p95_m, errors.max_m)
        table.add_row(strategy, *(f"{figure:.2f}" for figure in figures), f"{100 * errors.labelled_share:.0f} %")
    return table
