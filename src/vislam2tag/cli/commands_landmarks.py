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
    out: Path = option(..., "Folder to write: new, empty or with plans.", metavar="P")
    floor: Floors = ()
    spacing_m: float | None = setting("plan.spacing_m")
    paper: tuple[str, ...] = option(
        (),
        "Size of paper to choose from; repeatable. [default: A4, A3]",
        metavar="SIZE",
        parse=lambda text, _: sheet_size(text).name,
    )
    forbid: Path | None = option(
        None, "Rectangles without landmarks: CSV with floor,x0,y0,x1,y1, metres.", metavar="FILE"
    )
    mask: Path | None = option(None, "With one --floor: green can be walked, red cannot.", metavar="IMAGE")
    anew: bool = option(
        False, "Leave the landmarks that the site has out of account; --write then adds to them all the same."
    )
    rooms: bool | None = setting("plan.rooms", hidden=True)
    view_deg: tuple[float, float] | None = option(
        None, "The camera's angles of view, degrees.  [default: 67 53]", metavar="LONG SHORT", hidden=True
    )
    nearest_m: float | None = setting("plan.camera.nearest_m", hidden=True)
    speed_m_s: float | None = setting("plan.speed_m_s", hidden=True)
    further: int | None = setting("plan.further", hidden=True)
    first_id: int = option(1, "New landmarks are numbered from this on.", least=0)
    time_limit_s: float | None = setting("plan.time_limit_s", hidden=True)
    follow_links: FollowLinks = False
    json: AsJson = False
    config: ConfigFile = None
    write: bool = option(False, "Also add the new landmarks to the site's marker_dict.csv files.")


@command
def plan_command(given: PlanOptions) -> None:
    """Plan where landmarks stand: as few as can be, so that every walk passes one after each critical turn and never
    goes farther than a set distance without one.

    Reads the site's plans. Landmarks that the site has already stay where they are; new ones hang on walls that a
    passer-by faces, off doors and corners, on sheets large enough to be recognised in passing. Writes P/landmarks.csv,
    each floor's plan with the tour to walk, a map of the label sigma to expect with what further landmarks would gain
    (PNG and PDF), plan.json and index.html. docs/explanation/planning.md tells how.

    Exit code: 0 all right, 1 some demand cannot be met (a line says which), 2 wrong usage, no site, a floor that cannot
    be planned, or P cannot be written, 130 interrupted.

    \b
    Examples:
      vislam2tag plan site --out plan
      vislam2tag plan site --floor 3 --spacing-m 12 --paper A4 --out plan
      vislam2tag plan site --forbid glass.csv --first-id 101 --out plan --write
    """
    from vislam2tag.preparation.planning.floor import STEPS

    settings = settings_of(given.config, _settings(given), given.site)
    request = api.PlanRequest(
        given.floor,
        given.first_id,
        given.anew,
        given.forbid,
        given.mask,
        given.write,
        settings.walkable,
        given.follow_links,
    )
    with interrupted_with(f"{given.out} holds no new plans"), session_bar("steps") as bar:
        steps = len(STEPS) + 1
        advance = lambda _step, floors: bar.advance(floors * steps, error=None)
        result = api.plan(given.site, given.out, settings.plan, request, advance)
    unmet = any(one.unmet for one in result.floors)
    answer(result, given.json, lambda: _print_plan(result, given, unmet), failed=unmet)


def _settings(given: PlanOptions) -> dict[str, object]:
    """Settings that the options give; raises UsageError for angles that no camera has."""
    view_rad = None
    if given.view_deg is not None:
        if not all(10 <= angle <= 170 for angle in given.view_deg):
            angles = f"{given.view_deg[0]:g} {given.view_deg[1]:g}"
            raise UsageError(f"--view-deg {angles}: angles of view lie between 10 and 170 degrees")
        view_rad = tuple(round(math.radians(angle), 4) for angle in given.view_deg)
    own = {"plan.sheets": given.paper or None, "plan.camera.field_of_view_rad": view_rad}
    return settings_given(given) | own


def _print_plan(result: api.PlanSummary, given: PlanOptions, unmet: bool) -> None:
    from vislam2tag.pipeline.site.plan import LANDMARKS_FILE, PAGE_FILE

    _print_floors(result)
    for floor in result.floors:
        for note in _notes(floor):
            say(f"floor {floor.floor}: {note}")
    for finding in result.findings:
        say(f"{finding.severity}: {finding.file}: {finding.message}")
    if given.write:
        say(
            "the new landmarks are in the site's marker_dict.csv files as planned; commands that map walks use them "
            "once they are measured (vislam2tag register), or with --use-planned"
        )
    page = given.out / PAGE_FILE
    say(f"page: {page}")
    next_step("plan, unmet" if unmet else "plan", page=page, landmarks=given.out / LANDMARKS_FILE)


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
        notes.append(f"no way leads past landmark {', '.join(floor.not_passed)}")
    if floor.on_a_line:
        notes.append(f"next to one line with their neighbours: landmark {', '.join(floor.on_a_line)}")
    if floor.cut_short:
        notes.append("the time limit ended the search; --time-limit-s takes longer")
    return notes


@dataclass(frozen=True, kw_only=True)
class SheetsOptions:
    """Arguments and options of ``vislam2tag sheets``."""

    out: Path = option(..., "Folder to write: new, empty or with sheets.")
    site: Path | None = argument("Site's folder or file of landmarks.", None, metavar="[SITE]")
    ids: str | None = option(None, "Only these landmarks, or all of them without SITE: 1-40,lobby.", metavar="LIST")
    paper: str | None = setting("sheets.paper")
    width_m: float | None = setting("sheets.width_m")
    seed: int | None = setting("sheets.seed")
    images: Path | None = option(
        None, "Your own images, ID.png or ID.jpg, in place of generated ones.", metavar="FOLDER"
    )
    tag: bool = option(False, "Print an AprilTag (36h11) below the picture; ids are 0 to 586.")
    json: AsJson = False
    config: ConfigFile = None


@command
def sheets_command(given: SheetsOptions) -> None:
    """Make landmarks to print: one sheet each, in true size, with an image that phones recognise.

    SITE is a site's folder (its landmarks), or a file such as landmarks.csv of `plan` (columns id, floor, x, y, z,
    sheet, width_m; all but the id optional); without it, --ids names them. Images are generated from seed and id alone:
    the same seed gives the same image, whatever else is printed. Each is measured, and none is made that could be taken
    for another. With --images they are your own (ID.png or .jpg); those too plain or too like another are refused by
    name.

    Writes OUT/sheets.pdf (print at 100 %), OUT/images with manifest.csv (id,file,width_m), which the phone app loads,
    and OUT/sheets.json (what was measured of each). docs/how-to/sheets.md tells more, docs/how-to/field-guide.md how to
    hang them.

    Exit code: 0 written, 2 wrong usage, an image that cannot be used, or OUT cannot be written, 130 interrupted.

    \b
    Examples:
      vislam2tag sheets survey --out sheets
      vislam2tag sheets plan/landmarks.csv --out sheets --paper A3
      vislam2tag sheets --ids 1-40,lobby --seed 7 --out sheets
      vislam2tag sheets --images photos --width-m 0.2 --out sheets
    """
    wanted = api.SheetOptions(given.site, given.ids, given.images, given.tag, settings_from(given).sheets)
    with interrupted_with(f"{given.out} holds no new sheets"), session_bar("images and pages") as bar:
        found = api.sheets(wanted, given.out, bar.count)
    answer(found, given.json, lambda: _print_sheets(found, given.out))


def _print_sheets(found: api.SheetsRecord, out: Path) -> None:
    from vislam2tag.preparation.sheets.features import ENOUGH_INLIERS
    from vislam2tag.preparation.sheets.sheet_folder import IMAGE_FOLDER, PDF_FILE, RECORD_FILE

    _print_sizes(found)
    say(f"{ENOUGH_INLIERS} agreeing features count as recognised; of each image: {out / RECORD_FILE}")
    for finding in found.findings:
        where = f"{finding.file}: " if finding.file else ""
        say(f"{finding.severity}: {where}{finding.message}")
    say(f"for the phone: {out / IMAGE_FOLDER}")
    next_step("sheets", pdf=out / PDF_FILE)


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
    numbers = ("image width", "sheets", "features, least", "agreeing in a hard view, least", "with another image, most")
    print_table("Sheets", ("paper",), numbers, rows)
