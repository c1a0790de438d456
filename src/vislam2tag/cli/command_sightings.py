"""``vislam2tag sightings``."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from vislam2tag.cli.next_steps import next_step
from vislam2tag.cli.options import AsJson, SurveyFolder
from vislam2tag.cli.progress import interrupted_with, session_bar
from vislam2tag.cli.tables import table, table_console
from vislam2tag.cli.terminal import say_json

if TYPE_CHECKING:
    from rich.table import Table

    from vislam2tag.common.progress import Stage
    from vislam2tag.pipeline.labels.sightings import SightingsFound


HELP = """
Find landmarks in the pictures of walks that an iPhone or another camera recorded.

Such walks have poses and pictures, but nobody told their tracker of our landmarks. This looks for them: sheets that
`sheets` printed (--images, its folder OUT/images), with the tags on them where there are some, square tags (--tags with
--tag-side-m, whose numbers are the landmarks' ids), or QR codes (--qr-side-m). Each sighting gets a pose by the
camera's lens, and a standard deviation by the pixels.

Writes sightings.csv into each session's folder, beside the recording, which stays as it is; `process` reads it.
docs/how-to/iphone.md goes through a survey with an iPhone.

Exit code: 0 all sessions done, 1 at least one has no pictures that can be used, 2 wrong usage or not a survey, 130
interrupted.

\b
Examples:
  vislam2tag sightings survey --images sheets/images
  vislam2tag sightings survey --tags apriltag-36h11 --tag-side-m 0.16
"""


def register(app: typer.Typer) -> None:
    """Add the command to the application."""
    app.command("sightings", help=HELP)(_sightings)


def _sightings(
    survey: SurveyFolder,
    images: Annotated[Path | None, typer.Option(metavar="FOLDER", help="Images that `sheets` wrote.")] = None,
    tags: Annotated[
        str | None, typer.Option(metavar="FAMILY", help="Tags of this family; a wrong one lists all.")
    ] = None,
    tag_side_m: Annotated[
        float | None, typer.Option(min=0.01, help="Side of a tag's black square, metres.", show_default=False)
    ] = None,
    qr_side_m: Annotated[
        float | None,
        typer.Option(
            min=0.01, help="Side of QR codes whose text ends in the landmark's id, metres.", show_default=False
        ),
    ] = None,
    again: Annotated[bool, typer.Option("--again", help="Look anew where sightings.csv is there already.")] = False,
    json: AsJson = False,
) -> None:
    from vislam2tag.pipeline.labels.sightings import sightings

    done = 0

    def there() -> str:
        return f"{done} sessions have their sightings; the same command goes on" if done else "no session was finished"

    with interrupted_with(there), session_bar("sessions", lines=True) as bar:

        def told(one: SightingsFound, total: int) -> None:
            nonlocal done
            done += not one.error
            bar.advance(total, error=one.error or None)

        def within(stage: Stage, total: int) -> None:
            bar.reach(stage.done, total)

        found = sightings(survey, images, tags, tag_side_m, qr_side_m, again, told, within)
    if json:
        say_json(found)
    else:
        table_console().print(_table(found))
    failed = any(one.error for one in found) or all(one.skipped and not one.landmarks for one in found)
    if not json:
        next_step("sightings, failed" if failed else "sightings", survey=survey)
    raise typer.Exit(1 if failed else 0)


def _table(found: Sequence[SightingsFound]) -> Table:
    from rich.markup import escape

    rows = table("Sightings", ("session", "landmarks"), ("sightings", "doubtful", "pictures missing"))
    for one in found:
        what = escape(", ".join(one.landmarks)) or escape(one.skipped or one.error) or "none"
        rows.add_row(escape(one.session), what, str(one.sightings), str(one.doubtful), str(one.missing))
    return rows
