"""Surveys with links to private files beside them, and whether anything of those is in what a command made."""

from __future__ import annotations

import base64
import io
import re
from pathlib import Path

import numpy as np
from PIL import Image

from tests.surveys import make_survey

PRIVATE = (255, 0, 255)
"""Colour of the private picture, which no plan or page has."""
_SHADES = 40
_SEEN_PIXELS = 20
_DATA_URI = re.compile(rb"data:image/(?:png|jpeg);base64,([A-Za-z0-9+/=]+)")


def survey_beside_private(folder: Path, *, sessions: int = 2) -> Path:
    """Write a survey of one floor into ``folder``, and a private picture beside it."""
    survey = make_survey(folder / "survey", devices=("LG",), sessions=sessions, seconds=60.0, seed=6)
    pixels = np.full((60, 80, 3), 255, np.uint8)
    pixels[20:40, 20:60] = PRIVATE
    Image.fromarray(pixels).save(folder / "private.png")
    return survey


def link_plan(survey: Path) -> None:
    """Put a link to the private picture in the place of the floor's plan, as an attacker would."""
    for plan in survey.glob("floor_0/floorplan.*"):
        plan.unlink()
    (survey / "floor_0" / "floorplan.png").symlink_to("../../private.png")


def move_out(path: Path, place: Path) -> None:
    """Move a file or folder out of a survey and put a link to it there."""
    place.parent.mkdir(parents=True, exist_ok=True)
    path.rename(place)
    path.symlink_to(place)


def annex(repository: Path, survey: Path) -> None:
    """Move each file of a survey among git-annex's objects, beside the survey, and put a link in its place."""
    for number, path in enumerate(sorted(path for path in survey.rglob("*") if path.is_file())):
        move_out(path, repository / ".git" / "annex" / "objects" / f"{number:02x}" / f"SHA256E-{number}{path.suffix}")


def private_pictures(folder: Path) -> list[str]:
    """Files below a folder (or the one file) that show the private picture."""
    files = [folder] if folder.is_file() else sorted(path for path in folder.rglob("*") if path.is_file())
    return [path.relative_to(folder.parent).as_posix() for path in files if _shows_private(path)]


def _shows_private(path: Path) -> bool:
    content = path.read_bytes()
    text = content.replace(rb"\u002f", b"/")  # as figures within pages write it
    pictures = [base64.b64decode(found) for found in _DATA_URI.findall(text)]
    if path.suffix in (".png", ".jpg", ".jpeg"):
        pictures.append(content)
    return any(_has_private_colour(picture) for picture in pictures)


def _has_private_colour(picture: bytes) -> bool:
    with Image.open(io.BytesIO(picture)) as image:
        pixels = np.asarray(image.convert("RGB")).astype(int)
    red, green, blue = (pixels[..., i] for i in range(3))
    # figures draw plans pale, over white: the colour keeps its hue
    return int(((red - green > _SHADES) & (blue - green > _SHADES) & (abs(red - blue) < _SHADES)).sum()) > _SEEN_PIXELS
