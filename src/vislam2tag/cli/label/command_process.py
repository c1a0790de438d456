"""``vislam2tag process``."""

from __future__ import annotations

import os
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from vislam2tag.cli.executors import ClusterFile, ExecutorName, SchedulerAddress, WhereSessionsRun, executor_of
from vislam2tag.cli.interrupted import interrupted_with, labels_there
from vislam2tag.cli.next_steps import next_step
from vislam2tag.cli.options import (
    ALL_CORES,
    AsJson,
    Devices,
    DryRun,
    Floors,
    FollowLinks,
    Jobs,
    LandmarkFile,
    Replace,
    SurveyFolder,
    selection_of,
)
from vislam2tag.cli.progress import session_bar
from vislam2tag.cli.settings_options import ConfigFile, setting, settings_of
from vislam2tag.cli.tables import print_warnings
from vislam2tag.cli.terminal import say, say_json
from vislam2tag.common.files.store import shown
from vislam2tag.common.garbage import keep_freed_memory
from vislam2tag.common.plugins import STRATEGIES
from vislam2tag.labeling.settings import LabelRule
from vislam2tag.settings import Settings

if TYPE_CHECKING:
    from vislam2tag.labeling.results import Summary

DEFAULT_STRATEGY = Settings().strategy
HELP = """
Map every session of a survey and label every reading.

Writes OUT/trajectory, OUT/wifi and OUT/sensors (one Parquet file a session), OUT/sessions (one JSON a session),
OUT/summary.json, OUT/run.json (settings and versions) and OUT/report.html. Sessions that an earlier run into the
same OUT finished, and that have not changed since, are not repeated.

Exit code: 0 all right (findings and faults are in the report), 1 at least one session cannot be read or mapped, no
frame has a position, or landmark ids do not match, 2 wrong usage, not a survey, or OUT cannot be written, 130
interrupted. Whatever ended a run early, the same command goes on.

\b
Examples:
  vislam2tag process survey --out labels
  vislam2tag process survey --out labels --floor 1 --floor 4 --device LG \\
      --strategy local
  vislam2tag process survey --out labels --max-sigma-m 0.3 \\
      --landmarks completed.csv
  vislam2tag process survey --out labels --together
  vislam2tag process survey --out paper --label-rule next-frame \\
      --max-step-m 2
  vislam2tag process survey --out labels --dry-run
  vislam2tag process s3://walks/hospital --out s3://labels/hospital \\
      --executor dask --scheduler tcp://10.0.0.5:8786
"""


def register(app: typer.Typer) -> None:
    """Add the command to the application."""
    app.command("process", help=HELP)(_process)


def _process(
    survey: SurveyFolder,
    out: Annotated[Path, typer.Option(help="Output folder: new, empty or from an earlier run.")],
    landmarks: LandmarkFile = None,
    strategy: Annotated[
        str | None,
        typer.Option(help=f"Mapping strategy: {', '.join(STRATEGIES.names())}.  [default: {DEFAULT_STRATEGY}]"),
    ] = None,
    floor: Floors = None,
    device: Devices = None,
    replace: Replace = False,
    follow_links: FollowLinks = False,
    dry_run: DryRun = False,
    jobs: Jobs = ALL_CORES,
    executor: WhereSessionsRun = ExecutorName.LOCAL,
    scheduler: SchedulerAddress = None,
    cluster: ClusterFile = None,
    json: AsJson = False,
    config: ConfigFile = None,
    label_rule: Annotated[LabelRule | None, setting("labels.rule")] = None,
    max_gap_s: Annotated[float | None, setting("labels.max_gap_s")] = None,
    visit_radius_m: Annotated[float | None, setting("mapping.visit_radius_m")] = None,
    max_sigma_m: Annotated[float | None, setting("labels.max_sigma_m")] = None,
    max_step_m: Annotated[float | None, setting("mapping.max_step_m")] = None,
    together: Annotated[bool | None, setting("together")] = None,
    use_planned: Annotated[bool | None, setting("survey.use_planned")] = None,
    allow_for_pose_lag: Annotated[bool | None, setting("mapping.smoother.allow_for_pose_lag")] = None,
) -> None:
    keep_freed_memory()
    if jobs > 1:  # threads of this process would compete with its workers, which have one each
        os.environ.setdefault("POLARS_MAX_THREADS", "1")
    given = {
        "strategy": strategy,
        "labels.rule": label_rule,
        "labels.max_gap_s": max_gap_s,
        "mapping.visit_radius_m": visit_radius_m,
        "labels.max_sigma_m": max_sigma_m,
        "mapping.max_step_m": max_step_m,
        "together": together,
        "survey.use_planned": use_planned,
        "mapping.smoother.allow_for_pose_lag": allow_for_pose_lag,
    }
    settings = settings_of(config, given, survey)
    options = {"landmarks": landmarks, "selection": selection_of(floor, device), "replace": replace}
    with executor_of(executor, scheduler, cluster, jobs) as run_all:
        if dry_run:
            _print_dry_run(survey, out, settings, json, executor=run_all, **options)
            return
        on_cluster = executor is ExecutorName.DASK
        summary = _process_with_progress(
            survey, out, settings, lines=on_cluster, executor=run_all, follow_links=follow_links, **options
        )
    code = 0 if summary.problem is None else 1
    if json:
        say_json(summary)
        raise typer.Exit(code)
    _print_summary(summary, out)
    for fault in summary.faults:
        say(f"wrong: {fault}")
    say(f"the survey by its walks: {summary.judgement.sentence}")
    next_step(_after(summary), survey=survey, out=out)
    raise typer.Exit(code)


def _after(summary: Summary) -> str:
    """Name what to go on with."""
    from vislam2tag.report.run_page.verdict import joining_helps

    found = {
        "process, unsure": joining_helps(summary) and not summary.faults and summary.frames_placed > 0,
        "process, failed": summary.problem is not None,
        "process, faults": bool(summary.faults),
    }
    return next((name for name, so in found.items() if so), "process")


def _print_dry_run(survey: Path, out: Path, settings: Settings, json: bool, **options: Any) -> None:
    from vislam2tag.pipeline.labels.process import dry_run

    found = dry_run(survey, out, settings, **options)
    if json:
        say_json(found)
        raise typer.Exit(0 if found else 1)
    for one in found:
        if one.reasons:
            say(f"{one.session}: {', '.join(reason.value for reason in one.reasons)}")
    if not found:
        say("would process nothing: the survey has no session that is not excluded")
        next_step("process, failed", survey=survey)
        raise typer.Exit(1)
    count = sum(bool(one.reasons) for one in found)
    say(f"would process {count} of {len(found)} sessions; the others are done and unchanged")
    next_step("process, dry run", survey=survey, out=out)


def _process_with_progress(survey: Path, out: Path, settings: Settings, *, lines: bool, **options: Any) -> Summary:
    from vislam2tag.pipeline.labels.process import process

    compared, to_compare, sessions = 0, 0, 0

    def compare(_: object, total: int) -> None:
        nonlocal compared, to_compare, sessions
        compared, to_compare, sessions = compared + 1, total, sessions or total
        bar.advance(to_compare + sessions, None)

    with interrupted_with(lambda: labels_there(out)), session_bar("sessions", lines=lines) as bar:
        return process(
            survey,
            out,
            settings,
            progress=lambda outcome, total: bar.advance(to_compare + total, outcome.error, outcome.rows),
            comparing=compare,
            tell=print_warnings,
            **options,
        )


def _print_summary(summary: Summary, out: Path) -> None:
    from vislam2tag.report.run_page.verdict import accuracy_sentence

    say(
        f"{summary.sessions} sessions ({summary.failed} failed), {summary.duration_s / 60:.1f} min, "
        f"{summary.distance_m:.0f} m; frames labelled: {share_text(summary.frames)}"
    )
    for table, counts in summary.readings.items():
        say(f"{table}: {sum(counts.values())} rows, labelled: {share_text(counts)}")
    for name, counts in (("findings about the site", summary.site_findings), ("findings", summary.findings)):
        if counts:
            say(f"{name}: " + ", ".join(f"{kind} {count}" for kind, count in counts.items()))
    if accuracy := accuracy_sentence(summary):
        say(accuracy)
    for found in summary.contradictions:
        say(
            f"{found.called} contradicts the rest in {found.sessions} of {found.seen} sessions, by up to "
            f"{found.greatest_m:.2f} m: measure it again"
        )
    say(f"report: {shown(out / 'report.html')}")


def share_text(counts: dict[str, int]) -> str:
    """The share of frames or rows that are labelled, and how many more have an uncertain position."""
    from vislam2tag.core.status import Status, labelled_share

    share = labelled_share(counts)
    if share is None:
        return "none"
    uncertain = counts.get(Status.UNCERTAIN.label, 0)
    return f"{100 * share:.1f} %" + (f" ({uncertain} uncertain)" if uncertain else "")
