"""``sheets`` as its users meet it."""

from __future__ import annotations

import json
import shutil
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from tests.cli.command import the_error, vislam2tag
from tests.preparation.sheets.printed import printed
from tests.site.site import write_survey
from tests.surveys import bytes_of
from vislam2tag.preparation.sheets.images import dead_leaves_picture


def test_a_site_gets_a_sheet_for_each_landmark(tmp_path: Path) -> None:
    survey = write_survey(tmp_path / "survey")
    raw = bytes_of(survey)
    done = vislam2tag("sheets", survey, "--out", tmp_path / "out", "--paper", "letter")
    assert (done.returncode, done.stderr) == (0, "")
    assert "Letter" in done.stdout
    assert "0.196 m" in done.stdout
    assert "warning: landmarks 10, 7 hang on several floors with one image" in done.stdout
    assert (
        f"for the phone: {tmp_path / 'out/images'}\nnext: print {tmp_path / 'out/sheets.pdf'} at 100 %" in done.stdout
    )
    assert (tmp_path / "out/images/manifest.csv").read_text() == "id,file,width_m\n10,10.png,0.196\n7,7.png,0.196\n"
    assert "floor 4" in printed(tmp_path / "out/sheets.pdf", 3, dpi=25.4).text
    assert len(json.loads((tmp_path / "out/sheets.json").read_text())["pages"]) == 4
    assert bytes_of(survey) == raw


def test_ids_alone_and_the_same_bytes_again(tmp_path: Path) -> None:
    for name in ("a", "b"):
        done = vislam2tag("sheets", "--ids", "1-3,lobby", "--seed", "7", "--out", tmp_path / name)
        assert (done.returncode, done.stderr) == (0, "")
    assert bytes_of(tmp_path / "a") == bytes_of(tmp_path / "b")
    assert "lobby,lobby.png,0.19" in (tmp_path / "a/images/manifest.csv").read_text()


def test_a_file_gives_seed_and_paper_and_options_win(tmp_path: Path) -> None:
    (tmp_path / "own.toml").write_text("[sheets]\nseed = 7\npaper = 'A3'\n")
    for name, *options in (("file", "--config", tmp_path / "own.toml", "--paper", "A4"), ("typed", "--seed", "7")):
        assert vislam2tag("sheets", "--ids", "1", "--out", tmp_path / name, *options).returncode == 0
    assert (tmp_path / "file" / "sheets.pdf").read_bytes() == (tmp_path / "typed" / "sheets.pdf").read_bytes()


def test_own_images_keep_their_width(tmp_path: Path) -> None:
    own = tmp_path / "own"
    own.mkdir()
    for name in ("1", "2"):
        Image.fromarray(dead_leaves_picture(3, name)).save(own / f"{name}.png", optimize=True)
    done = vislam2tag("sheets", "--images", own, "--width-m", "0.1", "--out", tmp_path / "out")
    assert (done.returncode, done.stderr) == (0, "")
    assert (tmp_path / "out/images/manifest.csv").read_text() == "id,file,width_m\n1,1.png,0.1\n2,2.png,0.1\n"
    assert (tmp_path / "out/images/1.png").read_bytes() == (own / "1.png").read_bytes()


@pytest.fixture(name="photos")
def _photos(tmp_path: Path) -> Path:
    folder = tmp_path / "photos"
    folder.mkdir()
    Image.fromarray(np.zeros((400, 400), np.uint8)).save(folder / "black.png")
    return folder


def test_wrong_usage_is_2_with_one_line_and_nothing_written(tmp_path: Path, photos: Path) -> None:
    survey = write_survey(tmp_path / "survey")
    full = tmp_path / "full"
    shutil.copytree(survey, full)
    raw = bytes_of(full)
    for arguments, message in (
        (("--ids", "1,01"), "'1' and '01' are one id, 1; name each once"),
        ((survey, "--paper", "B5"), "'B5' is no size of paper; there are: A4, Letter, A3"),
        (("--images", photos), "1 of 1 images cannot be landmarks: black.png (contrast 0, 30 is needed"),
    ):
        assert message in the_error(vislam2tag("sheets", *arguments, "--out", tmp_path / "out"))
    assert not (tmp_path / "out").exists()
    assert "is not empty and was not made by this command" in the_error(
        vislam2tag("sheets", "--ids", "1", "--out", full)
    )
    assert bytes_of(full) == raw
