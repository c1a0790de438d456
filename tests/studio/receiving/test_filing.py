from __future__ import annotations

from pathlib import Path

import pytest

from tests.studio.receiving.zips import HEADER, SESSION, session_files, session_zip
from tests.surveys import bytes_of
from vislam2tag.studio.receiving.filing import WORK_FOLDER, file_zip
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
    with pytest.raises(RefusedZipError, match=f"another session is at {PLACE}"):
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
