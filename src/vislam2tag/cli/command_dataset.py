"""``vislam2tag dataset``."""

from __future__ import annotations

import re
from contextlib import ExitStack
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from vislam2tag.cli.next_steps import next_step
from vislam2tag.cli.options import (
    ALL_CORES,
    AsJson,
    FollowLinks,
    HashBssid,
    IncludeNomap,
    Jobs,
    NoSsid,
    Replace,
    privacy_of,
)
from vislam2tag.cli.progress import SessionBar, outputs_of_interrupted, session_bar
from vislam2tag.cli.settings_options import ConfigFile, settings_of
from vislam2tag.cli.tables import print_warnings
from vislam2tag.cli.terminal import say, say_json
from vislam2tag.common.errors import UsageError

if TYPE_CHECKING:
    from vislam2tag.dataset.model import Dataset
    from vislam2tag.dataset.settings import DatasetSettings
    from vislam2tag.dataset.statistics_record import FieldWork
    from vislam2tag.pipeline.datasets.build import BuildOptions, SessionStep


HELP = """
Build a data set: fingerprints, readings, access points, walks, splits, statistics and a card that describes it.

Give a survey (it is processed first) or what `process` wrote; several of either make one data set. One fingerprint a
scan: the mean of its readings' positions, weighted by their certainty. docs/reference/datasets.md tells what each
column is.

Exit code: 0 all right (what was odd is in the manifest and the report), 1 at least one walk has no label, or no
fingerprint has a position, 2 wrong usage, a source cannot be used, or DS cannot be written, 130 interrupted.

\b
Examples:
  vislam2tag dataset survey --out fingerprints
  vislam2tag dataset labels --out fingerprints --survey survey \\
      --max-sigma-m 0.3
  vislam2tag dataset labels --out short --window 1s
  vislam2tag dataset main-building annex --building main --building annex \\
      --out campus
"""
_UNITS_S = {"ms": 1e-3, "s": 1.0, "min": 60.0}
_LEAST_S = 1e-3
_DURATION = re.compile(r"\s*(\d+(?:\.\d+)?)\s*(ms|s|min)\s*")


def register(app: typer.Typer) -> None:
    """Add the command to the application."""
    app.command("dataset", help=HELP)(_dataset)


def seconds_of(text: str, option: str) -> float:
    """Read a duration such as ``500ms``, ``2s`` or ``1.5 min``; raises UsageError for anything else."""
    match = _DURATION.fullmatch(text)
    seconds = float(match.group(1)) * _UNITS_S[match.group(2)] if match else 0.0
    if seconds < _LEAST_S:
        raise UsageError(
            f"{option} {text}: give a time of a millisecond or more with its unit, such as 500ms, 2s or 1.5min"
        )
    return seconds


def _dataset(
    sources: Annotated[list[Path], typer.Argument(metavar="SOURCE...", help="Surveys, or output folders of process.")],
    out: Annotated[Path, typer.Option(help="Folder for the data set: new, empty or an earlier data set.")],
    name: Annotated[str | None, typer.Option(help="Name of the data set; else that of its surveys.")] = None,
    window: Annotated[
        str | None,
        typer.Option(metavar="DURATION", help="Group Wi-Fi readings by windows of time, such as 1s, not by scan."),
    ] = None,
    ble_window: Annotated[
        str | None,
        typer.Option(metavar="DURATION", help="Group BLE readings by windows of this length.  [default: 1s]"),
    ] = None,
    magnetic_window: Annotated[
        str | None,
        typer.Option(
            metavar="DURATION", help="Average magnetic readings over windows of this length.  [default: 500ms]"
        ),
    ] = None,
    imu_window: Annotated[
        str | None,
        typer.Option(metavar="DURATION", help="Cut inertial readings into windows of this length.  [default: 1s]"),
    ] = None,
    json: AsJson = False,
    config: ConfigFile = None,
    max_sigma_m: Annotated[
        float | None,
        typer.Option(
            metavar="METRES",
            min=0.0001,
            help="Fingerprints less sure than this are marked uncertain and keep their position; else as process did.",
        ),
    ] = None,
    building: Annotated[
        list[str] | None, typer.Option(help="Name of a source's building; repeatable, one for each source.")
    ] = None,
    survey: Annotated[
        list[Path] | None,
        typer.Option(help="The survey that a source was made of, for its plans; repeatable, in order of the sources."),
    ] = None,
    radios: Annotated[
        bool, typer.Option("--radios", help="Make one reading of all networks that one radio sends.")
    ] = False,
    include_nomap: IncludeNomap = False,
    hash_bssid: HashBssid = None,
    no_ssid: NoSsid = False,
    describe: Annotated[
        Path | None,
        typer.Option(metavar="FILE", help="A dataset.toml with title, creators, licence; each data set holds one."),
    ] = None,
    people: Annotated[
        int | None, typer.Option(min=1, help="How many people made the survey (with --hours), for what it cost.")
    ] = None,
    hours: Annotated[
        float | None, typer.Option(min=0.01, help="Hours that the survey took, setting up included.")
    ] = None,
    labels: Annotated[
        Path | None, typer.Option(help="Keep in this folder what process writes, if the source is a survey.")
    ] = None,
    replace: Replace = False,
    follow_links: FollowLinks = False,
    jobs: Jobs = ALL_CORES,
) -> None:
    from vislam2tag.dataset.description import read_description
    from vislam2tag.pipeline.datasets.build import BuildOptions
    from vislam2tag.pipeline.datasets.sources import FAILED

    imu_s = _given_seconds(imu_window, "--imu-window")
    settings = settings_of(
        config,
        {
            "dataset.wifi_window_s": _given_seconds(window, "--window"),
            "dataset.ble_window_s": _given_seconds(ble_window, "--ble-window"),
            "dataset.magnetic_window_s": _given_seconds(magnetic_window, "--magnetic-window"),
            "dataset.imu.length_s": imu_s,
            "dataset.imu.step_s": imu_s,  # one window after the other
        },
        sources[0],
    )
    options = BuildOptions(
        name=name,
        buildings=tuple(building or ()),
        surveys=tuple(survey or ()),
        labels=labels,
        labelling=settings,
        max_sigma_m=max_sigma_m,
        merge_radios=radios,
        privacy=privacy_of(include_nomap, hash_bssid, no_ssid),
        description=None if describe is None else read_description(describe),
        field_work=_field_work(people, hours),
        walkable=settings.walkable,
        replace=replace,
        follow_links=follow_links,
    )
    with outputs_of_interrupted(out, labels):
        dataset = _built(sources, out, settings.dataset, options, jobs)
    if json:
        say_json(dataset.info)
    else:
        _print(dataset, out)
    odd = any(finding.kind == FAILED for finding in dataset.info.findings)
    raise typer.Exit(1 if odd or not dataset.labelled else 0)


def _field_work(people: int | None, hours: float | None) -> FieldWork | None:
    """What the survey took; raises UsageError for people without hours, and for numbers that cannot be."""
    from pydantic import ValidationError

    from vislam2tag.dataset.statistics_record import FieldWork

    if hours is None and people is not None:
        raise UsageError(f"--people {people}: give --hours, too, for what the survey cost")
    try:
        return None if hours is None else FieldWork(people=people or 1, hours=hours)
    except ValidationError as error:
        raise UsageError(f"--people {people or 1} --hours {hours:g}: no survey took so much; correct it") from error


def _given_seconds(text: str | None, option: str) -> float | None:
    return None if text is None else seconds_of(text, option)


def _built(sources: list[Path], out: Path, settings: DatasetSettings, options: BuildOptions, jobs: int) -> Dataset:
    from vislam2tag.pipeline.datasets.build import build_dataset

    with ExitStack() as stack:
        bars: dict[str, SessionBar] = {}

        def advance(step: SessionStep, total: int) -> None:
            if step.stage not in bars:
                stack.close()  # one bar at a time
                bars[step.stage] = stack.enter_context(session_bar(f"walks: {step.stage}"))
            bars[step.stage].advance(total, step.error)

        return build_dataset(sources, out, settings, options, jobs=jobs, progress=advance, tell=print_warnings)


def _print(dataset: Dataset, out: Path) -> None:
    from vislam2tag.pipeline.datasets.finish import PAGE_FILE

    info = dataset.info
    rows = ", ".join(f"{account.rows} {table.replace('_', ' ')}" for table, account in info.tables.items())
    say(f"{out}: {rows}")
    for finding in info.findings:
        say(f"{finding.kind}: {finding.count} {finding.message}")
    say(f"page: {out / PAGE_FILE}")
    next_step("dataset" if dataset.labelled else "no position", dataset=out, page=out / PAGE_FILE)
