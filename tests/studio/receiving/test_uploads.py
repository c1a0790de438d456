from __future__ import annotations

import os
import shutil
import time
from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.studio.receiving.zips import HEADER, SESSION, digest, session_files, session_zip
from tests.surveys import bytes_of
from vislam2tag.common.errors import OutputError
from vislam2tag.studio.receiving.uploads import (
    EXPIRY_S,
    MOST_WAITING_SIZES,
    WORK_FOLDER,
    RefusalError,
    Uploads,
    UploadState,
    file_zip,
)
from vislam2tag.studio.receiving.zips import RefusedZipError

PLENTY = 1_000_000
PLACE = f"floor_4/LG/{SESSION}"


@pytest.fixture
def survey(tmp_path: Path) -> Path:
    folder = tmp_path / "survey"
    folder.mkdir()
    return folder


def filed(survey: Path, data: bytes) -> tuple[str, bool]:
    path = survey.parent / "session.zip"
    path.write_bytes(data)
    done = file_zip(survey, path, PLENTY)
    return done.path, done.already


def test_a_session_lands_where_its_record_says(survey: Path) -> None:
    assert filed(survey, session_zip()) == (PLACE, False)
    for name, content in session_files().items():
        assert (survey / PLACE / name).read_bytes() == content
    assert list((survey / WORK_FOLDER).iterdir()) == []


def test_the_same_session_again_changes_nothing(survey: Path) -> None:
    filed(survey, session_zip())
    before = bytes_of(survey)
    assert filed(survey, session_zip()) == (PLACE, True)
    assert bytes_of(survey) == before


def test_another_session_of_that_name_is_refused_and_the_first_one_stays(survey: Path) -> None:
    filed(survey, session_zip())
    before = bytes_of(survey)
    other = session_files() | {"ControlPoint.csv": HEADER + b"1,0,press\n"}
    with pytest.raises(RefusedZipError, match=f"{PLACE} already contains another session"):
        filed(survey, session_zip(other))
    assert bytes_of(survey) == before


def test_a_file_that_lacks_of_a_session_comes_back(survey: Path) -> None:
    filed(survey, session_zip())
    before = bytes_of(survey)
    (survey / PLACE / "ControlPoint.csv").unlink()
    assert filed(survey, session_zip()) == (PLACE, False)
    assert bytes_of(survey) == before


def test_a_folder_with_other_files_is_not_filled_up(survey: Path) -> None:
    (survey / PLACE).mkdir(parents=True)
    (survey / PLACE / "wifi.csv").write_bytes(b"of another program")
    with pytest.raises(RefusedZipError, match="another session"):
        filed(survey, session_zip())
    assert [path.name for path in (survey / PLACE).iterdir()] == ["wifi.csv"]


@pytest.mark.parametrize("device", ["marker_dict.csv", "floorplan.PNG", "Tachymeter"])
def test_a_device_is_not_called_as_a_file_of_the_floor(survey: Path, device: str) -> None:
    with pytest.raises(RefusedZipError, match="another name"):
        filed(survey, session_zip(session_files(device=device)))
    assert not (survey / "floor_4").exists()


def test_files_beside_a_session_that_is_there_do_not_make_it_another(survey: Path) -> None:
    filed(survey, session_zip())
    (survey / PLACE / "truth.csv").write_bytes(b"time_ns,x,y\n")
    assert filed(survey, session_zip()) == (PLACE, True)


def test_a_floor_folder_with_another_spelling_is_used(survey: Path) -> None:
    (survey / "floor_04").mkdir()
    assert filed(survey, session_zip()) == (f"floor_04/LG/{SESSION}", False)


def test_cellars_have_negative_floors(survey: Path) -> None:
    assert filed(survey, session_zip(session_files(floor=-1)))[0] == f"floor_-1/LG/{SESSION}"


def test_a_refused_zip_leaves_nothing(survey: Path) -> None:
    with pytest.raises(RefusedZipError):
        filed(survey, session_zip(ControlPoint_csv=b"changed"))
    assert list(survey.rglob("*.csv")) == []
    assert list((survey / WORK_FOLDER).iterdir()) == []


def test_a_file_in_the_session_s_place_is_not_replaced(survey: Path) -> None:
    (survey / "floor_4" / "LG").mkdir(parents=True)
    (survey / PLACE).write_bytes(b"a file")
    with pytest.raises(RefusedZipError, match="another session"):
        filed(survey, session_zip())
    assert (survey / PLACE).read_bytes() == b"a file"


DATA = session_zip()
NAME = digest(DATA)


@pytest.fixture
def uploads(tmp_path: Path) -> Iterator[Uploads]:
    with Uploads(tmp_path, PLENTY, PLENTY) as held:
        yield held


def brought(uploads: Uploads, data: bytes, length: int = len(DATA), name: str = NAME) -> None:
    with uploads.writing(name, length, uploads.state(name).received) as file:
        file.write(data)


def test_an_upload_grows_and_is_filed(uploads: Uploads, tmp_path: Path) -> None:
    assert uploads.state(NAME) == UploadState("none")
    brought(uploads, DATA[:100])
    assert uploads.state(NAME) == UploadState("partial", 100, len(DATA))
    brought(uploads, DATA[100:])
    assert uploads.finish(NAME).path == PLACE
    assert uploads.state(NAME) == UploadState("filed", session=PLACE)
    assert list((tmp_path / WORK_FOLDER).glob("*.part")) == []


def test_what_arrived_outlives_the_program(tmp_path: Path) -> None:
    with Uploads(tmp_path, PLENTY, PLENTY) as first:
        brought(first, DATA[:100])
    with Uploads(tmp_path, PLENTY, PLENTY) as second:
        assert second.waiting() == [UploadState("partial", 100, len(DATA))]
        brought(second, DATA[100:])
        second.finish(NAME)
    with Uploads(tmp_path, PLENTY, PLENTY) as third:
        assert third.state(NAME).state == "filed"
        assert third.waiting() == []


def test_what_was_written_before_an_exception_stays(uploads: Uploads) -> None:
    def broken_off() -> None:
        with uploads.writing(NAME, len(DATA), 0) as file:
            file.write(DATA[:70])
            raise ConnectionError

    with pytest.raises(ConnectionError):
        broken_off()
    assert uploads.state(NAME).received == 70


def test_two_do_not_write_one_upload(uploads: Uploads) -> None:
    with uploads.writing(NAME, 10, 0):
        with pytest.raises(RefusalError, match="another connection"), uploads.writing(NAME, 10, 0):
            pass
        with pytest.raises(RefusalError, match="another connection"), uploads.finishing(NAME):
            pass
        with uploads.writing("f" * 64, 10, 0):
            pass
    with uploads.finishing(NAME), pytest.raises(RefusalError, match="another connection"), uploads.writing(NAME, 10, 0):
        pass


def test_a_refused_session_is_forgotten(uploads: Uploads, tmp_path: Path) -> None:
    data = session_zip(CameraPose_csv=b"other")
    brought(uploads, data, len(data), digest(data))
    with pytest.raises(RefusedZipError, match="checksum"):
        uploads.finish(digest(data))
    assert uploads.state(digest(data)) == UploadState("none")
    assert not (tmp_path / "floor_4").exists()


def test_a_session_that_somebody_removed_may_come_again(uploads: Uploads, tmp_path: Path) -> None:
    brought(uploads, DATA)
    uploads.finish(NAME)
    shutil.rmtree(tmp_path / PLACE)
    assert uploads.state(NAME) == UploadState("none")


@pytest.mark.parametrize("damage", ["removed file", "empty folder", "changed file", "no list", "another session"])
def test_filed_is_said_only_of_files_that_lie_there_as_sent(uploads: Uploads, tmp_path: Path, damage: str) -> None:
    brought(uploads, DATA)
    uploads.finish(NAME)
    place = tmp_path / PLACE
    if damage == "removed file":
        (place / "CameraPose.csv").unlink()
    elif damage == "empty folder":
        shutil.rmtree(place)
        place.mkdir()
    elif damage == "changed file":
        (place / "CameraPose.csv").write_bytes(b"time_ns\n2\n")
    elif damage == "no list":
        (place / "SHA256SUMS").unlink()
    else:
        place.rename(tmp_path / "elsewhere")
        other = session_zip(session_files() | {"ControlPoint.csv": b"time_ns,n,action\n1,0,press\n"})
        brought(uploads, other, len(other), digest(other))
        uploads.finish(digest(other))
        shutil.rmtree(tmp_path / "elsewhere")
    assert uploads.state(NAME) == UploadState("none")


@pytest.mark.parametrize("lacking", [("CameraPose.csv",), ("SHA256SUMS",), ("CameraPose.csv", "session.json")])
def test_what_lacks_of_a_filed_session_comes_back(uploads: Uploads, tmp_path: Path, lacking: tuple[str, ...]) -> None:
    brought(uploads, DATA)
    uploads.finish(NAME)
    for name in lacking:
        (tmp_path / PLACE / name).unlink()
    brought(uploads, DATA)
    assert not uploads.finish(NAME).already
    assert uploads.state(NAME) == UploadState("filed", session=PLACE)


def test_a_pipe_in_a_file_s_place_is_not_waited_for(uploads: Uploads, tmp_path: Path) -> None:
    brought(uploads, DATA)
    uploads.finish(NAME)
    (tmp_path / PLACE / "CameraPose.csv").unlink()
    os.mkfifo(tmp_path / PLACE / "CameraPose.csv")
    assert uploads.state(NAME) == UploadState("none")


def test_another_offset_is_refused_and_begins_nothing(uploads: Uploads, tmp_path: Path) -> None:
    with pytest.raises(RefusalError, match="0 bytes have been received"), uploads.writing(NAME, 2 * len(DATA), 1):
        pass
    with uploads.writing(NAME, 2 * len(DATA), 0):
        pass
    assert list((tmp_path / WORK_FOLDER).glob("*.part")) == []


def test_unfinished_uploads_announce_so_much_and_no_more(tmp_path: Path) -> None:
    with Uploads(tmp_path, 10, PLENTY) as uploads:
        for number in range(MOST_WAITING_SIZES):
            brought(uploads, b"x", 10, f"{number:064x}")
        with pytest.raises(RefusalError, match="too many"), uploads.writing("f" * 64, 10, 0):
            pass
        with uploads.writing(f"{0:064x}", 10, 1):
            pass


def test_a_full_disk_keeps_the_upload(uploads: Uploads, tmp_path: Path) -> None:
    (tmp_path / "floor_4").write_bytes(b"not a folder, as if it could not be made")
    brought(uploads, DATA)
    with pytest.raises(OSError, match="floor_4"):
        uploads.finish(NAME)
    assert uploads.state(NAME).received == len(DATA)


def test_only_one_program_holds_a_survey(uploads: Uploads, tmp_path: Path) -> None:
    with pytest.raises(OutputError, match="another 'vislam2tag receive'"), Uploads(tmp_path, PLENTY, PLENTY):
        pass


def test_what_a_killed_program_was_unpacking_goes(tmp_path: Path) -> None:
    left = tmp_path / WORK_FOLDER / ".vislam2tag-0123456789abcdef.part"
    left.mkdir(parents=True)
    with Uploads(tmp_path, PLENTY, PLENTY):
        assert not left.exists()


def test_an_unfinished_upload_expires_when_nothing_comes_for_a_week(tmp_path: Path) -> None:
    now_s = time.time()
    with Uploads(tmp_path, PLENTY, PLENTY, clock=lambda: now_s) as uploads:
        brought(uploads, DATA[:100])
        now_s += EXPIRY_S - 60
        brought(uploads, b"x", 10, "a" * 64)
        assert uploads.state(NAME).received == 100, "it is not old enough"
        now_s += 120
        brought(uploads, b"x", 10, "b" * 64)
        assert uploads.state(NAME) == UploadState("none")
        brought(uploads, DATA)
        assert uploads.finish(NAME).path == PLACE
    now_s += EXPIRY_S
    with Uploads(tmp_path, PLENTY, PLENTY, clock=lambda: now_s) as later:
        assert later.waiting() == []
    assert list((tmp_path / WORK_FOLDER).glob("*.part")) == []


def test_an_upload_that_is_being_written_does_not_expire(tmp_path: Path) -> None:
    now_s = time.time()
    with Uploads(tmp_path, PLENTY, PLENTY, clock=lambda: now_s) as uploads:
        brought(uploads, DATA[:100])
        with uploads.writing(NAME, len(DATA), 100) as file:
            now_s += 2 * EXPIRY_S
            brought(uploads, b"x", 10, "a" * 64)
            file.write(DATA[100:])
        assert uploads.finish(NAME).path == PLACE


def test_a_work_folder_that_is_a_link_is_refused(tmp_path: Path) -> None:
    survey = tmp_path / "home" / "survey"
    survey.mkdir(parents=True)
    for name in ("thesis.zip", "lock"):
        (tmp_path / "home" / name).write_text("mine")
    (tmp_path / "home" / "unpacked-photos").mkdir()
    (survey / WORK_FOLDER).symlink_to("..")
    with pytest.raises(OutputError, match="it is a link"), Uploads(survey, PLENTY, PLENTY):
        pass
    assert sorted(path.name for path in survey.parent.iterdir()) == ["lock", "survey", "thesis.zip", "unpacked-photos"]


def test_files_of_the_user_in_the_work_folder_stay(tmp_path: Path) -> None:
    (tmp_path / WORK_FOLDER / "unpacked-photos").mkdir(parents=True)
    (tmp_path / WORK_FOLDER / "thesis.zip").write_text("mine")
    with Uploads(tmp_path, PLENTY, PLENTY) as uploads:
        brought(uploads, DATA)
        assert uploads.finish(NAME).path == PLACE
    assert (tmp_path / WORK_FOLDER / "unpacked-photos").is_dir()
    assert (tmp_path / WORK_FOLDER / "thesis.zip").read_text() == "mine"


def test_no_session_is_filed_through_a_link(tmp_path: Path) -> None:
    survey, elsewhere = tmp_path / "survey", tmp_path / "elsewhere"
    survey.mkdir()
    elsewhere.mkdir()
    (survey / PLACE.split("/", 1)[0]).symlink_to(elsewhere)
    with Uploads(survey, PLENTY, PLENTY) as uploads:
        brought(uploads, DATA)
        with pytest.raises(OSError, match="it is a link"):
            uploads.finish(NAME)
        assert uploads.state(NAME).state == "partial", "it is kept until the link is gone"
    assert list(elsewhere.iterdir()) == []
