"""All steps together: which images go with which landmarks, and the count of steps."""

from __future__ import annotations

from pathlib import Path

import pytest
from PIL import Image

from tests.surveys import bytes_of
from vislam2tag.common.errors import OutputError, SurveyError, UsageError
from vislam2tag.preparation.sheets.images import dead_leaves_picture
from vislam2tag.preparation.sheets.sheet_folder import SheetOptions, make_sheets
from vislam2tag.preparation.sheets.sheet_requests import SheetSettings


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
    with pytest.raises(SurveyError, match=r"own: holds no image of landmark 5, 6; add it as ID.png"):
        make_sheets(SheetOptions(source=landmarks, images=own), tmp_path / "out")


def test_more_images_than_a_phone_holds_are_refused(tmp_path: Path) -> None:
    landmarks = tmp_path / "landmarks.csv"
    landmarks.write_text("id\n" + "\n".join(map(str, range(1001))))
    with pytest.raises(UsageError, match="1001 landmarks: a phone's database holds 1000 images; pick some with --ids"):
        make_sheets(SheetOptions(source=landmarks), tmp_path / "out")


def test_a_folder_of_others_is_refused_before_any_work(own: Path, tmp_path: Path) -> None:
    steps: list[tuple[int, int]] = []
    with pytest.raises(OutputError, match="is not empty and was not made by this command"):
        make_sheets(SheetOptions(ids="1-500"), own, lambda *told: steps.append(told))
    assert steps == []


def test_a_set_that_fails_leaves_nothing(own: Path, tmp_path: Path) -> None:
    Image.fromarray(dead_leaves_picture(8, "3")).save(own / "copy.png")
    with pytest.raises(SurveyError, match="these would be taken for each other: 3 and copy"):
        make_sheets(SheetOptions(images=own), tmp_path / "out")
    assert sorted(path.name for path in tmp_path.iterdir()) == ["own"]
