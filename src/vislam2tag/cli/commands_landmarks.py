"""Commands that prepare landmarks: ``plan`` and ``sheets``."""

from __future__ import annotations

import math
from collections import Counter
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from vislam2tag import api
from vislam2tag.cli.next_steps import next_step
from vislam2tag.cli.options import AsJson, ConfigFile, Floors, FollowLinks, setting, settings_from, settings_of
from vislam2tag.cli.progress import interrupted_with, session_bar
from vislam2tag.cli.records import argument, command, option, settings_given
from vislam2tag.cli.tables import or_dash, print_table
from vislam2tag.cli.terminal import answer, say
from vislam2tag.common.errors import UsageError
from vislam2tag.preparation.sheets.settings import sheet_size

if TYPE_CHECKING:
    from vislam2tag.preparation.planning.records import FloorPlanRecord


@dataclass(frozen=True, kw_only=True)
class PlanOptions:
    """Arguments and options of ``vislam2tag plan``."""

    site: Path = argument("Site or survey folder (with site.toml or floor_K below).")
    out: Path = option(..., "Output: a new or empty folder, or one from an earlier run.", metavar="P")
    floor: Floors = ()
    spacing_m: float | None = setting("plan.spacing_m")
    paper: tuple[str, ...] = option(
        (),
        "Allowed paper size; repeatable.  [default: A4, A3]",
        metavar="SIZE",
        parse=lambda text, _: sheet_size(text).name,
    )
    forbid: Path | None = option(None, "Areas without landmarks: CSV with floor,x0,y0,x1,y1 in metres.", metavar="FILE")
    mask: Path | None = option(None, "Image for one --floor: green is walkable, red is not.", metavar="IMAGE")
    restart: bool = option(False, "Drop the planned landmarks that were not measured, and plan again.")
    ignore_existing: bool = option(False, "Ignore the existing landmarks of the site. --write still adds to them.")
    rooms: bool | None = setting("plan.rooms", hidden=True)
    view_deg: tuple[float, float] | None = option(
        None, "Angles of view of the camera, degrees.  [default: 67 53]", metavar="LONG SHORT", hidden=True
    )
    nearest_m: float | None = setting("plan.camera.nearest_m", hidden=True)
    speed_m_s: float | None = setting("plan.speed_m_s", hidden=True)
    further: int | None = setting("plan.further", hidden=True)
    first_id: int = option(1, "Number of the first new landmark.", least=0)
    time_limit_s: float | None = setting("plan.time_limit_s", hidden=True)
    follow_links: FollowLinks = False
    json: AsJson = False
    config: ConfigFile = None
    write: bool = option(False, "Add the new landmarks to the site's marker_dict.csv files.")


@command
def plan_command(given: PlanOptions) -> None:
    """Plan where to hang landmarks: as few as possible.

    Every walk passes a landmark after each critical turn, and never goes farther than a set distance without one.
    Existing landmarks of the site stay where they are. --restart drops those that were planned and not measured. New
    ones are planned on walls that a passer-by faces, away from doors and corners, on sheets large enough to be
    recognised in passing.

    Writes P/landmarks.csv, the plan of each floor with a tour, a map of the expected label error, plan.json and
    index.html. See docs/explanation/planning.md for the method.

    Exit code: 0 planned, 1 a requirement cannot be met (a line names it), 2 wrong usage, no site, or a floor that
    cannot be planned, 130 interrupted.

    \b
    Examples:
      vislam2tag plan site --out plan
      vislam2tag plan site --floor 3 --spacing-m 12 --paper A4 --out plan
      vislam2tag plan site --forbid glass.csv --first-id 101 --out plan --write
      vislam2tag plan site --spacing-m 20 --restart --out plan --write
    """
    from vislam2tag.preparation.planning.floor import STEPS

    settings = settings_of(given.config, _settings(given), given.site)
    request = api.PlanRequest(
        floors=given.floor,
        first_id=given.first_id,
        ignore_existing=given.ignore_existing,
        restart=given.restart,
        forbidden=given.forbid,
        mask=given.mask,
        write=given.write,
        walkable=settings.walkable,
        follow_links=given.follow_links,
    )
    with interrupted_with(f"no plan was written to {given.out}"), session_bar("steps") as bar:
        steps = len(STEPS) + 1
        advance = lambda _step, floors: bar.advance(floors * steps, error=None)
        result = api.plan(given.site, given.out, settings.plan, request, advance)
    unmet = any(one.unmet for one in result.floors)
    answer(result, given.json, lambda: _print_plan(result, given, unmet), failed=unmet)


def _settings(given: PlanOptions) -> dict[str, object]:
    """Settings from the options; raises UsageError for impossible angles of view."""
    view_rad = None
    if given.view_deg is not None:
        if not all(10 <= angle <= 170 for angle in given.view_deg):
            angles = f"{given.view_deg[0]:g} {given.view_deg[1]:g}"
            raise UsageError(f"--view-deg {angles}: expected angles of view between 10 and 170 degrees")
        view_rad = tuple(round(math.radians(angle), 4) for angle in given.view_deg)
    own = {"plan.sheets": given.paper or None, "plan.camera.field_of_view_rad": view_rad}
    return settings_given(given) | own


def _print_plan(result: api.PlanSummary, given: PlanOptions, unmet: bool) -> None:
    from vislam2tag.pipeline.site.plan import LANDMARKS_FILE, PAGE_FILE

    _print_floors(result)
    for floor in result.floors:
        if floor.dropped:
            done = "were dropped" if given.write else "are not used, and --write drops them"
            say(f"floor {floor.floor}: planned landmarks {', '.join(floor.dropped)} {done}")
        if floor.excluded_rooms:
            say(f"floor {floor.floor}: no walk goes into the excluded rooms {', '.join(floor.excluded_rooms)}")
        for note in _notes(floor):
            say(f"floor {floor.floor}: {note}")
    for finding in result.findings:
        say(f"{finding.severity}: {finding.file}: {finding.message}")
    new, fixed = (sum(map(len, each)) for each in zip(*((f.landmarks, f.fixed) for f in result.floors), strict=True))
    if not new and not unmet:
        say(
            f"no new landmark is needed: {fixed} are in the site already; to plan again, pass --restart (without "
            "planned landmarks) or --ignore-existing (without any)"
        )
    elif given.write and new:
        say(
            "the new landmarks were added to the site's marker_dict.csv files as planned; mapping uses them after you "
            "measure them (vislam2tag register), or with --use-planned"
        )
    page = given.out / PAGE_FILE
    say(f"page: {page}")
    after = "plan, unmet" if unmet else "plan" if new else "plan, none new"
    next_step(after, page=page, landmarks=given.out / LANDMARKS_FILE, site=given.site)


def _print_floors(result: api.PlanSummary) -> None:
    rows = []
    for floor in result.floors:
        counts = (str(len(floor.landmarks)), str(len(floor.fixed)), str(floor.bound), f"{floor.above_bound:.0%}")
        errors = (or_dash(floor.longest_m, "{:.1f} m"), or_dash(floor.expected_error_m, "{:.2f} m"))
        tour = (f"{floor.tour.length_m:.0f} m", f"{floor.tour.duration_s / 60:.0f} min")
        rows.append((f"{floor.floor} {floor.name}", f"{floor.corridors_m:.0f} m", *counts, *errors, *tour))
    numbers = ("corridors", "new", "fixed", "at least", "above", "longest gap", "expected error", "tour", "time")
    print_table("Landmarks", ("floor",), numbers, rows)


def _notes(floor: FloorPlanRecord) -> list[str]:
    notes = [finding.message for finding in floor.findings] + [unmet.message for unmet in floor.unmet]
    if floor.not_passed:
        notes.append(f"no route passes landmark {', '.join(floor.not_passed)}")
    if floor.on_a_line:
        notes.append(f"almost on one line with their neighbours: landmark {', '.join(floor.on_a_line)}")
    if floor.cut_short:
        notes.append("the time limit ended the search; increase --time-limit-s")
    return notes


@dataclass(frozen=True, kw_only=True)
class SheetsOptions:
    """Arguments and options of ``vislam2tag sheets``."""

    out: Path = option(..., "Output: a new or empty folder, or one from an earlier run.")
    site: Path | None = argument("Site folder or landmark file.", None, metavar="[SITE]")
    ids: str | None = option(None, "Landmarks to print, such as 1-40,lobby; needed without SITE.", metavar="LIST")
    paper: str | None = setting("sheets.paper")
    width_m: float | None = setting("sheets.width_m")
    seed: int | None = setting("sheets.seed")
    images: Path | None = option(None, "Folder with your own images, ID.png or ID.jpg.", metavar="FOLDER")
    tag: bool = option(False, "Also print an AprilTag (36h11); ids must be 0 to 586.")
    json: AsJson = False
    config: ConfigFile = None


@command
def sheets_command(given: SheetsOptions) -> None:
    """Make landmark sheets to print: one page each, in true size.

    Each sheet has an image that phones recognise. SITE is a site folder or a landmark file such as landmarks.csv of
    `plan`. Its columns are id, floor, x, y, z, sheet, width_m, near, floor_name and building, and all but id are
    optional. Without SITE, name the landmarks with --ids. An image depends only on the seed and the id, so that you can
    print a sheet again later. Each image is tested. Unsuitable ones are replaced, and similar ones refused. With
    --images you use your own images. Images that are too plain or too similar are refused.

    Writes OUT/sheets.pdf (print it at 100 %), OUT/images with manifest.csv for the phone app, and OUT/sheets.json. See
    docs/how-to/sheets.md for printing and docs/how-to/field-guide.md for hanging.

    Exit code: 0 written, 2 wrong usage or an unusable image, 130 interrupted.

    \b
    Examples:
      vislam2tag sheets survey --out sheets
      vislam2tag sheets plan/landmarks.csv --out sheets --paper A3
      vislam2tag sheets --ids 1-40,lobby --seed 7 --out sheets
      vislam2tag sheets --images photos --width-m 0.18 --out sheets
    """
    wanted = api.SheetOptions(given.site, given.ids, given.images, given.tag, settings_from(given).sheets)
    with interrupted_with(f"no sheet was written to {given.out}"), session_bar("images and pages") as bar:
        found = api.sheets(wanted, given.out, bar.count)
    _warn_of_other_paper(found, given)
    answer(found, given.json, lambda: _print_sheets(found, given))


def _print_sheets(found: api.SheetsRecord, given: SheetsOptions) -> None:
    from vislam2tag.preparation.sheets.features import ENOUGH_INLIERS
    from vislam2tag.preparation.sheets.sheet_folder import IMAGE_FOLDER, PDF_FILE, RECORD_FILE

    out = given.out
    _print_sizes(found)
    say(f"an image counts as recognised with {ENOUGH_INLIERS} matching features; details: {out / RECORD_FILE}")
    for finding in found.findings:
        where = f"{finding.file}: " if finding.file else ""
        say(f"{finding.severity}: {where}{finding.message}")
    say(f"for the phone: {out / IMAGE_FOLDER}")
    site = given.site if given.site is not None and given.site.is_dir() else "SITE"
    next_step("sheets", pdf=out / PDF_FILE, site=site)


def _warn_of_other_paper(found: api.SheetsRecord, given: SheetsOptions) -> None:
    """Warn if the landmark table names another paper than the option, which is for landmarks without one."""
    from vislam2tag.preparation.sheets.settings import sheet_size

    paper = given.paper
    if paper is None:
        return
    for other, count in Counter(page.sheet for page in found.pages).items():
        if other != sheet_size(paper).name:
            ones = f"{count} landmark, whose paper is" if count == 1 else f"{count} landmarks, whose paper is"
            say(f"warning: --paper {paper} was not used for {ones} {other} in the landmark table", err=given.json)


def _print_sizes(found: api.SheetsRecord) -> None:
    """One line for each size of paper and image."""
    rows = []
    images = {image.landmark: image for image in found.images}
    for (paper, width), count in Counter((page.sheet, page.width_m) for page in found.pages).items():
        there = {page.landmark for page in found.pages if (page.sheet, page.width_m) == (paper, width)}
        shown = [images[name] for name in there]
        features = min(image.quality.features for image in shown)
        inliers = min(image.quality.inliers for image in shown)
        alike = max(image.most_like_inliers for image in shown)
        rows.append((paper, f"{width:.3f} m", str(count), str(features), str(inliers), str(alike)))
    numbers = ("image width", "sheets", "fewest features", "fewest matches in a hard view", "most matches with another")
    print_table("Sheets", ("paper",), numbers, rows)
