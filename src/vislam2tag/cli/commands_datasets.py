"""Commands that build a data set and show its content: ``dataset``, ``figures`` and ``radio-maps``."""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path

from vislam2tag import api
from vislam2tag.cli.next_steps import next_step
from vislam2tag.cli.options import (
    ALL_CORES,
    AsJson,
    ConfigFile,
    Description,
    FollowLinks,
    Jobs,
    PrivacyOptions,
    Replace,
    setting,
    settings_from,
    settings_of,
)
from vislam2tag.cli.progress import interrupted_with, outputs_of_interrupted, session_bar
from vislam2tag.cli.records import argument, command, option
from vislam2tag.cli.tables import print_table, print_warnings
from vislam2tag.cli.terminal import answer, say
from vislam2tag.common.errors import UsageError

_UNITS_S = {"ms": 1e-3, "s": 1.0, "min": 60.0}
_LEAST_S = 1e-3
_DURATION = re.compile(r"\s*(\d+(?:\.\d+)?)\s*(ms|s|min)\s*")


def seconds_of(text: str, option: str) -> float:
    """Read a duration such as ``500ms``, ``2s`` or ``1.5 min``; raises UsageError for anything else."""
    match = _DURATION.fullmatch(text)
    seconds = float(match.group(1)) * _UNITS_S[match.group(2)] if match else 0.0
    if seconds < _LEAST_S:
        raise UsageError(f"{option} {text}: expected at least 1 ms with a unit, such as 500ms, 2s or 1.5min")
    return seconds


@dataclass(frozen=True, kw_only=True)
class DatasetOptions:
    """Arguments and options of ``vislam2tag dataset``."""

    sources: tuple[Path, ...] = argument("Surveys, or output folders of process.", metavar="SOURCE...")
    out: Path = option(..., "Folder for the data set: new, empty or an earlier data set.")
    name: str | None = option(None, "Name of the data set.  [default: name of the survey]")
    window: float | None = option(
        None,
        "Group Wi-Fi readings by time windows such as 1s instead of by scan.",
        metavar="DURATION",
        parse=seconds_of,
        sets=("dataset.wifi_window_s",),
        hidden=True,
    )
    ble_window: float | None = option(
        None,
        "Group BLE readings by windows of this length.  [default: 1s]",
        metavar="DURATION",
        parse=seconds_of,
        sets=("dataset.ble_window_s",),
        hidden=True,
    )
    ble_with_wifi: bool | None = setting("dataset.ble_with_wifi")
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
        "Mark fingerprints with a greater sigma as uncertain.  [default: as process did]",
        metavar="METRES",
        least=0.0001,
    )
    building: tuple[str, ...] = option((), "Building name of a source; one for each.  [default: as in site.toml]")
    survey: tuple[Path, ...] = option((), "Survey of a source, for its plans; repeatable, in the order of the sources.")
    radios: bool = option(False, "Merge the readings of all networks of one radio.")
    hiding: PrivacyOptions
    describe: Description = None
    people: int | None = option(None, "Number of people in the survey (with --hours), for its cost.", least=1)
    hours: float | None = option(None, "Duration of the survey in hours, including preparation.", least=0.01)
    labels: Path | None = option(None, "Folder for the output of process, if the source is a survey.")
    replace: Replace = False
    follow_links: FollowLinks = False
    jobs: Jobs = ALL_CORES


@command
def dataset_command(given: DatasetOptions) -> None:
    """Build a data set: fingerprints, readings, access points, walks, splits, statistics and a data card.

    Pass a survey, which is processed first, or the output of `process`. Several sources make one data set. A
    fingerprint is one scan. Its position is the mean of its readings' positions, weighted by their certainty.
    docs/reference/datasets.md describes all columns.

    Exit code: 0 built (see the report for findings), 1 a walk has no label, 2 wrong usage or an unusable source, 3 no
    fingerprint has a position, 130 interrupted.

    \b
    Examples:
      vislam2tag dataset survey --out fingerprints
      vislam2tag dataset labels --out fingerprints --survey survey \\
          --max-sigma-m 0.3
      vislam2tag dataset survey --ble-with-wifi --out fingerprints
      vislam2tag dataset main-building annex --building main --building annex \\
          --out campus
    """
    from vislam2tag.datasets.description import read_description
    from vislam2tag.pipeline.datasets.sources import FAILED

    settings = settings_from(given, given.sources[0])
    options = api.BuildOptions(
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
    answer(
        dataset.info, given.json, lambda: _print_dataset(dataset, given.out), failed=odd, nothing=not dataset.labelled
    )


def _field_work(people: int | None, hours: float | None) -> api.FieldWork | None:
    """The effort of the survey; raises UsageError for people without hours, or impossible numbers."""
    from pydantic import ValidationError

    if hours is None and people is not None:
        raise UsageError(f"--people {people}: also pass --hours")
    try:
        return None if hours is None else api.FieldWork(people=people or 1, hours=hours)
    except ValidationError as error:
        raise UsageError(
            f"--people {people or 1} --hours {hours:g}: this is too much for a survey; correct it"
        ) from error


def _built(given: DatasetOptions, settings: api.DatasetSettings, options: api.BuildOptions) -> api.Dataset:
    with session_bar("walks") as bar:
        return api.build_dataset(
            given.sources,
            given.out,
            settings,
            options,
            jobs=given.jobs,
            progress=lambda step, total: bar.step(f"walks: {step.stage}", total, step.error),
            tell=print_warnings,
        )


def _print_dataset(dataset: api.Dataset, out: Path) -> None:
    from vislam2tag.pipeline.datasets.finish import PAGE_FILE

    info = dataset.info
    rows = ", ".join(f"{account.rows} {table.replace('_', ' ')}" for table, account in info.tables.items())
    say(f"{out}: {rows}")
    for finding in info.findings:
        say(f"{finding.kind}: {finding.count} {finding.message}")
    say(f"page: {out / PAGE_FILE}")
    next_step("dataset" if dataset.labelled else "no position", dataset=out, page=out / PAGE_FILE)


_START = re.compile(r"(?:(.*)/)?(-?\d+):(-?\d+(?:\.\d+)?),(-?\d+(?:\.\d+)?)")


def start_of(text: str) -> tuple[api.Storey, tuple[float, float]]:
    """Read ``FLOOR:X,Y`` or ``BUILDING/FLOOR:X,Y``, metres; raises UsageError for anything else."""
    match = _START.fullmatch(text)
    if match is None:
        raise UsageError(f"--start {text}: expected FLOOR:X,Y or BUILDING/FLOOR:X,Y in metres, such as 1:12.5,3")
    building, floor, x, y = match.groups()
    return api.Storey(building or "", int(floor)), (float(x), float(y))


@command
def figures_command(
    *,
    dataset: Path = argument("Data set.", metavar="DS"),
    out: Path = option(..., "Output folder: new, empty or from an earlier run of this command."),
    cell_m: float | None = setting("coverage.cell_m", hidden=True),
    radius_m: float | None = setting("coverage.radius_m", hidden=True),
    follow_links: FollowLinks = False,
    json: AsJson = False,
    config: ConfigFile = None,
    start: tuple[str, ...] = option(
        (), "Start of the walk that fills a floor's gaps; repeatable.  [default: anywhere]", metavar="FLOOR:X,Y"
    ),
) -> None:
    """Make print figures of a data set, the paper's Table III, and a walk that fills its gaps.

    Writes SVG and PDF figures: fingerprints by device and floor (the paper's Figure 8), coverage on the plans, access
    points of a fingerprint, RSSI by device, sigma, and fingerprints over time. Table III is written as CSV, Markdown
    and LaTeX. coverage.json contains the coverage of each floor and the shortest walk that fills its gaps.

    Exit code: 0 written, 2 wrong usage or no data set, 3 no fingerprint has a position, 130 interrupted.

    \b
    Examples:
      vislam2tag figures fingerprints --out figures
      vislam2tag figures fingerprints --out figures --start 1:12.5,3 \\
          --start annex/0:4,4
    """
    starts = dict(start_of(text) for text in start)
    settings = settings_of(config, {"coverage.cell_m": cell_m, "coverage.radius_m": radius_m}).coverage
    with session_bar("figures") as bar:
        made = api.figures(dataset, out, settings, starts, bar.count, follow_links=follow_links)
    answer(made, json, lambda: _print_figures(made, out, dataset), nothing=not made.floors)


def _print_figures(made: api.CoverageRecord, out: Path, dataset: Path) -> None:
    from vislam2tag.pipeline.datasets.figures import COVERAGE_FILE, storey_text

    rows = []
    for floor in made.floors:
        length_m = sum(walk.length_m for walk in floor.walks)
        minutes = sum(walk.minutes for walk in floor.walks)
        walk = (f"{length_m:.0f} m", f"{minutes:.1f} min") if floor.walks else ("-", "-")
        covered = "-" if floor.share is None else f"{100 * floor.share:.0f} %"
        storey = storey_text(api.Storey(floor.building, floor.floor))
        rows.append((storey, str(floor.fingerprints), f"{floor.walkable_m2:.0f} m²", covered, *walk))
    heads = ("fingerprints", "walkable", "covered", "walk to fill the gaps", "duration")
    print_table("Coverage", ("floor",), heads, rows)
    say(f"figures, Table III and {COVERAGE_FILE}: {out}")
    if made.floors:
        next_step("figures", dataset=dataset)
    else:
        say("coverage could not be judged, because no fingerprint has a position")
        next_step("no position", page=dataset / "report.html")


_UNITS_M = {"m": 1.0, "cm": 0.01}
_LENGTH = re.compile(r"\s*(\d+(?:\.\d+)?)\s*(m|cm)\s*")


def metres_of(text: str, option_name: str) -> float:
    """Read a length such as ``1m`` or ``50cm``; raises UsageError for anything else."""
    match = _LENGTH.fullmatch(text)
    if match is None or float(match.group(1)) == 0:
        raise UsageError(f"{option_name} {text}: expected a length above zero with a unit, such as 1m or 50cm")
    return float(match.group(1)) * _UNITS_M[match.group(2)]


@dataclass(frozen=True, kw_only=True)
class RadioMapsOptions:
    """Arguments and options of ``vislam2tag radio-maps``."""

    dataset: Path = argument("Data set (see vislam2tag dataset).")
    out: Path = option(..., "Output: a new or empty folder, or one from an earlier run.")
    ap: tuple[str, ...] = option((), "Only this access point; repeatable.", "--ap", metavar="BSSID")
    cell: float | None = option(
        None,
        "Side of a cell, such as 1m or 50cm.  [default: 1m]",
        metavar="LENGTH",
        parse=metres_of,
        sets=("radio_maps.cell_m",),
        hidden=True,
    )
    reach: float | None = option(
        None,
        "Leave cells empty that are farther than this from every fingerprint.  [default: 3m]",
        metavar="LENGTH",
        parse=metres_of,
        sets=("radio_maps.reach_m",),
        hidden=True,
    )
    most: int | None = setting("radio_maps.most", hidden=True)
    follow_links: FollowLinks = False
    json: AsJson = False
    config: ConfigFile = None


@command
def radio_maps_command(given: RadioMapsOptions) -> None:
    """Map the signal strength of each access point over each floor.

    Each map shows the mean RSSI, its spread, and how often the access point is received. Maps are smoothed by a
    Gaussian process, without the offsets of the phones, and come with the error on left-out readings. Writes
    OUT/radio_maps.json, index.html, a NumPy file for each floor, a GeoTIFF for each access point, and figures.
    docs/explanation/positioning.md explains the layers.

    Exit code: 0 written, 2 wrong usage, no data set or nothing to map, 130 interrupted.

    \b
    Examples:
      vislam2tag radio-maps fingerprints --out maps
      vislam2tag radio-maps fingerprints --out maps --config maps.toml
      vislam2tag radio-maps fingerprints --out one --ap 0c:8d:db:f5:3c:01
    """
    settings = settings_from(given).radio_maps
    with interrupted_with(f"no radio map was written to {given.out}"), session_bar("access points") as bar:
        found = api.radio_maps(given.dataset, given.out, settings, given.ap, bar.count, follow_links=given.follow_links)
    answer(found, given.json, lambda: _print_radio_maps(found, given, settings.most))


def _print_radio_maps(found: api.RadioMapIndex, given: RadioMapsOptions, most: int) -> None:
    import numpy as np

    from vislam2tag.pipeline.datasets.radio_maps import PAGE_FILE

    rows = []
    for floor in found.floors:
        errors = [one.errors for one in floor.access_points if one.errors.rms_db is not None]
        typical = ("-", "-")
        if errors:
            within = 100 * np.median([one.within_one_deviation for one in errors])
            typical = (f"{np.median([one.rms_db for one in errors]):.1f} dB", f"{within:.0f} %")
        place = (f"{floor.building} {floor.floor}".strip(), floor.technology)
        counts = (str(len(floor.access_points)), str(floor.fingerprints), f"{floor.kernel.noise_db:.1f} dB")
        rows.append((*place, *counts, *typical))
    numbers = ("access points", "fingerprints", "noise", "median error of a map", "median share within one sigma")
    print_table("Radio maps", ("floor", "technology"), numbers, rows)
    if not given.ap and any(len(floor.access_points) == most for floor in found.floors):
        say(f"at most {most} access points of each floor are mapped, the most often received ones; --most maps more")
    say(f"page: {given.out / PAGE_FILE}")
    next_step("radio-maps", dataset=given.dataset)
