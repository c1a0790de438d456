"""AprilTags beside the picture: any camera recognises them, so that one sheet serves ARCore and others."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np
import polars as pl

from vislam2tag.common.errors import SurveyError, UsageError
from vislam2tag.common.files.table_files import read_csv
from vislam2tag.common.text_tables import csv_rows
from vislam2tag.preparation.sheets.page_layout import Box, PageLayout
from vislam2tag.site.names import landmark_id
from vislam2tag.site.sheet_size import QUIET_M

TAG_FAMILY, TAG_COUNT = "apriltag-36h11", 587
"""Its numbers differ in 11 modules at least, and are 0 to 586."""
TAG_FILE = "tags.csv"
"""Beside the images: ``id,family,number,side_m,right_m,up_m``."""
_SIDE_UNITS, _GAP_UNITS = 56, 8
_MODULES = 8
_SCHEMA = {
    "id": pl.String,
    "family": pl.String,
    "number": pl.Int64,
    **dict.fromkeys(("side_m", "right_m", "up_m"), pl.Float64),
}


@dataclass(frozen=True)
class SheetTag:
    """A tag on a sheet: its number, the side of its black square, and its centre from that of the picture, metres to
    the right and up as one looks at the sheet.
    """

    number: int
    side_m: float
    right_m: float
    up_m: float


def tag_number(landmark: str) -> int:
    """The number of a landmark's tag, which is its id; raises UsageError where the family has no such number."""
    if not landmark.isascii() or not landmark.isdecimal() or int(landmark) >= TAG_COUNT:
        raise UsageError(
            f"landmark {landmark}: a tag of {TAG_FAMILY} has a number from 0 to {TAG_COUNT - 1}, which must be the id: "
            "give the landmark such an id, or print without --tag"
        )
    return int(landmark)


def tag_box(layout: PageLayout) -> Box:
    """Where a sheet's tag stands: below the picture, at the right, its side a whole number of millimetres."""
    top = layout.foot_m - _GAP_UNITS * layout.unit_m
    side = int(1000 * min(_SIDE_UNITS * layout.unit_m, top - QUIET_M)) / 1000
    return Box(layout.paper.width_m - QUIET_M - side, top - side, side, side)


def sheet_tag(number: int, layout: PageLayout) -> SheetTag:
    """The tag of a sheet, as it is printed."""
    box = tag_box(layout)
    (x, y), (image_x, image_y) = box.centre_m, layout.image.centre_m
    return SheetTag(number, box.width_m, round(x - image_x, 6), round(y - image_y, 6))


def tag_modules(number: int) -> list[bytes]:
    """Rows of a tag's modules from above, black is 1, with its black edge."""
    dictionary = cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_APRILTAG_36h11)
    drawn = np.asarray(cv2.aruco.generateImageMarker(dictionary, number, _MODULES, borderBits=1))
    return [bytes(row) for row in (drawn < 128).astype(np.uint8)]


def tag_rows(tags: dict[str, SheetTag]) -> str:
    """The content of :data:`TAG_FILE`."""
    rows = (
        (landmark, TAG_FAMILY, str(tag.number), *(f"{value:g}" for value in (tag.side_m, tag.right_m, tag.up_m)))
        for landmark, tag in tags.items()
    )
    return csv_rows((tuple(_SCHEMA), *rows))


def read_tags(images: Path) -> dict[str, SheetTag]:
    """Read the tags of a folder of images by landmark; none where the sheets were printed without.

    Raises SurveyError where the file is not understood.
    """
    path = images / TAG_FILE
    if not path.is_file():
        return {}
    try:
        rows = read_csv(path, schema=_SCHEMA).drop_nulls()
    except (OSError, pl.exceptions.PolarsError) as error:
        raise SurveyError(f"{path}: expected {','.join(_SCHEMA)} as `vislam2tag sheets` writes it ({error})") from error
    return {landmark_id(row[0]): SheetTag(*row[2:]) for row in rows.iter_rows()}
