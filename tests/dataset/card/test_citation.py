"""CITATION.cff says what is known in the words of the Citation File Format."""

from __future__ import annotations

import datetime as dt
from pathlib import Path

import pytest
import yaml

from vislam2tag.dataset.card.citation import bibtex, citation_text
from vislam2tag.dataset.model import DatasetInfo, Person

ONE = DatasetInfo(name="one", floors=(), creators=(Person(name="The club", affiliation="none"),))
FIELDS = {
    "cff-version",
    "message",
    "type",
    "title",
    "abstract",
    "authors",
    "keywords",
    "license",
    "license-url",
    "version",
    "date-released",
    "doi",
    "identifiers",
}


def test_all_that_is_stated_is_in_it(described_set: Path) -> None:
    cff = yaml.safe_load((described_set / "CITATION.cff").read_text("utf-8"))
    assert set(cff) == FIELDS
    assert cff["cff-version"] == "1.2.0"
    assert cff["type"] == "dataset"
    assert cff["date-released"] == dt.date(2026, 3, 1)
    assert cff["version"] == "1.0.0"
    assert cff["doi"] == "10.5281/zenodo.1234567"
    orcid = "https://orcid.org/0000-0002-1825-0097"
    person = {"family-names": "Carberry", "given-names": "Josiah", "affiliation": "Brown | Co", "orcid": orcid}
    assert cff["authors"] == [person, {"name": "The surveyors' club"}]


def test_without_creators_there_is_none(bare_set: Path) -> None:
    assert not (bare_set / "CITATION.cff").exists()


def test_what_is_unknown_stays_out() -> None:
    cff = yaml.safe_load(citation_text(ONE) or "")
    assert set(cff) == {"cff-version", "message", "type", "title", "authors"}
    assert cff["title"] == "one"
    assert cff["authors"] == [{"name": "The club"}]


@pytest.mark.parametrize("licence", ["LicenseRef-ours", "MIT OR Apache-2.0"])
def test_a_licence_that_the_format_cannot_hold_stays_out(licence: str) -> None:
    cff = yaml.safe_load(citation_text(ONE.model_copy(update={"licence": licence})) or "")
    assert "license" not in cff
    assert "license-url" not in cff


def test_bibtex_keeps_organisations_whole_and_escapes() -> None:
    people = (Person(name="Carberry, Josiah"), Person(name="Map & Co"))
    info = ONE.model_copy(update={"creators": people, "title": "Wi-Fi {of} floor_1", "name": "a set"})
    assert bibtex(info) == (
        "@misc{a-set,\n  author = {Carberry, Josiah and {Map \\& Co}},\n  title = {Wi-Fi of floor\\_1}\n}"
    )
    assert bibtex(info.model_copy(update={"creators": ()})) is None
