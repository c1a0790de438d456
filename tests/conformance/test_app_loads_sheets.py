"""The app's own loader of landmarks, on the folder that `vislam2tag sheets` writes."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import cv2
import numpy as np
import polars as pl
import pytest

pytestmark = pytest.mark.slow

LOADER = "org.vislam2tag.tools.LandmarksMain"


def test_the_app_takes_every_sheet_and_names_a_plain_one(core: Path, tmp_path: Path) -> None:
    command = ["sheets", "--ids", "1-3,lobby", "--width-m", "0.175", "--out", str(tmp_path / "sheets")]
    subprocess.run([sys.executable, "-m", "vislam2tag", *command], capture_output=True, timeout=120, check=True)
    images = tmp_path / "sheets" / "images"
    assert loaded(core, images) == (
        ["1\t1.png\t0.175", "2\t2.png\t0.175", "3\t3.png\t0.175", "lobby\tlobby.png\t0.175"],
        "",
    )
    white = np.full((640, 640), 250, np.uint8)
    cv2.imwrite(str(images / "2.png"), white)
    rows, refused = loaded(core, images)
    assert [row.split("\t")[0] for row in rows] == ["1", "3", "lobby"]
    assert refused == "2 too_plain: 640 x 640 pixels, contrast 0, 0 corners in 0 of 64 places\n"


def loaded(core: Path, images: Path) -> tuple[list[str], str]:
    """The landmarks that the app takes, and what it says of the others; where decimal commas are usual."""
    assert pl.read_csv(images / "manifest.csv").columns == ["id", "file", "width_m"]
    command = ["java", "-Duser.language=de", "-Duser.country=DE", "-cp", str(core), LOADER, str(images)]
    done = subprocess.run(command, capture_output=True, text=True, timeout=120, check=True)
    return done.stdout.splitlines(), done.stderr
