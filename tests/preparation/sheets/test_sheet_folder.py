"""The folder that is written: manifest, images, record; and sets that cannot be.

All steps together: which images go with which landmarks, and the count of steps.
"""

from __future__ import annotations

import csv
import json
import re
from pathlib import Path

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st
from PIL import Image

from tests.surveys import bytes_of
from vislam2tag.common.errors import OutputError, SurveyError, UsageError
from vislam2tag.common.files.own_files import OWN_FILES
from vislam2tag.common.files.whole_output import whole_folder
from vislam2tag.common.progress import silent
from vislam2tag.preparation.sheets.images import LandmarkImage, dead_leaves_picture, generated_image
from vislam2tag.preparation.sheets.settings import SHEET_SIZES, SheetSettings
from vislam2tag.preparation.sheets.sheet_folder import (
    SheetOptions,
    SheetsRecord,
    checked_lookalikes,
    image_names,
    is_sheets,
    lay_out_sheets,
    make_sheets,
    sheets_record,
    write_sheets,
)
from vislam2tag.preparation.sheets.sheet_requests import SheetRequest

A4 = SHEET_SIZES["A4"]


@pytest.fixture(scope="module", name="images")
def _images() -> list[LandmarkImage]:
    return [generated_image(0, name) for name in ("7", 'a,"b', "日")]


def write(out: Path, requests: list[SheetRequest], images: list[LandmarkImage]) -> SheetsRecord:
    sheets = lay_out_sheets(requests, images, A4, None)
    with whole_folder(out, is_sheets) as folder:
        record = sheets_record(sheets, images, checked_lookalikes(images, 0, silent), 0)
        write_sheets(folder, record, sheets, images)
    return record


def test_the_phone_finds_each_image_with_its_width(images: list[LandmarkImage], tmp_path: Path) -> None:
    requests = [SheetRequest("7"), SheetRequest('a,"b', sheet=SHEET_SIZES["A3"]), SheetRequest("日", width_m=0.1)]
    record = write(tmp_path / "out", requests, images)
    with (tmp_path / "out/images/manifest.csv").open(encoding="utf-8", newline="") as file:
        rows = list(csv.DictReader(file))
    assert [(row["id"], row["width_m"]) for row in rows] == [("7", "0.19"), ('a,"b', "0.277"), ("日", "0.1")]
    for row, image in zip(rows, images, strict=True):
        with Image.open(tmp_path / "out/images" / row["file"]) as loaded:
            assert loaded.mode == "L"
            np.testing.assert_array_equal(np.array(loaded), image.pixels)
    assert sorted(bytes_of(tmp_path / "out")) == sorted(
        [OWN_FILES, "sheets.pdf", "sheets.json", "images/manifest.csv", *(one.file for one in record.images)]
    )


def test_the_record_tells_what_was_measured(images: list[LandmarkImage], tmp_path: Path) -> None:
    requests = [SheetRequest("7", floor=1), SheetRequest("7", floor=2), SheetRequest('a,"b'), SheetRequest("日")]
    record = write(tmp_path / "out", requests, images)
    told = json.loads((tmp_path / "out/sheets.json").read_text())
    assert SheetsRecord.model_validate(told) == record
    assert [(page["page"], page["landmark"], page["floor"], page["code"]) for page in told["pages"]] == [
        (1, "7", 1, "1/7"),
        (2, "7", 2, "2/7"),
        (3, 'a,"b', None, 'a,"b'),
        (4, "日", None, "日"),
    ]
    assert [one["attempt"] for one in told["images"]] == [0, 0, 0]
    assert all(one["quality"]["features"] > 1500 and one["most_like_inliers"] < 20 for one in told["images"])
    assert [finding["kind"] for finding in told["findings"]] == ["same_image", "unprintable_id"]
    assert told["findings"][0]["message"].startswith("landmarks 7 have the same image on several floors")


def test_one_id_has_one_width(images: list[LandmarkImage]) -> None:
    requests = [SheetRequest("7", floor=1, sheet=SHEET_SIZES["A3"]), SheetRequest("7", floor=2)]
    with pytest.raises(UsageError, match=r"landmark 7: its image is 0.277 m wide on one floor, 0.19 m on another"):
        lay_out_sheets(requests, images, A4, None)
    same = lay_out_sheets(requests, images, A4, 0.15)
    assert [sheet.layout.image.width_m for sheet in same] == [0.15, 0.15]
    assert [sheet.layout.paper.name for sheet in same] == ["A3", "A4"]


def test_a_tall_image_fits_by_its_height(images: list[LandmarkImage]) -> None:
    tall = np.vstack((dead_leaves_picture(0, "1"), dead_leaves_picture(0, "2")))
    image = LandmarkImage("7", tall, images[0].features, images[0].quality)
    (sheet,) = lay_out_sheets([SheetRequest("7")], [image], A4, None)
    assert (sheet.layout.image.width_m, sheet.layout.image.height_m) == pytest.approx((0.095, 0.19))


def test_images_that_would_be_confused_are_refused(images: list[LandmarkImage]) -> None:
    copy = LandmarkImage("copy", images[0].pixels, images[0].features, images[0].quality)
    with pytest.raises(SurveyError, match="these images would be confused: 7 and copy; replace one of each"):
        checked_lookalikes([*images, copy], None, silent)
    with pytest.raises(UsageError, match="--seed 4: these images would be confused: 7 and copy; choose another"):
        checked_lookalikes([*images, copy], 4, silent)


def test_only_folders_with_sheets_are_replaced(images: list[LandmarkImage], tmp_path: Path) -> None:
    out = tmp_path / "out"
    assert not is_sheets(out)
    write(out, [SheetRequest("7")], images[:1])
    assert is_sheets(out)
    write(out, [SheetRequest("日")], images[2:])
    assert not (out / "images/7.png").exists()
    (out / "sheets.json").write_text("{}")
    assert not is_sheets(out)


SAFE = re.compile(r"[A-Za-z0-9_-][A-Za-z0-9._-]*\.png")


def test_plain_ids_are_their_own_names() -> None:
    assert image_names(["7", "lobby", "A-12", "b.3"]) == ("7.png", "lobby.png", "A-12.png", "b.3.png")


@given(ids=st.lists(st.text(min_size=1), unique=True, min_size=1, max_size=8))
@example(ids=["..", ".", "...", ":", "::"])
@example(ids=["a", "A", "a/b", "a:b", "a b", "ab", "a\\b"])
@example(ids=["CON", "con", "nul.x", "com1", "console"])
@example(ids=["é", "è", "日本", "-"])
@example(ids=["x" * 300, "x" * 301])
def test_names_are_safe_and_differ_on_every_file_system(ids: list[str]) -> None:
    names = image_names(ids)
    assert len({name.lower() for name in names}) == len(ids)
    for name in names:
        assert SAFE.fullmatch(name), name
        assert len(name) <= 140
        assert not re.fullmatch(r"(?i)(con|prn|aux|nul|com\d|lpt\d)(\..*)?", name)
    assert image_names(ids) == names


@pytest.fixture(name="own")
def _own(tmp_path: Path) -> Path:
    folder = tmp_path / "own"
    folder.mkdir()
    for name in ("3", "4", "spare"):
        Image.fromarray(dead_leaves_picture(8, name)).save(folder / f"{name}.png")
    return folder


def test_every_step_is_told(tmp_path: Path) -> None:
    steps: list[tuple[int, int]] = []
    make_sheets(SheetOptions(ids="1-3"), tmp_path / "out", lambda *told: steps.append(told))
    assert steps == [(done, 9) for done in range(1, 10)]


def test_the_same_seed_gives_the_same_bytes_and_another_seed_other_images(tmp_path: Path) -> None:
    for name, seed in (("a", 5), ("b", 5), ("c", 6)):
        make_sheets(SheetOptions(ids="1-2", settings=SheetSettings(seed=seed)), tmp_path / name)
    first, again, other = (bytes_of(tmp_path / name) for name in "abc")
    assert first == again
    assert other["images/1.png"] != first["images/1.png"]
    assert other["images/manifest.csv"] == first["images/manifest.csv"]


def test_own_images_make_sheets_of_all_of_them(own: Path, tmp_path: Path) -> None:
    record = make_sheets(SheetOptions(images=own, settings=SheetSettings(width_m=0.15)), tmp_path / "out")
    assert [(one.landmark, one.width_m) for one in record.images] == [("3", 0.15), ("4", 0.15), ("spare", 0.15)]
    assert record.seed is None


def test_own_images_of_a_sites_landmarks(own: Path, tmp_path: Path) -> None:
    landmarks = tmp_path / "landmarks.csv"
    landmarks.write_text("id,floor\n4,1\n3,1\n")
    record = make_sheets(SheetOptions(source=landmarks, images=own), tmp_path / "out")
    assert [(page.landmark, page.floor) for page in record.pages] == [("4", 1), ("3", 1)]
    landmarks.write_text("id\n3\n5\n6\n")
    with pytest.raises(SurveyError, match=r"own: contains no image of landmark 5, 6; add it as ID.png"):
        make_sheets(SheetOptions(source=landmarks, images=own), tmp_path / "out")


def test_more_images_than_a_phone_holds_are_refused(tmp_path: Path) -> None:
    landmarks = tmp_path / "landmarks.csv"
    landmarks.write_text("id\n" + "\n".join(map(str, range(1001))))
    with pytest.raises(
        UsageError, match="1001 landmarks: a phone's database contains at most 1000 images; select some with --ids"
    ):
        make_sheets(SheetOptions(source=landmarks), tmp_path / "out")


def test_a_folder_of_others_is_refused_before_any_work(own: Path, tmp_path: Path) -> None:
    steps: list[tuple[int, int]] = []
    with pytest.raises(OutputError, match="is not empty and was not made by this command"):
        make_sheets(SheetOptions(ids="1-500"), own, lambda *told: steps.append(told))
    assert steps == []


def test_a_set_that_fails_leaves_nothing(own: Path, tmp_path: Path) -> None:
    Image.fromarray(dead_leaves_picture(8, "3")).save(own / "copy.png")
    with pytest.raises(SurveyError, match="these images would be confused: 3 and copy"):
        make_sheets(SheetOptions(images=own), tmp_path / "out")
    assert sorted(path.name for path in tmp_path.iterdir()) == ["own"]
