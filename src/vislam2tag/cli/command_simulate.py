"""``vislam2tag simulate``: a raw survey with known truth."""

from __future__ import annotations

from dataclasses import replace
from datetime import datetime
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from vislam2tag.cli.next_steps import next_step
from vislam2tag.cli.options import AsJson
from vislam2tag.cli.settings_options import ConfigFile, setting, settings_of
from vislam2tag.cli.terminal import say, say_json, visible_console
from vislam2tag.common.errors import UsageError
from vislam2tag.simulation.choices import (
    TRAP_FINDINGS,
    Climb,
    CopiedSurvey,
    FileNames,
    Locale,
    SessionLayout,
    SeverityLevel,
    SiteColumn,
)

if TYPE_CHECKING:
    from vislam2tag.simulation.scenario import Scenario
    from vislam2tag.simulation.survey import WritingOptions


HELP = """
Simulate a raw survey in the published layout or the phone app's, with the truth beside it (truth.csv in each session).

The pipeline never reads the truth. The same options give the same bytes. With --site, access points are those of the
building, whatever the seed, which is the walks'; --later makes a second survey that can be joined with the first.

Exit code: 0 written, 2 wrong usage, or OUT holds something already or cannot be written.

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
      --landmark-file plan/landmarks.csv
"""


def register(app: typer.Typer) -> None:
    """Add the command to the application."""
    app.command("simulate", help=HELP, epilog=f"Traps: {', '.join(TRAP_FINDINGS)}.")(_simulate)


def _simulate(
    context: typer.Context,
    out: Annotated[Path, typer.Argument(help="New or empty folder for the survey.")],
    floors: Annotated[int, typer.Option(min=1, help="Number of floors.")] = 2,
    devices: Annotated[int, typer.Option(min=1, help="Number of phones.")] = 2,
    sessions: Annotated[int, typer.Option(min=1, help="Walks on each floor with each phone.")] = 2,
    minutes: Annotated[float, typer.Option(min=0.25, max=600, help="Length of each walk.")] = 2.0,
    landmark_count: Annotated[int | None, setting("simulation.building.landmarks")] = None,
    severity: Annotated[SeverityLevel, typer.Option(help="How much goes wrong with tracking.")] = SeverityLevel.DEFAULT,
    seed: Annotated[int, typer.Option(help="One seed, same bytes.")] = 0,
    locale: Annotated[Locale, typer.Option(help="Decimal comma, point, or each phone its own.")] = Locale.MIXED,
    trap: Annotated[list[str] | None, typer.Option(help="A trap of the raw layout; may be given again.")] = None,
    climb: Annotated[
        Climb | None,
        typer.Option(help="Walks go on to other floors and back this way; landmark ids then differ between floors."),
    ] = None,
    pressure: Annotated[bool, typer.Option("--pressure", help="The phones log air pressure, too.")] = False,
    ble: Annotated[bool, typer.Option("--ble", help="There are BLE beacons, and the phones log them.")] = False,
    rtt: Annotated[bool, typer.Option("--rtt", help="Log ranges to access points (with --format phone).")] = False,
    without_poses: Annotated[
        bool, typer.Option("--without-poses", help="No tracker: known positions every 20 s in place of poses.")
    ] = False,
    column: Annotated[
        list[SiteColumn] | None,
        typer.Option(help="An optional column of the site's files; may be given again."),
    ] = None,
    names: Annotated[FileNames, typer.Option(help="File names as published or as in the paper.")] = FileNames.PUBLISHED,
    layout: Annotated[
        SessionLayout, typer.Option("--format", help="Sessions as published, or as the phone app writes them.")
    ] = SessionLayout.PUBLISHED,
    scripts: Annotated[
        bool, typer.Option("--scripts", help="With --format phone: script.txt, what the phone saw, in each session.")
    ] = False,
    like: Annotated[
        CopiedSurvey | None,
        typer.Option(help="Copy the paper's evaluation (floors, phones and walks are then its own)."),
    ] = None,
    site: Annotated[
        Path | None,
        typer.Option(metavar="SITE", help="Walk on the plans of this site, past its landmarks, instead of a made one."),
    ] = None,
    floor: Annotated[list[int] | None, typer.Option(help="With --site: only this floor; repeatable.")] = None,
    landmark_file: Annotated[
        Path | None,
        typer.Option(metavar="FILE", help="With --site: its landmarks.csv or the like instead of its own landmarks."),
    ] = None,
    mask: Annotated[
        Path | None,
        typer.Option(metavar="IMAGE", help="With --site and one --floor: green can be walked, red cannot."),
    ] = None,
    later: Annotated[
        datetime | None,
        typer.Option(
            formats=["%Y-%m-%d"],
            metavar="DATE",
            help="Walks of that day through the same building, for join: 2022-06-01.",
        ),
    ] = None,
    json: AsJson = False,
    config: ConfigFile = None,
) -> None:
    from vislam2tag.simulation.scenario import WALKING_DAY, paper_evaluation, regular_survey
    from vislam2tag.simulation.sensors.devices import device_names
    from vislam2tag.simulation.survey import WritingOptions
    from vislam2tag.simulation.writing.traps import check_traps

    if scripts and layout is not SessionLayout.PHONE:
        raise UsageError("--scripts: needs --format phone")
    options = WritingOptions(
        locale,
        names is FileNames.PAPER,
        check_traps(trap or ()),
        frozenset(column or ()),
        layout,
        without_poses,
        scripts,
    )
    if climb is not None and (like is not None or site is not None or floors < 2):
        raise UsageError("--climb: needs --floors 2 or more and a survey of its own, without --like and --site")
    if site is not None and like is not None:
        raise UsageError("--site and --like: give one of the two")
    _refuse_ignored(context, like, site)
    day = None if later is None else later.date()
    if site is None and (floor or landmark_file or mask):
        raise UsageError("--floor, --landmark-file and --mask: need --site")
    if mask is not None and len(floor or ()) != 1:
        raise UsageError("--mask: corrects one floor; name it with --floor")
    settings = settings_of(config, {"simulation.building.landmarks": landmark_count})
    if site is not None:
        from vislam2tag.simulation.building.site_building import site_building
        from vislam2tag.simulation.building.site_survey import site_floors
        from vislam2tag.simulation.scenario import SITE_SEED, site_survey

        masks = {} if mask is None else dict.fromkeys(floor or (), mask)
        building = site_building(
            site_floors(site, floor or (), landmark_file, masks, settings.walkable), SITE_SEED, settings.simulation.site
        )
        walks = site_survey(
            building, site, seed, severity.value, device_names(devices), sessions, minutes * 60, day=day
        )
        scenario = replace(walks, pressure=pressure, ble=ble, rtt=rtt, settings=settings.simulation.site)
    elif like is CopiedSurvey.PAPER:
        scenario = replace(paper_evaluation(seed, severity.value), pressure=pressure, ble=ble, rtt=rtt)
    else:
        scenario = regular_survey(
            seed,
            severity.value,
            tuple(range(floors)),
            device_names(devices),
            sessions,
            minutes * 60,
            settings.simulation.building,
            climb=climb,
            pressure=pressure,
            ble=ble,
            rtt=rtt,
            day=day or WALKING_DAY,
        )
    _run_with_progress(scenario, out, options)
    if json:
        say_json({"survey": out, "seed": seed, "sessions": [session.key for session in scenario.sessions]})
    else:
        _print(scenario, out)
        next_step("simulate", survey=out)


_IGNORED = {
    "--like": ("floors", "devices", "sessions", "minutes", "landmark_count", "later"),
    "--site": ("floors", "landmark_count"),
}
"""What an option decides itself, by the names of parameters."""


def _refuse_ignored(context: typer.Context, like: CopiedSurvey | None, site: Path | None) -> None:
    """Raise UsageError for options that would be ignored beside others."""
    for option, given in (("--like", like), ("--site", site)):
        if given is None:
            continue
        for name in _IGNORED[option]:
            source = context.get_parameter_source(name)
            if source is not None and source.name == "COMMANDLINE":
                instead = " (name floors of the site by --floor)" if (option, name) == ("--site", "floors") else ""
                raise UsageError(
                    f"--{name.replace('_', '-')}: has no effect with {option}; leave one of the two out{instead}"
                )


def _run_with_progress(scenario: Scenario, out: Path, options: WritingOptions) -> None:
    """Simulate with a progress bar on standard error."""
    from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

    from vislam2tag.simulation.survey import simulate

    columns = (TextColumn("simulate"), BarColumn(), MofNCompleteColumn(), TextColumn("sessions"), TimeRemainingColumn())
    with Progress(*columns, console=visible_console(stderr=True), transient=True) as progress:
        bar = progress.add_task("simulate", total=len(scenario.sessions))
        simulate(scenario, out, options, lambda _session, _total: progress.advance(bar))


def _print(scenario: Scenario, out: Path) -> None:
    floors, walks = len(scenario.building.floors), len(scenario.sessions)
    say(
        f"{out}: {walks} walk{'' if walks == 1 else 's'} on {floors} floor{'' if floors == 1 else 's'}; where each "
        "really led stands in its truth.csv, which only evaluate reads"
    )
