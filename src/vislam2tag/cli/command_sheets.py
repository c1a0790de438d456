"""``vislam2tag sheets``."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from vislam2tag.cli.next_steps import next_step
from vislam2tag.cli.options import AsJson
from vislam2tag.cli.progress import interrupted_with, session_bar
from vislam2tag.cli.records import argument, command, option
from vislam2tag.cli.settings_options import ConfigFile, setting, settings_from
from vislam2tag.cli.tables import print_table
from vislam2tag.cli.terminal import answer, say

if TYPE_CHECKING:
    from vislam2tag.preparation.sheets.sheet_folder import SheetsRecord


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
    from vislam2tag.preparation.sheets.sheet_folder import SheetOptions as Wanted
    from vislam2tag.preparation.sheets.sheet_folder import make_sheets

    wanted = Wanted(given.site, given.ids, given.images, given.tag, settings_from(given).sheets)
    with interrupted_with(f"{given.out} holds no new sheets"), session_bar("images and pages") as bar:
        found = make_sheets(wanted, given.out, bar.count)
    answer(found, given.json, lambda: _print(found, given.out))


def _print(found: SheetsRecord, out: Path) -> None:
    from vislam2tag.preparation.sheets.features import ENOUGH_INLIERS
    from vislam2tag.preparation.sheets.sheet_folder import IMAGE_FOLDER, PDF_FILE, RECORD_FILE

    _print_sheets(found)
    say(f"{ENOUGH_INLIERS} agreeing features count as recognised; of each image: {out / RECORD_FILE}")
    for finding in found.findings:
        where = f"{finding.file}: " if finding.file else ""
        say(f"{finding.severity}: {where}{finding.message}")
    say(f"for the phone: {out / IMAGE_FOLDER}")
    next_step("sheets", pdf=out / PDF_FILE)


def _print_sheets(found: SheetsRecord) -> None:
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
