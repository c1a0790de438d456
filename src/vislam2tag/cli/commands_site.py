"""``vislam2tag site``: its commands, and show, write, rebase and walkable."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from vislam2tag import api
from vislam2tag.cli.next_steps import next_step
from vislam2tag.cli.options import AsJson, ConfigFile, Floors, FollowLinks, Replace, SiteFolder, setting, settings_of
from vislam2tag.cli.progress import interrupted_with
from vislam2tag.cli.records import argument, command, group, option
from vislam2tag.cli.site_changes import align_command, remove_command, renumber_command, set_command
from vislam2tag.cli.site_init import init_command, print_site, site_record
from vislam2tag.cli.tables import or_dash, print_findings, print_table, print_warnings
from vislam2tag.cli.terminal import answer, say, visible_console
from vislam2tag.common.documentation import with_pages
from vislam2tag.common.errors import UsageError
from vislam2tag.common.findings import Answer


@command
def show_command(
    *,
    site: SiteFolder,
    floor: Floors = (),
    out: Path | None = option(None, "Drawing to write: a .png, .pdf, .svg or .html file.", metavar="FILE"),
    follow_links: FollowLinks = False,
    json: AsJson = False,
) -> None:
    """Show the floors of a site as a table, and with --out as a drawing.

    The drawing shows plans, landmarks, control points, axes and scale.

    Exit code: 0 nothing is wrong, 1 a finding is an error, 2 wrong usage or unusable files, 130 interrupted. Warnings
    do not change the exit code.

    \b
    Examples:
      vislam2tag site show survey
      vislam2tag site show survey --floor 1 --out floor-1.pdf
    """
    from vislam2tag.pipeline.site.show import draw_site, title_of

    summary = api.site_show(site, floor, follow_links=follow_links)
    if out is not None:
        draw_site(summary, title_of(site, follow_links=follow_links), out)
    wrong = summary.judgement.answer is Answer.WRONG
    answer(site_record(summary), json, lambda: _print_shown(summary, site, out), failed=wrong)


def _print_shown(summary: api.SiteSummary, site: Path, out: Path | None) -> None:
    print_site(summary)
    if out is not None:
        say(f"drawn: {out}")
    say(f"site files: {summary.judgement.sentence}")
    if summary.judgement.answer is Answer.WRONG:
        next_step("inspect, unusable", survey=site)
        return
    drawn = any(floor.pixel_m is not None for floor in summary.floors)
    next_step("site show" if drawn else "site show, no plan", site=site)


@command
def write_command(
    *,
    site: SiteFolder,
    out: Path = option(..., "Output folder: new, empty or from an earlier run."),
    follow_links: FollowLinks = False,
    json: AsJson = False,
) -> None:
    """Write a site in the published layout.

    Writes floor_dimensions.csv, and for each floor its plan, marker_dict.csv and refmarker.csv. The origin of this
    layout is the lower left corner of the plan. Positions are moved there, and rebase.toml contains the shift. Sessions
    are not copied.

    Exit code: 0 written, 2 wrong usage or unusable files, 130 interrupted.

    \b
    Example:
      vislam2tag site write survey --out published
    """
    changes, findings = api.site_write(site, out, follow_links=follow_links)

    def show() -> None:
        for change in changes.floors:
            if change.x_m or change.y_m:
                say(f"floor {change.number}: positions moved by ({change.x_m:g}, {change.y_m:g}) m")
        print_findings(findings)
        say(f"written: {out}")
        next_step("site write", out=out)

    answer({"out": out, "changes": changes, "findings": findings}, json, show)


@dataclass(frozen=True, kw_only=True)
class RebaseOptions:
    """Arguments and options of ``vislam2tag site rebase``."""

    source: Path = argument("Labels, data set, site or landmark file.")
    out: Path = option(..., "Output: a new or empty folder, or one from an earlier run.")
    to: Path | None = option(None, "The new site.", metavar="SITE")
    old: Path | None = option(None, "The old site. Not needed if SOURCE is a site.", "--from", metavar="SITE")
    by: Path | None = option(None, "The change of frame as a rebase.toml file.", metavar="FILE")
    back: bool = option(False, "Apply the inverse of the change.")
    rigid: bool = option(False, "Do not estimate a scale.")
    without: tuple[str, ...] = option((), "Ignore this landmark in the estimate; repeatable.", metavar="ID")
    building: str | None = option(None, "Building of the site, if the data set has several.")
    replace: Replace = False
    follow_links: FollowLinks = False
    json: AsJson = False


@command
def rebase_command(given: RebaseOptions) -> None:
    """Move labels, fingerprints or landmarks to a new plan, origin or resurvey.

    SOURCE is an output folder of process, a data set, a site, or a landmark file. It is not changed. Each floor is
    moved by a similarity transform and a change of height. Pass the change with --by, or let it be estimated from the
    landmarks that the sites --from and --to share. Residuals are printed. Positions, covariances, headings and heights
    are transformed, and OUT records the change.

    Exit code: 0 written, 2 wrong usage or unusable files, 130 interrupted.

    \b
    Examples:
      vislam2tag site rebase labels --from survey --to resurveyed \\
          --out labels-now
      vislam2tag site rebase fingerprints --by rebase.toml --to new-site \\
          --out fingerprints-now
      vislam2tag site rebase survey --by rebase.toml --out new-landmarks
    """
    changes = _changes(given)
    changes = changes.inverse if given.back else changes
    if not given.json:
        _print_changes(changes)
    with interrupted_with(f"nothing was written to {given.out}"), visible_console(stderr=True).status("rebasing"):
        kind = api.site_rebase(
            given.source,
            given.out,
            changes,
            given.to,
            given.building,
            replace=given.replace,
            follow_links=given.follow_links,
            tell=print_warnings,
        )

    def show() -> None:
        say(f"rebased {kind}: {given.out}")
        next_step(f"site rebase, {kind}", out=given.out)

    answer({"kind": kind, "out": given.out, "changes": changes}, given.json, show)


def _changes(given: RebaseOptions) -> api.FrameChanges:
    """The change as given, or estimated."""
    from vislam2tag.site.discover import read_site
    from vislam2tag.site.frame_change import estimated_changes, read_changes

    if given.by is not None:
        if given.old is not None or given.rigid or given.without:
            raise UsageError(
                "--by FILE already specifies the change; do not combine it with --from, --rigid or --without"
            )
        return read_changes(given.by)
    if given.to is None:
        raise UsageError("pass the new site with --to, or the change with --by")
    sites = (read_site(site, follow_links=True)[0] for site in (given.old or given.source, given.to))
    return estimated_changes(*sites, rigid=given.rigid, without=given.without)


def _print_changes(changes: api.FrameChanges) -> None:
    rows = []
    for change in changes.floors:
        residuals = list(change.residuals_m.values())
        rms_m = (sum(each * each for each in residuals) / len(residuals)) ** 0.5 if residuals else None
        moved = (f"{each:.3f} m" for each in (change.x_m, change.y_m, change.rise_m))
        fit = (str(len(residuals)) if residuals else "-", or_dash(rms_m, "{:.3f} m"))
        rows.append((str(change.number), f"{change.angle_deg:.4f}°", f"{change.scale:.6f}", *moved, *fit))
    heads = ("turn", "scale", "x", "y", "rise", "landmarks", "rms")
    print_table("Change of frame", ("floor",), heads, rows)
    for change in changes.floors:
        worst = sorted(change.residuals_m.items(), key=lambda item: -item[1])[:3]
        if worst:
            texts = ", ".join(f"{name} {apart_m:.3f} m" for name, apart_m in worst)
            say(f"floor {change.number}: largest residuals: {texts}; exclude moved landmarks with --without")


@command
def walkable_command(
    *,
    site: SiteFolder,
    out: Path = option(..., "Output folder: new, empty or from an earlier run."),
    floor: Floors = (),
    mask: Path | None = option(None, "Image for one floor: green is walkable, red is not.", metavar="IMAGE"),
    wall_contrast: float | None = setting("walkable.wall_contrast", hidden=True),
    follow_links: FollowLinks = False,
    json: AsJson = False,
    config: ConfigFile = None,
) -> None:
    """Detect the walkable space of each floor from its plan.

    `plan` and `simulate` use it, see docs/explanation/planning.md. For each floor this writes OUT/floor_K.png (walkable
    space, walls, corridors), OUT/floor_K.geojson (graph in metres) and OUT/floor_K.mask.png. In the mask, people can
    walk on green and not on red. Correct it with any paint program and pass it with --mask to this command, plan or
    simulate. walkable.json contains figures and findings.

    Exit code: 0 written, 2 wrong usage, no plan or nothing walkable, 130 interrupted.

    \b
    Examples:
      vislam2tag site walkable survey --out walkable
      vislam2tag site walkable survey --floor 4 --config own.toml \\
          --out walkable
      vislam2tag site walkable survey --floor 4 --mask corrected.png \\
          --out walkable
    """
    from vislam2tag.pipeline.site.show import floor_record

    settings = settings_of(config, {"walkable.wall_contrast": wall_contrast}).walkable
    found = api.site_walkable(site, out, floor, settings, mask, follow_links=follow_links, tell=print_warnings)
    answer([floor_record(one) for one in found], json, lambda: _print_walkable(found, site, out))


def _print_walkable(found: tuple[api.WalkableFloor, ...], site: Path, out: Path) -> None:
    from vislam2tag.site.walkable.graph import NodeKind

    kinds = [kind for kind in NodeKind if any(kind in one.graph.kinds for one in found)]
    rows = []
    for one in found:
        corridors_m = float(one.graph.length_m[~one.graph.in_room & ~one.graph.shortcut].sum())
        counts = [str(one.graph.kinds.count(kind)) for kind in kinds]
        sizes = (f"{one.area_m2:.0f} m2", f"{corridors_m:.0f} m")
        rows.append((f"{one.floor.number} {one.floor.name}", *sizes, *counts))
    print_table("Walkable space", ("floor",), ("area", "corridors", *(kind.value for kind in kinds)), rows)
    for one in found:
        for finding in one.findings:
            say(f"floor {one.floor.number}: {finding.message}")
    say(f"written: {out}")
    next_step("site walkable", site=site)


site_command = group(
    with_pages("Describe the building of a survey: floors, plans, coordinate frames (docs/how-to/site.md)."),
    ("init", "Create a site or add a floor.", init_command),
    ("set", "Change a floor's name, or size and place of its plan.", set_command),
    ("renumber", "Give a floor another number.", renumber_command),
    ("remove", "Take a floor out of a site.", remove_command),
    ("align", "Lay a floor on top of another one.", align_command),
    ("show", "Show the floors as a table or drawing.", show_command),
    ("write", "Write the site in the published layout.", write_command),
    ("rebase", "Move labels to a new plan or origin.", rebase_command),
    ("walkable", "Show the walkable space of the floors.", walkable_command),
)
for each in site_command.registered_commands:
    if each.name == "renumber":  # its numbers may be negative, which look like options
        each.context_settings = {"ignore_unknown_options": True}
