"""``vislam2tag register``."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from vislam2tag import api
from vislam2tag.cli.next_steps import next_step
from vislam2tag.cli.options import AsJson, ConfigFile, FollowLinks, setting, settings_from
from vislam2tag.cli.records import argument, command, option
from vislam2tag.cli.tables import or_dash, print_table
from vislam2tag.cli.terminal import answer, print_line, say
from vislam2tag.common.errors import UsageError
from vislam2tag.common.findings import counted

if TYPE_CHECKING:
    from vislam2tag.preparation.registration.record import RegisteredPoint


WORST = 10
"""Number of residuals printed; the files contain all."""


@dataclass(frozen=True, kw_only=True)
class RegisterOptions:
    """Arguments and options of ``vislam2tag register``."""

    site: Path = argument("Site or survey folder.")
    floor: int | None = option(None, "Floor; needed if the site has several.")
    station: tuple[Path, ...] = option((), "Export file of a total station; repeatable.", metavar="FILE")
    control: Path | None = option(
        None, "Known points in building coordinates: point,E,N,H and optional sigma.", metavar="FILE"
    )
    known: tuple[str, ...] = option((), "Id of a landmark with known position, or all; repeatable.")
    columns: str | None = option(None, "Order of columns in the exports: point,E,N,H,code,station, - to skip one.")
    code: tuple[str, ...] = option((), "Use only shots with this point code; repeatable.")
    landmark_names: str = option("*", "Names of landmarks in the exports; * is the id.")
    control_points: str = option("CP*", "Names of control points in the exports; * is the number.")
    ties: str = option("TP*", "Names of tie points between stations in the exports.")
    scale: str = option("fixed", "free: also estimate a scale factor of distances.", metavar="fixed|free")
    tape: Path | None = option(None, "Tape distances: landmark,to,distance_m and optional sigma_m.", metavar="FILE")
    targets: Path | None = option(None, "Corners and walls for --tape: name,x,y or name,x,y,x2,y2.", metavar="FILE")
    clicks: Path | None = option(None, "Clicks saved by the page of --click.", metavar="FILE")
    click: Path | None = option(None, "Write a page for clicking landmarks on the plan, and end.", metavar="PAGE.html")
    shot_sigma_m: float | None = setting("registration.shot_sigma_m", hidden=True)
    tape_sigma_m: float | None = setting("registration.tape_sigma_m", hidden=True)
    plan_sigma_m: float | None = setting("registration.plan_sigma_m", hidden=True)
    follow_links: FollowLinks = False
    json: AsJson = False
    config: ConfigFile = None
    out: Path | None = option(None, "Folder for files, record and figure.", metavar="FOLDER")
    write: bool = option(False, "Write the positions into the site's files.")
    replace: bool = option(False, "Let --write replace different positions.")


@command
def register_command(given: RegisterOptions) -> None:
    """Compute the positions of landmarks from what surveyors measured.

    Exports of total stations (--station, one file each) are adjusted by least squares together with known points
    (--control, or landmarks of the site with --known). The result has residuals and a sigma for each landmark.
    Measurements that contradict the rest are excluded and named: interchanged, mistyped or displaced points. Tape
    distances (--tape with --targets) and clicks on the plan (--click, then --clicks) are cheaper and less exact.
    Nothing is written without --out or --write. See docs/how-to/registration.md for formats and method.

    Exit code: 0 all registered, 1 a measurement was excluded, a landmark has no position, two may be interchanged, or
    names do not match (then --write writes nothing), 2 wrong usage or too few measurements, 3 no point was registered,
    130 interrupted.

    \b
    Examples:
      vislam2tag register site --floor 1 --station S1.csv --station S2.txt \\
          --control known.csv --out registered
      vislam2tag register site --floor 1 --station S1.csv --known all \\
          --landmark-names 'LM*' --write
      vislam2tag register site --floor 1 --tape tape.csv --targets walls.csv \\
          --write --replace
      vislam2tag register site --floor 1 --click clicks.html
      vislam2tag register site --floor 1 --clicks clicks_floor_1.csv --write
    """
    from vislam2tag.pipeline.site import register as registering
    from vislam2tag.preparation.registration.point_columns import parse_columns

    whole, chosen = registering.floor_of(given.site, given.floor)
    if given.click is not None:
        _write_page(given.click, given, whole, chosen)
    settings = settings_from(given).registration
    if given.scale not in ("fixed", "free"):
        raise UsageError(f"--scale {given.scale}: expected fixed or free")
    if given.out is not None:
        registering.check_out(given.out, given.site)
    sources = registering.FloorFiles(
        stations=given.station,
        control=given.control,
        known=given.known,
        tape=given.tape,
        targets=given.targets,
        clicks=given.clicks,
        columns=None if given.columns is None else parse_columns(given.columns),
        codes=given.code,
        rules=api.NameRules(given.landmark_names, given.control_points, given.ties),
        free_scale=given.scale == "free",
    )
    found = registering.register(whole, chosen, sources, settings)
    written = _written(found, given, chosen)
    answer(
        found,
        given.json,
        lambda: _print(found, given, settings.shot_sigma_m, written),
        failed=not found.complete,
        nothing=not found.has_points,
    )


def _written(found: api.Registration, given: RegisterOptions, floor: api.Floor) -> list[Path]:
    """Write into the site and the output folder as asked; return the files."""
    from vislam2tag.pipeline.site.register import write_folder, write_into_site

    written: list[Path] = []
    if not found.has_points:
        return written
    if given.write and not found.has_other_names:
        written += write_into_site(given.site, floor, found, replace=given.replace)
    if given.out is not None:
        written += write_folder(given.out, given.site, floor, found)
    return written


def _write_page(page: Path, given: RegisterOptions, site: api.Site, floor: api.Floor) -> None:
    """Write the page for clicking landmarks, and end."""
    import numpy as np

    from vislam2tag.site.links import refuse_outside_plan
    from vislam2tag.views.click_pages import write_click_page

    if not given.follow_links:
        refuse_outside_plan(given.site, floor)
    here = site.landmarks.on_floor(floor.number)
    placed = np.flatnonzero(here.surveyed).tolist()
    expected = {here.ids[i]: (float(here.position_bcs[i, 0]), float(here.position_bcs[i, 1])) for i in placed}
    write_click_page(page, floor, expected, here.ids)
    show = lambda: next_step("register, click", page=page, site=given.site, floor=floor.number)
    answer({"floor": floor.number, "page": page}, given.json, show)


def _print(found: api.Registration, given: RegisterOptions, shot_sigma_m: float, written: Sequence[Path]) -> None:
    if found.has_points:
        _print_points(found)
    if found.residuals or found.tape_residuals:
        _print_residuals(found)
    for repeat in found.repeats:
        if repeat.spread_m > 3 * shot_sigma_m:
            spread = f"{repeat.shots} shots from {repeat.station} spread by {1000 * repeat.spread_m:.0f} mm"
            print_line("repeated", "yellow", f"{repeat.point}: {spread}")
    for finding in found.findings:
        place = f"{finding.file}: " if finding.file else ""
        lines = f" (line {', '.join(map(str, finding.lines))})" if finding.lines else ""
        say(f"{finding.severity.value} {place}{finding.message}{lines}")
    for error in found.errors:
        print_line("excluded", "bold red", error)
    for name, why in found.unplaced.items():
        print_line("no position", "bold red", f"landmark {name}: {why}")
    _print_summary(found)
    for path in written:
        say(f"written: {path}")
    _print_next(found, given)


def _print_next(found: api.Registration, given: RegisterOptions) -> None:
    after = "register" if given.write else "register, not written"
    if not found.has_points:
        after = "register, nothing"
        if given.tape is not None and given.targets is None:
            say("no corner or wall is known: pass their positions with --targets FILE (name,x,y or name,x,y,x2,y2)")
        if given.station and not found.unplaced:
            say(
                "no point of the stations is a landmark, so nothing was written: exchange --station and --control, or "
                "correct --landmark-names"
            )
    if found.has_other_names:
        after = "register, other names"
        if given.write:
            say("nothing was written into the site, because no name matches its landmark table")
    next_step(after, site=given.site)


def _print_summary(found: api.Registration) -> None:
    if found.stations:
        sigma0 = or_dash(found.sigma0, "{:.2f}")
        text = (
            f"{counted(len(found.stations), 'station')}; sigma0 {sigma0} of {found.redundancy} redundant measurements"
        )
        if found.scale is not None:
            text += f"; scale {found.scale.value:.5f} ± {found.scale.sigma:.5f}"
        say(text)
    say(
        f"{counted(len(found.landmarks), 'landmark')} and {counted(len(found.control_points), 'control point')} "
        f"registered, {len(found.unplaced)} without a position, {len(found.errors)} contradictions"
    )


def _print_points(found: api.Registration) -> None:
    rows = [_cells("", one) for one in found.landmarks]
    rows += [_cells("control point ", one) for one in found.control_points]
    numbers = ("x", "y", "z", "sigma", "heading", "measurements", "checked")
    print_table(f"Floor {found.floor} (metres)", ("point", "by"), numbers, rows)


def _cells(kind: str, one: RegisteredPoint) -> tuple[str, ...]:
    heading = "-" if one.heading_rad is None else f"{math.degrees(one.heading_rad):.1f}°"
    by = f"{one.source.value} ({one.note})" if one.note else one.source.value
    place = (f"{one.x_m:.3f}", f"{one.y_m:.3f}", or_dash(one.z_m, "{:.3f}"), f"{one.sigma_m:.3f}")
    return (kind + one.point, by, *place, heading, str(one.measurements), f"{100 * one.checked:.0f} %")


def _print_residuals(found: api.Registration) -> None:
    rows = []
    every = sorted((*found.residuals, *found.tape_residuals), key=lambda one: -abs(one.sigmas))
    for one in every[:WORST]:
        along = ("-", "-") if one.by_m is None else tuple(_millimetres(value) for value in one.by_m)
        rows.append((one.measurement, *along, _millimetres(one.off_m), f"{one.sigmas:.1f}"))
    title = f"Largest residuals of the measurements used (at most {WORST})"
    print_table(title, ("measurement",), ("x", "y", "residual", "sigmas"), rows)


def _millimetres(value_m: float) -> str:
    return f"{1000 * value_m:.1f} mm"
