"""``vislam2tag sheets``."""

from __future__ import annotations

from collections import Counter
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from vislam2tag.cli.next_steps import next_step
from vislam2tag.cli.options import INTERRUPTED, AsJson
from vislam2tag.cli.progress import session_bar
from vislam2tag.cli.settings_options import ConfigFile, setting, settings_of
from vislam2tag.cli.tables import table, table_console
from vislam2tag.cli.terminal import say, say_json

if TYPE_CHECKING:
    from rich.table import Table

    from vislam2tag.sheets.sheet_folder import SheetsRecord


HELP = """
Make landmarks to print: one sheet each, in true size, with an image that phones recognise.

SITE is a site's folder (its landmarks), or a file such as landmarks.csv of `plan` (columns id, floor, x, y, z, sheet,
width_m; all but the id optional); without it, --ids names them. Images are generated from seed and id alone: the same
seed gives the same image, whatever else is printed. Each is measured, and none is made that could be taken for another.
With --images they are your own (ID.png or .jpg); those too plain or too like another are refused by name.

Writes OUT/sheets.pdf (print at 100 %), OUT/images with manifest.csv (id,file,width_m), which the phone app
loads, and OUT/sheets.json (what was measured of each). docs/how-to/sheets.md tells more, docs/how-to/field-guide.md how
to hang them.

Exit code: 0 written, 2 wrong usage, an image that cannot be used, or OUT cannot be written, 130 interrupted.

\b
Examples:
  vislam2tag sheets survey --out sheets
  vislam2tag sheets plan/landmarks.csv --out sheets --paper A3
  vislam2tag sheets --ids 1-40,lobby --seed 7 --out sheets
  vislam2tag sheets --images photos --width-m 0.2 --out sheets
"""


def register(app: typer.Typer) -> None:
    """Add the command to the application."""
    app.command("sheets", help=HELP)(_sheets)


def _sheets(
    out: Annotated[Path, typer.Option(help="Folder to write: new, empty or with sheets.")],
    site: Annotated[Path | None, typer.Argument(metavar="[SITE]", help="Site's folder or file of landmarks.")] = None,
    ids: Annotated[
        str | None, typer.Option(metavar="LIST", help="Only these landmarks, or all of them without SITE: 1-40,lobby.")
    ] = None,
    paper: Annotated[str | None, setting("sheets.paper")] = None,
    width_m: Annotated[float | None, setting("sheets.width_m")] = None,
    seed: Annotated[int | None, setting("sheets.seed")] = None,
    images: Annotated[
        Path | None,
        typer.Option(metavar="FOLDER", help="Your own images, ID.png or ID.jpg, in place of generated ones."),
    ] = None,
    tag: Annotated[
        bool,
        typer.Option("--tag", help="Print an AprilTag (36h11) below the picture; ids are 0 to 586."),
    ] = False,
    json: AsJson = False,
    config: ConfigFile = None,
) -> None:
    from vislam2tag.sheets.making import SheetOptions, make_sheets
    from vislam2tag.sheets.sheet_folder import PDF_FILE

    settings = settings_of(config, {"sheets.paper": paper, "sheets.width_m": width_m, "sheets.seed": seed})
    options = SheetOptions(site, ids, images, tag, settings.sheets)
    try:
        with session_bar("images and pages") as bar:
            found = make_sheets(options, out, lambda _done, total: bar.advance(total, error=None))
    except KeyboardInterrupt:
        say(f"interrupted: {out} holds no new sheets", err=True)
        raise typer.Exit(INTERRUPTED) from None
    if json:
        say_json(found)
    else:
        _print(found, out)
        next_step("sheets", pdf=out / PDF_FILE)


def _print(found: SheetsRecord, out: Path) -> None:
    from rich.markup import escape

    from vislam2tag.sheets.recognition import ENOUGH_INLIERS
    from vislam2tag.sheets.sheet_folder import IMAGE_FOLDER, RECORD_FILE

    console = table_console()
    console.print(_table(found))
    console.print(
        f"{ENOUGH_INLIERS} agreeing features count as recognised; of each image: {out / RECORD_FILE}", soft_wrap=True
    )
    for finding in found.findings:
        where = f"{finding.file}: " if finding.file else ""
        console.print(f"{finding.severity}: {escape(where + finding.message)}", soft_wrap=True)
    say(f"for the phone: {out / IMAGE_FOLDER}")


def _table(found: SheetsRecord) -> Table:
    """One line for each size of paper and image."""
    numbers = ("image width", "sheets", "features, least", "agreeing in a hard view, least", "with another image, most")
    rows = table("Sheets", ("paper",), numbers)
    images = {image.landmark: image for image in found.images}
    for (paper, width), count in Counter((page.sheet, page.width_m) for page in found.pages).items():
        there = {page.landmark for page in found.pages if (page.sheet, page.width_m) == (paper, width)}
        shown = [images[name] for name in there]
        rows.add_row(
            paper,
            f"{width:.3f} m",
            str(count),
            str(min(image.quality.features for image in shown)),
            str(min(image.quality.inliers for image in shown)),
            str(max(image.most_like_inliers for image in shown)),
        )
    return rows
