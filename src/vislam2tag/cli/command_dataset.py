"""``vislam2tag dataset``."""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from vislam2tag.cli.next_steps import next_step
from vislam2tag.cli.options import (
    ALL_CORES,
    AsJson,
    Description,
    FollowLinks,
    Jobs,
    PrivacyOptions,
    Replace,
)
from vislam2tag.cli.progress import outputs_of_interrupted, session_bar
from vislam2tag.cli.records import argument, command, option
from vislam2tag.cli.settings_options import ConfigFile, settings_from
from vislam2tag.cli.tables import print_warnings
from vislam2tag.cli.terminal import answer, say
from vislam2tag.common.errors import UsageError

if TYPE_CHECKING:
    from vislam2tag.datasets.model import Dataset
    from vislam2tag.datasets.settings import DatasetSettings
    from vislam2tag.datasets.statistics_record import FieldWork
    from vislam2tag.pipeline.datasets.build import BuildOptions, SessionStep


_UNITS_S = {"ms": 1e-3, "s": 1.0, "min": 60.0}
_LEAST_S = 1e-3
_DURATION = re.compile(r"\s*(\d+(?:\.\d+)?)\s*(ms|s|min)\s*")


def seconds_of(text: str, option: str) -> float:
    """Read a duration such as ``500ms``, ``2s`` or ``1.5 min``; raises UsageError for anything else."""
    match = _DURATION.fullmatch(text)
    seconds = float(match.group(1)) * _UNITS_S[match.group(2)] if match else 0.0
    if seconds < _LEAST_S:
        raise UsageError(
            f"{option} {text}: give a time of a millisecond or more with its unit, such as 500ms, 2s or 1.5min"
        )
    return seconds


@dataclass(frozen=True, kw_only=True)
class DatasetOptions:
    """Arguments and options of ``vislam2tag dataset``."""

    sources: tuple[Path, ...] = argument("Surveys, or output folders of process.", metavar="SOURCE...")
    out: Path = option(..., "Folder for the data set: new, empty or an earlier data set.")
    name: str | None = option(None, "Name of the data set; else that of its surveys.")
    window: float | None = option(
        None,
        "Group Wi-Fi readings by windows of time, such as 1s, not by scan.",
        metavar="DURATION",
        parse=seconds_of,
        sets=("dataset.wifi_window_s",),
    )
    ble_window: float | None = option(
        None,
        "Group BLE readings by windows of this length.  [default: 1s]",
        metavar="DURATION",
        parse=seconds_of,
        sets=("dataset.ble_window_s",),
        hidden=True,
    )
    magnetic_window: float | None = option(
        None,
        "Average magnetic readings over windows of this length.  [default: 500ms]",
        metavar="DURATION",
        parse=seconds_of,
        sets=("dataset.magnetic_window_s",),
        hidden=True,
    )
    imu_window: float | None = option(
        None,
        "Cut inertial readings into windows of this length.  [default: 1s]",
        metavar="DURATION",
        parse=seconds_of,
        sets=("dataset.imu.length_s", "dataset.imu.step_s"),  # one window after the other
        hidden=True,
    )
    json: AsJson = False
    config: ConfigFile = None
    max_sigma_m: float | None = option(
        None,
        "Fingerprints less sure than this are marked uncertain and keep their position; else as process did.",
        metavar="METRES",
        least=0.0001,
    )
    building: tuple[str, ...] = option((), "Name of a source's building; repeatable, one for each source.")
    survey: tuple[Path, ...] = option(
        (), "The survey that a source was made of, for its plans; repeatable, in order of the sources."
    )
    radios: bool = option(False, "Make one reading of all networks that one radio sends.")
    hiding: PrivacyOptions
    describe: Description = None
    people: int | None = option(None, "How many people made the survey (with --hours), for what it cost.", least=1)
    hours: float | None = option(None, "Hours that the survey took, setting up included.", least=0.01)
    labels: Path | None = option(None, "Keep in this folder what process writes, if the source is a survey.")
    replace: Replace = False
    follow_links: FollowLinks = False
    jobs: Jobs = ALL_CORES


@command
def dataset_command(given: DatasetOptions) -> None:
    """Build a data set: fingerprints, readings, access points, walks, splits, statistics and a card that describes it.

    Give a survey (it is processed first) or what `process` wrote; several of either make one data set. One fingerprint
    a scan: the mean of its readings' positions, weighted by their certainty. docs/reference/datasets.md tells what each
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
    from vislam2tag.datasets.description import read_description
    from vislam2tag.pipeline.datasets.build import BuildOptions
    from vislam2tag.pipeline.datasets.sources import FAILED

    settings = settings_from(given, given.sources[0])
    options = BuildOptions(
        name=given.name,
        buildings=given.building,
        surveys=given.survey,
        labels=given.labels,
        labelling=settings,
        max_sigma_m=given.max_sigma_m,
        merge_radios=given.radios,
        privacy=given.hiding.privacy,
        description=None if given.describe is None else read_description(given.describe),
        field_work=_field_work(given.people, given.hours),
        walkable=settings.walkable,
        replace=given.replace,
        follow_links=given.follow_links,
    )
    with outputs_of_interrupted(given.out, given.labels):
        dataset = _built(given, settings.dataset, options)
    odd = any(finding.kind == FAILED for finding in dataset.info.findings)
    answer(dataset.info, given.json, lambda: _print(dataset, given.out), failed=odd or not dataset.labelled)


def _field_work(people: int | None, hours: float | None) -> FieldWork | None:
    """What the survey took; raises UsageError for people without hours, and for numbers that cannot be."""
    from pydantic import ValidationError

    from vislam2tag.datasets.statistics_record import FieldWork

    if hours is None and people is not None:
        raise UsageError(f"--people {people}: give --hours, too, for what the survey cost")
    try:
        return None if hours is None else FieldWork(people=people or 1, hours=hours)
    except ValidationError as error:
        raise UsageError(f"--people {people or 1} --hours {hours:g}: no survey took so much; correct it") from error


def _built(given: DatasetOptions, settings: DatasetSettings, options: BuildOptions) -> Dataset:
    from vislam2tag.pipeline.datasets.build import build_dataset

    with session_bar("walks") as bar:

        def advance(step: SessionStep, total: int) -> None:
            bar.enter(f"walks: {step.stage}")
            bar.advance(total, step.error)

        return build_dataset(
            given.sources, given.out, settings, options, jobs=given.jobs, progress=advance, tell=print_warnings
        )


def _print(dataset: Dataset, out: Path) -> None:
    from vislam2tag.pipeline.datasets.finish import PAGE_FILE

    info = dataset.info
    rows = ", ".join(f"{account.rows} {table.replace('_', ' ')}" for table, account in info.tables.items())
    say(f"{out}: {rows}")
    for finding in info.findings:
        say(f"{finding.kind}: {finding.count} {finding.message}")
    say(f"page: {out / PAGE_FILE}")
    next_step("dataset" if dataset.labelled else "no position", dataset=out, page=out / PAGE_FILE)
