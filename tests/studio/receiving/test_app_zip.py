"""Zips that other apps share are recognised, bounded and filed whole."""

from __future__ import annotations

import hashlib
import io
import json
import zipfile
from pathlib import Path

import pytest

from tests.cli.command import the_error, vislam2tag
from tests.sessions.apps.recordings import APPS
from tests.studio.receiving.zips import packed
from tests.surveys import bytes_of
from vislam2tag.sessions.registry import format_of
from vislam2tag.studio.receiving.filing import file_zip, is_filed
from vislam2tag.studio.receiving.uploads import Uploads
from vislam2tag.studio.receiving.zips import AppPlace, RefusedZipError

PLENTY = 10_000_000
SHARED = [app for app in APPS if app not in ("TUM", "EuRoC", "MCAP", "Stray Scanner, lens of each frame")]


@pytest.fixture
def survey(tmp_path: Path) -> Path:
    (tmp_path / "survey" / "floor_2").mkdir(parents=True)
    return tmp_path / "survey"


def shared_zip(app: str, folder: Path, within: str = "") -> Path:
    """A zip as the app shares it, its files at the top or in a folder."""
    recording = folder / "recording"
    recording.mkdir()
    APPS[app][1](recording)
    path = folder / "walk-1.zip"
    files = {
        f"{within}{file.relative_to(recording).as_posix()}": file for file in recording.rglob("*") if file.is_file()
    }
    path.write_bytes(packed({name: file.read_bytes() for name, file in files.items()}))
    return path


@pytest.mark.parametrize("app", SHARED)
def test_each_app_is_filed_where_the_survey_has_its_floor(app: str, survey: Path, tmp_path: Path) -> None:
    path = shared_zip(app, tmp_path)
    done = file_zip(survey, path, PLENTY)
    assert (done.path, done.already) == ("floor_2/iPhone/walk-1", False)
    assert format_of(survey / done.path) == APPS[app][0]
    assert bytes_of(survey / done.path) == bytes_of(tmp_path / "recording")
    assert is_filed(survey / done.path, done.sums_sha256)
    (survey / done.path / "sightings.csv").write_text("")
    assert file_zip(survey, path, PLENTY).already, "what was found since stays"


def test_a_browser_may_send_it_too(survey: Path, tmp_path: Path) -> None:
    data = shared_zip("ios_logger", tmp_path, "2024-01-02/").read_bytes()
    name = hashlib.sha256(data).hexdigest()
    with Uploads(survey, PLENTY, PLENTY, AppPlace(3, "phone of Ann")) as uploads:
        with uploads.writing(name, len(data), 0) as file:
            file.write(data)
        assert uploads.finish(name).path == "floor_3/phone of Ann/2024-01-02"
        assert uploads.state(name).state == "filed"


def test_what_cannot_be_filed_is_refused_in_one_sentence(survey: Path, tmp_path: Path) -> None:
    def refused(data: bytes, place: AppPlace | None = None, most: int = PLENTY) -> str:
        path = tmp_path / "some.zip"
        path.write_bytes(data)
        with pytest.raises(RefusedZipError) as caught:
            file_zip(survey, path, most, place)
        assert not list((survey / ".receiving").iterdir())
        return str(caught.value)

    walk = shared_zip("ios_logger", tmp_path).read_bytes()
    assert "nor a recording of another app" in refused(packed({"notes.txt": b"hello"}))
    assert "unpacks to more than" in refused(packed({"ARposes.txt": b"0" * 100_000}), most=10_000)
    buffer = io.BytesIO(walk)
    with zipfile.ZipFile(buffer, "a") as archive:
        archive.writestr("../outside.txt", "x")
    (tmp_path / "walk-2.zip").write_bytes(buffer.getvalue())
    assert file_zip(survey, tmp_path / "walk-2.zip", PLENTY).path == "floor_2/iPhone/walk-2"
    assert not (tmp_path / "outside.txt").exists()
    assert not list(survey.rglob("outside.txt"))
    file_zip(survey, tmp_path / "walk-1.zip", PLENTY)
    (survey / "floor_2" / "iPhone" / "walk-1" / "ARposes.txt").write_text("other")
    (tmp_path / "walk-1.zip").write_bytes(walk)
    with pytest.raises(RefusedZipError, match="another session is at floor_2/iPhone/walk-1"):
        file_zip(survey, tmp_path / "walk-1.zip", PLENTY)
    (survey / "floor_1").mkdir()
    assert "give it by --floor" in refused(walk)


def test_wrong_places_are_told(survey: Path, tmp_path: Path) -> None:
    path = shared_zip("ios_logger", tmp_path)
    assert "is no name of a folder" in the_error(vislam2tag("receive", survey, path, "--device", "../x"))
    for device in ("CON", "nul.phone", "mine.", "mine ", "tachymeter"):
        assert "is no name of a folder" in the_error(vislam2tag("receive", survey, path, "--device", device))
    done = vislam2tag("receive", survey, path, "--floor", "-1", "--device", "mine", "--json")
    assert json.loads(done.stdout)["filed"][0]["path"] == "floor_-1/mine/walk-1"


@pytest.mark.parametrize(
    "name", ["CON", "nul.csv", "camera/AUX/1.txt", "notes.", "notes ", "a:b", "a\\b", "a\x01b", "arPoses.TXT"]
)
def test_names_that_some_system_does_not_take_are_refused(name: str, survey: Path, tmp_path: Path) -> None:
    path = shared_zip("ios_logger", tmp_path)
    with zipfile.ZipFile(path, "a") as archive:
        archive.writestr(name, "x")
    with pytest.raises(RefusedZipError, match="some systems do not take"):
        file_zip(survey, path, PLENTY)


@pytest.mark.parametrize(("stem", "filed"), [("CON", "_CON"), ("nul.x", "_nul.x"), ("walk. ", "walk"), ("a:b", "a-b")])
def test_a_recording_is_filed_under_a_name_that_every_system_takes(
    stem: str, filed: str, survey: Path, tmp_path: Path
) -> None:
    path = shared_zip("ios_logger", tmp_path).rename(tmp_path / f"{stem}.zip")
    assert file_zip(survey, path, PLENTY).path == f"floor_2/iPhone/{filed}"


def test_names_that_differ_in_case_alone_are_one_folder_on_every_system(survey: Path, tmp_path: Path) -> None:
    path = shared_zip("ios_logger", tmp_path)
    file_zip(survey, path, PLENTY)
    other = path.rename(tmp_path / "WALK-1.zip")
    again = file_zip(survey, other, PLENTY, AppPlace(2, "IPHONE"))
    assert (again.path, again.already) == ("floor_2/iPhone/walk-1", True)
