"""``vislam2tag site``: show, write, rebase, walkable."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from vislam2tag.cli.next_steps import next_step
from vislam2tag.cli.options import AsJson, Floors, FollowLinks, Replace
from vislam2tag.cli.settings_options import ConfigFile, setting, settings_of
from vislam2tag.cli.site_init import INIT_HELP, SITE_CODES, site_init
from vislam2tag.cli.tables import print_findings, print_site, print_warnings, site_record, table, table_console
from vislam2tag.cli.terminal import say, say_json, visible_console
from vislam2tag.common.errors import UsageError
from vislam2tag.common.judgement import Answer

if TYPE_CHECKING:
    from vislam2tag.pipeline.site.walkable import WalkableFloor
    from vislam2tag.survey.frame_change import FrameChanges


HELP = """
The site that a survey is of: building, floors, plans, frames (docs/how-to/site.md).
"""
SHOW_HELP = """
Show a site: a table of its floors, and with --out a drawing of plans, landmarks, control points, axes and scale.

Exit code: 0 nothing is wrong (warnings are no failure), 1 a finding is an error, 2 wrong usage or unusable files, or
nothing can be written, 130 interrupted.

\b
Examples:
  vislam2tag site show survey
  vislam2tag site show survey --floor 1 --out floor-1.pdf
"""
WRITE_HELP = f"""
Write a site in the published layout: floor_dimensions.csv, and each floor's plan, marker_dict.csv and refmarker.csv.

The origin of that layout is the lower left corner of the plan: positions move there, and rebase.toml says by how
much. Sessions are not copied.

{SITE_CODES}

\b
Example:
  vislam2tag site write survey --out published
"""
REBASE_HELP = f"""
Carry labels, fingerprints or landmarks over to a new plan, origin or resurvey. What is there stays as it is.

SOURCE is an output folder of process, a data set, a site, or a file with landmarks of several floors. The change of
each floor, a similarity and a rise, is given by --by, or estimated from the landmarks that the sites --from and --to
share; residuals are printed. Positions, covariances, headings and heights change with it, and OUT records the change.

{SITE_CODES}

\b
Examples:
  vislam2tag site rebase labels --from survey --to resurveyed \\
      --out labels-now
  vislam2tag site rebase fingerprints --by rebase.toml --to new-site \\
      --out fingerprints-now
  vislam2tag site rebase survey --by rebase.toml --out new-landmarks
"""
_PAGE = "page"
"""``--area``: all of it."""
SiteFolder = Annotated[Path, typer.Argument(metavar="SITE", help="Survey folder.")]


def register(app: typer.Typer) -> None:
    """Add the command to the application."""
    site = typer.Typer(help=HELP, no_args_is_help=True, rich_markup_mode=None)
    site.command("init", help=INIT_HELP, short_help="Begin a site, or add a floor to it.")(site_init)
    site.command("show", help=SHOW_HELP, short_help="A table of its floors, or a drawing.")(_show)
    site.command("write", help=WRITE_HELP, short_help="Write it in the published layout.")(_write)
    site.command("rebase", help=REBASE_HELP, short_help="Carry labels over to a new plan or origin.")(_rebase)
    site.command("walkable", help=WALKABLE_HELP, short_help="Show where its floors can be walked.")(site_walkable)
    app.add_typer(site, name="site")


def _show(
    site: SiteFolder,
    floor: Annotated[list[int] | None, typer.Option(help="Only this floor; repeatable.")] = None,
    out: Annotated[
        Path | None, typer.Option(metavar="FILE", help="Draw it there: a file named .png, .pdf, .svg or .html.")
    ] = None,
    follow_links: FollowLinks = False,
    json: AsJson = False,
) -> None:
    from vislam2tag.pipeline.site.show import draw_site, summarise_site, title_of

    summary = summarise_site(site, floor or (), follow_links=follow_links)
    if out is not None:
        draw_site(summary, title_of(site, follow_links=follow_links), out)
    wrong = summary.judgement.answer is Answer.WRONG
    if json:
        say_json(site_record(summary))
        raise typer.Exit(1 if wrong else 0)
    print_site(summary)
    if out is not None:
        say(f"drawn: {out}")
    drawn = any(floor.pixel_m is not None for floor in summary.floors)
    say(f"site files: {summary.judgement.sentence}")
    if wrong:
        next_step("inspect, unusable", survey=site)
        raise typer.Exit(1)
    next_step("site show" if drawn else "site show, no plan", site=site)


def _write(
    site: SiteFolder,
    out: Annotated[Path, typer.Option(help="Output folder: new, empty or from an earlier run.")],
    follow_links: FollowLinks = False,
    json: AsJson = False,
) -> None:
    from vislam2tag.pipeline.site.write import write_published

    changes, findings = write_published(site, out, follow_links=follow_links)
    if json:
        say_json({"out": out, "changes": changes, "findings": findings})
        return
    for change in changes.floors:
        if change.x_m or change.y_m:
            say(f"floor {change.number}: positions moved by ({change.x_m:g}, {change.y_m:g}) m")
    print_findings(findings)
    say(f"written: {out}")
    next_step("site write", out=out)


def _rebase(
    source: Annotated[Path, typer.Argument(help="Labels, data set, site or landmark file.")],
    out: Annotated[Path, typer.Option(help="Where the rebased one goes: new, empty or from an earlier run.")],
    to: Annotated[Path | None, typer.Option(metavar="SITE", help="The new site.")] = None,
    old: Annotated[
        Path | None, typer.Option("--from", metavar="SITE", help="The old site; SOURCE itself where that is a site.")
    ] = None,
    by: Annotated[Path | None, typer.Option(metavar="FILE", help="The change, as rebase.toml.")] = None,
    back: Annotated[bool, typer.Option("--back", help="Apply the inverse of the change.")] = False,
    rigid: Annotated[bool, typer.Option("--rigid", help="Estimate no scale.")] = False,
    without: Annotated[
        list[str] | None, typer.Option(metavar="ID", help="Do not estimate by this landmark; repeatable.")
    ] = None,
    building: Annotated[str | None, typer.Option(help="The site's building in a data set of several.")] = None,
    replace: Replace = False,
    follow_links: FollowLinks = False,
    json: AsJson = False,
) -> None:
    from vislam2tag.pipeline.site.rebase import rebase  # reads data sets: the other commands do without

    changes = _changes(source, to, old, by, rigid, tuple(without or ()))
    changes = changes.inverse if back else changes
    if not json:
        _print_changes(changes)
    try:
        with visible_console(stderr=True).status("rebasing"):
            kind = rebase(
                source,
                out,
                changes,
                to,
                building,
                replace=replace,
                follow_links=follow_links,
                tell=print_warnings,
            )
    except KeyboardInterrupt:
        say(f"interrupted: nothing was written to {out}", err=True)
        raise typer.Exit(130) from None
    if json:
        say_json({"kind": kind, "out": out, "changes": changes})
        return
    say(f"rebased {kind}: {out}")
    next_step(f"site rebase, {kind}", out=out)


def _changes(
    source: Path, to: Path | None, old: Path | None, by: Path | None, rigid: bool, without: tuple[str, ...]
) -> FrameChanges:
    """The change as given, or estimated."""
    from vislam2tag.survey.discover import read_site
    from vislam2tag.survey.frame_change import estimated_changes, read_changes

    if by is not None:
        if old is not None or rigid or without:
            raise UsageError("--by: the change is given; --from, --rigid and --without are for estimating it")
        return read_changes(by)
    if to is None:
        raise UsageError("--to: give the new site, or the change by --by")
    sites = (read_site(site, follow_links=True)[0] for site in (old or source, to))
    return estimated_changes(*sites, rigid=rigid, without=without)


def _print_changes(changes: FrameChanges) -> None:
    from rich.markup import escape

    rows = table("Change of frame", ("floor",), ("turn", "scale", "x", "y", "rise", "landmarks", "rms"))
    for change in changes.floors:
        residuals = list(change.residuals_m.values())
        rms_m = (sum(each * each for each in residuals) / len(residuals)) ** 0.5 if residuals else None
        rows.add_row(
            str(change.number),
            f"{change.angle_deg:.4f}°",
            f"{change.scale:.6f}",
            f"{change.x_m:.3f} m",
            f"{change.y_m:.3f} m",
            f"{change.rise_m:.3f} m",
            str(len(residuals)) if residuals else "-",
            "-" if rms_m is None else f"{rms_m:.3f} m",
        )
    console = table_console()
    console.print(rows)
    for change in changes.floors:
        worst = sorted(change.residuals_m.items(), key=lambda item: -item[1])[:3]
        if worst:
            texts = ", ".join(f"{escape(name)} {apart_m:.3f} m" for name, apart_m in worst)
            console.print(
                f"floor {change.number}: fit worst: {texts}; leave out what was moved by --without", soft_wrap=True
            )


WALKABLE_HELP = """
Show where floors can be walked, as planning and simulating take it from the plans (docs/explanation/walkable.md).

Writes for each floor OUT/floor_K.png (walkable space, walls, corridors), OUT/floor_K.geojson (the graph, metres) and
OUT/floor_K.mask.png, green where people can walk and red elsewhere: correct it with any paint program, and give it to
--mask here, of plan and of simulate. walkable.json has figures and findings.

Exit code: 0 all right, 2 wrong usage, no plan, nothing that can be walked, or OUT cannot be written, 130 interrupted.

\b
Examples:
  vislam2tag site walkable survey --out walkable
  vislam2tag site walkable survey --floor 4 --wall-contrast 0.08 \\
      --out walkable
  vislam2tag site walkable survey --floor 4 --mask corrected.png \\
      --out walkable
"""


def site_walkable(
    site: Annotated[Path, typer.Argument(metavar="SITE", help="Survey folder.")],
    out: Annotated[Path, typer.Option(help="Output folder: new, empty or from an earlier run.")],
    floor: Floors = None,
    mask: Annotated[
        Path | None, typer.Option(metavar="IMAGE", help="With one floor: green can be walked, red cannot.")
    ] = None,
    wall_contrast: Annotated[float | None, setting("walkable.wall_contrast")] = None,
    follow_links: FollowLinks = False,
    json: AsJson = False,
    config: ConfigFile = None,
) -> None:
    """Find and draw walkable space."""
    from vislam2tag.pipeline.site.walkable import floor_record, write_walkable

    settings = settings_of(config, {"walkable.wall_contrast": wall_contrast}).walkable
    found = write_walkable(site, out, floor or (), settings, mask, follow_links=follow_links, tell=print_warnings)
    if json:
        say_json([floor_record(one) for one in found])
        return
    _print_walkable(found)
    say(f"written: {out}")
    next_step("site walkable", site=site)


def _print_walkable(found: tuple[WalkableFloor, ...]) -> None:
    from rich.markup import escape

    from vislam2tag.walkable.graph import NodeKind

    console = table_console()
    kinds = [kind for kind in NodeKind if any(kind in one.graph.kinds for one in found)]
    rows = table("Walkable space", ("floor",), ("area", "corridors", *(kind.value for kind in kinds)))
    for one in found:
        corridors_m = float(one.graph.length_m[~one.graph.in_room & ~one.graph.shortcut].sum())
        counts = [str(one.graph.kinds.count(kind)) for kind in kinds]
        rows.add_row(
            escape(f"{one.floor.number} {one.floor.name}"), f"{one.area_m2:.0f} m2", f"{corridors_m:.0f} m", *counts
        )
    console.print(rows)
    for one in found:
        for finding in one.findings:
            console.print(f"floor {one.floor.number}: {escape(finding.message)}", soft_wrap=True)
