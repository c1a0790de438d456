"""``vislam2tag sightings``."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from vislam2tag.cli.next_steps import next_step
from vislam2tag.cli.options import AsJson, SurveyFolder
from vislam2tag.cli.progress import interrupted_with, session_bar
from vislam2tag.cli.records import command, option
from vislam2tag.cli.tables import print_table
from vislam2tag.cli.terminal import answer

if TYPE_CHECKING:
    from vislam2tag.common.progress import Stage
    from vislam2tag.pipeline.labels.sightings import SightingsFound


@command
def sightings_command(
    *,
    survey: SurveyFolder,
    images: Path | None = option(None, "Images that `sheets` wrote.", metavar="FOLDER"),
    tags: str | None = option(None, "Tags of this family; a wrong one lists all.", metavar="FAMILY"),
    tag_side_m: float | None = option(None, "Side of a tag's black square, metres.", least=0.01),
    qr_side_m: float | None = option(
        None, "Side of QR codes whose text ends in the landmark's id, metres.", least=0.01
    ),
    again: bool = option(False, "Look anew where sightings.csv is there already."),
    json: AsJson = False,
) -> None:
    """Find landmarks in the pictures of walks that an iPhone or another camera recorded.

    Such walks have poses and pictures, but nobody told their tracker of our landmarks. This looks for them: sheets that
    `sheets` printed (--images, its folder OUT/images), with the tags on them where there are some, square tags (--tags
    with --tag-side-m, whose numbers are the landmarks' ids), or QR codes (--qr-side-m). Each sighting gets a pose by
    the camera's lens, and a standard deviation by the pixels.

    Writes sightings.csv into each session's folder, beside the recording, which stays as it is; `process` reads it.
    docs/how-to/iphone.md goes through a survey with an iPhone.

    Exit code: 0 all sessions done, 1 at least one has no pictures that can be used, 2 wrong usage or not a survey, 130
    interrupted.

    \b
    Examples:
      vislam2tag sightings survey --images sheets/images
      vislam2tag sightings survey --tags apriltag-36h11 --tag-side-m 0.16
    """
    from vislam2tag.pipeline.labels.sightings import sightings

    done = 0

    def there() -> str:
        return f"{done} sessions have their sightings; the same command goes on" if done else "no session was finished"

    with interrupted_with(there), session_bar("sessions", lines=True) as bar:

        def finished(one: SightingsFound, total: int) -> None:
            nonlocal done
            done += not one.error
            bar.advance(total, error=one.error or None)

        def within(stage: Stage, total: int) -> None:
            bar.reach(stage.done, total)

        found = sightings(survey, images, tags, tag_side_m, qr_side_m, again, finished, within)
    failed = any(one.error for one in found) or all(one.skipped and not one.landmarks for one in found)
    after = "sightings, failed" if failed else "sightings"
    answer(found, json, lambda: _print(found, survey, after), failed=failed)


def _print(found: Sequence[SightingsFound], survey: Path, after: str) -> None:
    rows = []
    for one in found:
        what = ", ".join(one.landmarks) or one.skipped or one.error or "none"
        rows.append((one.session, what, str(one.sightings), str(one.doubtful), str(one.missing)))
    print_table("Sightings", ("session", "landmarks"), ("sightings", "doubtful", "pictures missing"), rows)
    next_step(after, survey=survey)
