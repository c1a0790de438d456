"""What people say of a data set is read from TOML, checked field by field, and written back."""

from __future__ import annotations

import datetime as dt
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from tests.datasets.described import FULL
from vislam2tag.common.errors import DatasetError
from vislam2tag.datasets.description import Person, description_text, missing_fields, read_description, with_description
from vislam2tag.datasets.model import DatasetInfo, FloorInfo
from vislam2tag.site.georeference import Georeference

BARE = DatasetInfo(name="bare", floors=(FloorInfo(number=1), FloorInfo(number=2, building="annex")))
WRONG = [
    ('title = ""', "title: "),
    ('licence = "CC-BY-5"', "licence: 'CC-BY-5' is not an SPDX licence"),
    ('doi = "11.1/x"', "doi: '11.1/x' is not a DOI"),
    ('contact = "me"', "contact: 'me' is neither"),
    ('published = "spring"', "published: "),
    ('[[creators]]\nname = "A"\n[[creators]]\nname = "B"\norcid = "0000-0002-1825-0098"', "creators[2].orcid: "),
    ('[[creators]]\nnames = "A"', "creators[1]"),
    (
        '[[creators]]\nname = "A"\nmail = "x"',
        "creators[1].mail: no such field in a data set's description; fields are: name",
    ),
    ('[[related]]\nidentifier = "here"\nrelation = "Cites"', "related[1].identifier: 'here' is not a DOI"),
    ('[[related]]\nidentifier = "arXiv:1"\nrelation = "Likes"', "related[1].relation: "),
    ('license = "MIT"', "license: no such field in a data set's description; fields are: title"),
    ("title", "not a valid TOML file"),
    ("[[floors]]\nnumber = 1\nlatitude_deg = 95\nlongitude_deg = 6", "floors[1].latitude_deg: "),
]


def read(text: str, folder: Path) -> DatasetInfo:
    path = folder / "dataset.toml"
    path.write_text(text, encoding="utf-8")
    return with_description(BARE, read_description(path))


def test_every_field_is_taken(tmp_path: Path) -> None:
    info = read(FULL, tmp_path)
    assert info.title == "Wi-Fi of a simulated building"
    assert info.licence == "CC-BY-4.0"
    assert info.published == dt.date(2026, 3, 1)
    assert info.doi == "10.5281/zenodo.1234567"
    assert info.creators[0] == Person(name="Carberry, Josiah", affiliation="Brown | Co", orcid="0000-0002-1825-0097")
    assert [part.identifier for part in info.related] == [
        "10.5555/12345678",
        "arXiv:2201.00001",
        "https://example.org/a",
    ]
    assert info.funding[0].award == "12"
    assert missing_fields(info) == ()


def test_a_floor_gets_its_place_on_earth_and_keeps_it(tmp_path: Path) -> None:
    floor = '[[floors]]\nnumber = 2\nbuilding = "annex"\nlatitude_deg = 50.5\nlongitude_deg = 6\nbearing_deg = 12.5\n'
    info = read(floor, tmp_path)
    assert info.floors[0].georeference is None
    assert info.floors[1].georeference == Georeference(latitude_deg=50.5, longitude_deg=6.0, bearing_deg=12.5)
    assert read(description_text(info), tmp_path).floors == info.floors
    with pytest.raises(DatasetError, match=r"floors: the data set has no floor 2; its floors: 1, annex 2"):
        read(floor.replace('building = "annex"\n', ""), tmp_path)


@pytest.mark.parametrize(("text", "message"), WRONG)
def test_a_wrong_field_is_named_with_the_file(text: str, message: str, tmp_path: Path) -> None:
    with pytest.raises(DatasetError) as raised:
        read(text, tmp_path)
    assert str(raised.value).startswith(f"{tmp_path / 'dataset.toml'}: ")
    assert message in str(raised.value)
    assert "\n" not in str(raised.value)


def test_a_missing_file_is_told(tmp_path: Path) -> None:
    with pytest.raises(DatasetError, match=r"none\.toml: cannot be read \(No such file"):
        read_description(tmp_path / "none.toml")


def test_what_is_not_said_stays(tmp_path: Path) -> None:
    before = BARE.model_copy(update={"licence": "CC0-1.0", "creators": (Person(name="A"),)})
    (tmp_path / "dataset.toml").write_text('version = "2"', encoding="utf-8")
    after = with_description(before, read_description(tmp_path / "dataset.toml"))
    assert after == before.model_copy(update={"version": "2"})


def test_the_template_says_nothing_and_its_examples_are_right(tmp_path: Path) -> None:
    template = description_text(BARE)
    assert read(template, tmp_path) == BARE
    lines = [line.removeprefix("# ") if " = " in line or "[[" in line else line for line in template.splitlines()]
    filled = read("\n".join(lines[1:]), tmp_path)
    assert missing_fields(filled) == ()
    assert filled.funding
    assert filled.related


def test_what_is_written_reads_back(tmp_path: Path) -> None:
    info = read(FULL, tmp_path)
    assert read(description_text(info), tmp_path) == info


@given(title=st.text(min_size=1).filter(lambda text: text.strip() == text))
def test_any_title_survives(title: str, tmp_path_factory: pytest.TempPathFactory) -> None:
    try:
        title.encode()
    except UnicodeEncodeError:
        return
    folder = tmp_path_factory.getbasetemp()
    info = BARE.model_copy(update={"title": title})
    path = folder / "title.toml"
    path.write_bytes(description_text(info).encode())
    assert with_description(BARE, read_description(path)) == info
