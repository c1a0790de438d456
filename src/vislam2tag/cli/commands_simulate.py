"""``vislam2tag simulate``: a raw survey with known true positions."""

from __future__ import annotations

from dataclasses import dataclass, replace
from datetime import datetime
from pathlib import Path
from typing import Annotated

import typer

from vislam2tag import api
from vislam2tag.cli.next_steps import next_step
from vislam2tag.cli.options import AsJson, ConfigFile, setting, settings_from
from vislam2tag.cli.progress import session_bar
from vislam2tag.cli.records import argument, command, option
from vislam2tag.cli.terminal import answer, say
from vislam2tag.common.errors import UsageError
from vislam2tag.settings import Settings
from vislam2tag.simulation.settings import (
    TRAP_FINDINGS,
    Climb,
    CopiedSurvey,
    FileNames,
    Locale,
    SessionLayout,
    SeverityLevel,
    SiteColumn,
)

EPILOG = f"Traps for --trap: {', '.join(TRAP_FINDINGS)}."
_IGNORED = {
    "--like": ("floors", "devices", "sessions", "minutes", "landmark_count", "later"),
    "--site": ("floors", "landmark_count"),
}
"""Parameters that an option makes useless."""


@dataclass(frozen=True, kw_only=True)
class SimulateOptions:
    """Arguments and options of ``vislam2tag simulate``."""

    out: Path = argument("New or empty folder for the survey.")
    floors: int = option(2, "Number of floors.", least=1)
    devices: int = option(2, "Number of phones.", least=1)
    sessions: int = option(2, "Walks on each floor with each phone.", least=1)
    minutes: float = option(2.0, "Length of each walk.", least=0.25, most=600)
    landmark_count: int | None = setting("simulation.building.landmarks", hidden=True)
    severity: SeverityLevel = option(SeverityLevel.DEFAULT, "Severity of tracking errors.")
    seed: int = option(0, "Seed. The same seed gives the same files.")
    locale: Locale = option(Locale.MIXED, "Decimal comma, point, or different for each phone.", hidden=True)
    trap: tuple[str, ...] = option((), "Fault to put into the raw files, see below; repeatable.")
    climb: Climb | None = option(None, "How walks change floors. Landmark ids then differ between floors.")
    pressure: bool = option(False, "Also log air pressure.")
    ble: bool = option(False, "Add BLE beacons and log them.")
    rtt: bool = option(False, "Log ranges to access points (with --format phone).")
    without_poses: bool = option(False, "Log known positions every 20 s instead of poses.")
    column: tuple[SiteColumn, ...] = option((), "Optional column of the site files; repeatable.")
    names: FileNames = option(FileNames.PUBLISHED, "File names as published or as in the paper.", hidden=True)
    layout: SessionLayout = option(
        SessionLayout.PUBLISHED, "Layout of sessions: as published, or as the phone app writes them.", "--format"
    )
    scripts: bool = option(False, "With --format phone: also write script.txt with what the phone saw.", hidden=True)
    like: CopiedSurvey | None = option(None, "Copy the paper's evaluation, with its floors, phones and walks.")
    site: Path | None = option(None, "Walk through this site instead of a generated building.", metavar="SITE")
    floor: tuple[int, ...] = option((), "With --site: only this floor; repeatable.")
    landmarks: Path | None = option(None, "With --site: use the landmarks of this file.", metavar="FILE")
    mask: Path | None = option(
        None, "With --site and one --floor: image in which green is walkable, red is not.", metavar="IMAGE"
    )
    later: Annotated[
        datetime | None,
        typer.Option(
            formats=["%Y-%m-%d"],
            metavar="DATE",
            help="Date of a later survey of the same building, such as 2022-06-01.",
        ),
    ] = None
    json: AsJson = False
    config: ConfigFile = None


@command
def simulate_command(context: typer.Context, given: SimulateOptions) -> None:
    """Simulate a raw survey, in the published layout or the phone app's.

    Each session also gets a truth.csv with its true positions, which are never used for mapping. The same options give
    the same files. With --site, the seed changes the walks but not the access points of the building. --later simulates
    a second survey of the same building, for `join`.

    Exit code: 0 written, 2 wrong usage, or OUT is not empty, 130 interrupted.

    \b
    Examples:
      vislam2tag simulate survey
      vislam2tag simulate big --floors 5 --devices 4 --sessions 4 --minutes 3 \\
          --seed 7
      vislam2tag simulate paper --like paper
      vislam2tag simulate faulty --severity none --trap stale_wifi \\
          --trap frame_gap
      vislam2tag simulate app --format phone --pressure
      vislam2tag simulate storeys --floors 3 --climb mixed --pressure \\
          --column elevation --column z
      vislam2tag simulate again --seed 7 --later 2022-06-01
      vislam2tag simulate trial --site building --floor 4 \\
          --landmarks plan/landmarks.csv
    """
    from vislam2tag.simulation.traps import check_traps

    if given.scripts and given.layout is not SessionLayout.PHONE:
        raise UsageError("--scripts: needs --format phone")
    traps = check_traps(given.trap)
    _refuse_contradictions(given)
    _refuse_ignored(context, given)
    settings = settings_from(given)
    if given.site is not None:
        scenario = _on_site(given, given.site, settings)
    elif given.like is CopiedSurvey.PAPER:
        scenario = _like_the_paper(given)
    else:
        scenario = _regular(given, settings)
    options = api.WritingOptions(
        given.locale,
        given.names is FileNames.PAPER,
        traps,
        frozenset(given.column),
        given.layout,
        given.without_poses,
        given.scripts,
    )
    with session_bar("sessions") as bar:
        api.simulate(scenario, given.out, options, bar.count)
    made = {"survey": given.out, "seed": given.seed, "sessions": [session.key for session in scenario.sessions]}
    answer(made, given.json, lambda: _print(scenario, given.out))


def _refuse_contradictions(given: SimulateOptions) -> None:
    """Raise UsageError for options that do not go together."""
    if given.climb is not None and (given.like is not None or given.site is not None or given.floors < 2):
        raise UsageError("--climb: needs --floors 2 or more and a survey of its own, without --like and --site")
    if given.site is not None and given.like is not None:
        raise UsageError("--site and --like: use only one of the two")


def _refuse_ignored(context: typer.Context, given: SimulateOptions) -> None:
    """Raise UsageError for options that would be ignored beside others."""
    for option_name, value in (("--like", given.like), ("--site", given.site)):
        for name in _IGNORED[option_name] if value is not None else ():
            source = context.get_parameter_source(name)
            if source is not None and source.name == "COMMANDLINE":
                floors = (option_name, name) == ("--site", "floors")
                instead = " (choose floors of the site with --floor)" if floors else ""
                typed = name.replace("_", "-")
                raise UsageError(f"--{typed}: has no effect with {option_name}; remove one of the two{instead}")
    if given.site is None and (given.floor or given.landmarks or given.mask):
        raise UsageError("--floor, --landmarks and --mask: need --site")
    if given.mask is not None and len(given.floor) != 1:
        raise UsageError("--mask: applies to one floor; pass it with --floor")


def _on_site(given: SimulateOptions, site: Path, settings: Settings) -> api.Scenario:
    """Walks on the plans of a site, past its landmarks."""
    from vislam2tag.simulation.phones import device_names
    from vislam2tag.simulation.scenario import SITE_SEED, site_survey
    from vislam2tag.simulation.site_building import site_building, site_floors

    masks = {} if given.mask is None else dict.fromkeys(given.floor, given.mask)
    floors = site_floors(site, given.floor, given.landmarks, masks, settings.walkable)
    walks = site_survey(
        site_building(floors, SITE_SEED, settings.simulation.site),
        site,
        given.seed,
        given.severity.value,
        device_names(given.devices),
        given.sessions,
        given.minutes * 60,
        day=None if given.later is None else given.later.date(),
    )
    return replace(walks, pressure=given.pressure, ble=given.ble, rtt=given.rtt, settings=settings.simulation.site)


def _like_the_paper(given: SimulateOptions) -> api.Scenario:
    """A copy of the paper's evaluation."""
    walks = api.paper_evaluation(given.seed, given.severity.value)
    return replace(walks, pressure=given.pressure, ble=given.ble, rtt=given.rtt)


def _regular(given: SimulateOptions, settings: Settings) -> api.Scenario:
    """Walks through a generated building."""
    from vislam2tag.simulation.phones import device_names
    from vislam2tag.simulation.scenario import WALKING_DAY

    return api.regular_survey(
        given.seed,
        given.severity.value,
        tuple(range(given.floors)),
        device_names(given.devices),
        given.sessions,
        given.minutes * 60,
        settings.simulation.building,
        climb=given.climb,
        pressure=given.pressure,
        ble=given.ble,
        rtt=given.rtt,
        day=WALKING_DAY if given.later is None else given.later.date(),
    )


def _print(scenario: api.Scenario, out: Path) -> None:
    floors, walks = len(scenario.building.floors), len(scenario.sessions)
    say(
        f"{out}: {walks} walk{'' if walks == 1 else 's'} on {floors} floor{'' if floors == 1 else 's'}; each "
        "session's truth.csv contains its true positions, which mapping never uses"
    )
    next_step("simulate", survey=out)
