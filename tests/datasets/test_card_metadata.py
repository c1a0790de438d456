"""CITATION.cff says what is known in the words of the Citation File Format.

datacite.json is valid by DataCite's own schema, or is not written.

croissant.json is valid and mlcroissant loads the tables by it, value by value.
"""

from __future__ import annotations

import datetime as dt
import json
import logging
import math
from pathlib import Path
from typing import get_args

import mlcroissant
import polars as pl
import pytest
import yaml
from datacite import schema45

from vislam2tag.datasets.card_metadata import REQUIRED, bibtex, citation_text, datacite_text
from vislam2tag.datasets.description import DataCiteRelation, Person
from vislam2tag.datasets.folder import open_dataset, sha256_of
from vislam2tag.datasets.model import DatasetInfo
from vislam2tag.datasets.schema import SCHEMAS

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
    assert not (bare_set / "datacite.json").exists()


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


def test_a_described_set_is_valid_and_whole(described_set: Path) -> None:
    record = json.loads((described_set / "datacite.json").read_text("utf-8"))
    schema45.validator.validate(record)
    assert record["publicationYear"] == "2026"
    assert record["creators"][0]["givenName"] == "Josiah"
    assert "nameType" not in record["creators"][1]
    assert record["rightsList"][0]["rightsIdentifier"] == "CC-BY-4.0"
    assert [part["relatedIdentifierType"] for part in record["relatedIdentifiers"]] == ["DOI", "arXiv", "URL"]
    assert record["fundingReferences"] == [{"funderName": "A foundation", "awardNumber": "12"}]


@pytest.mark.parametrize("name", REQUIRED)
def test_without_a_required_field_there_is_none(name: str, described_set: Path) -> None:
    info = open_dataset(described_set).info
    assert datacite_text(info) is not None
    assert datacite_text(info.model_copy(update={name: None})) is None


def test_with_the_required_fields_alone_it_is_valid(described_set: Path) -> None:
    full = open_dataset(described_set).info
    keep = {name: getattr(full, name) for name in ("name", "floors", *REQUIRED)}
    schema45.validator.validate(json.loads(datacite_text(type(full)(**keep)) or ""))


def test_the_schema_knows_every_relation() -> None:
    assert set(get_args(DataCiteRelation)) <= set(schema45.validator.schema["definitions"]["relationType"]["enum"])


pytestmark = [  # mlcroissant's own
    pytest.mark.filterwarnings("ignore:ConjunctiveGraph is deprecated:DeprecationWarning"),
    pytest.mark.filterwarnings("ignore:The inplace keyword:pandas.errors.Pandas4Warning"),
]


@pytest.fixture
def croissant(described_set: Path, caplog: pytest.LogCaptureFixture) -> mlcroissant.Dataset:
    with caplog.at_level(logging.WARNING):
        loaded = mlcroissant.Dataset(jsonld=str(described_set / "croissant.json"))
    assert "not standard" not in caplog.text
    return loaded


def test_it_is_valid_and_states_what_is_known(croissant: mlcroissant.Dataset) -> None:
    context = croissant.metadata.ctx
    assert not context.issues.errors
    assert not context.issues.warnings
    assert str(croissant.metadata.version) == "1.0.0"
    assert croissant.metadata.license == ["https://creativecommons.org/licenses/by/4.0/"]


def test_files_are_named_with_their_checksums(described_set: Path) -> None:
    files = json.loads((described_set / "croissant.json").read_text("utf-8"))["distribution"]
    assert [file["contentUrl"] for file in files] == [
        "fingerprints.parquet",
        "readings.parquet",
        "access_points.parquet",
        "sessions.parquet",
        "splits/again.parquet",
        "splits/device.parquet",
    ]
    for file in files:
        assert file["sha256"] == sha256_of(described_set / file["contentUrl"])


@pytest.mark.parametrize("table", ["fingerprints", "readings", "access_points", "sessions"])
def test_records_are_the_rows(table: str, described_set: Path, croissant: mlcroissant.Dataset) -> None:
    rows = open_dataset(described_set).tables[table].collect()
    records = list(croissant.records(table))
    assert len(records) == len(rows)
    for record, row in zip(records, rows.iter_rows(named=True), strict=True):
        assert set(record) == {f"{table}/{name}" for name in SCHEMAS[table]}
        for name, value in row.items():
            assert same(record[f"{table}/{name}"], value), (name, value)


def same(found: object, expected: object) -> bool:
    """Whether a record's value is a table's: text comes as bytes, nothing as NaN, lists as arrays."""
    if expected is None:
        return found is None or found != found
    if isinstance(expected, str):
        return isinstance(found, bytes) and found.decode() == expected
    if isinstance(expected, float) and isinstance(found, float):
        return math.isclose(found, expected, rel_tol=1e-6)
    if isinstance(expected, list):
        return list(found) == expected  # type: ignore[call-overload, no-any-return]
    if hasattr(expected, "isoformat"):
        return str(found).startswith(str(expected))
    return bool(found == expected)


def test_splits_are_record_sets(described_set: Path, croissant: mlcroissant.Dataset) -> None:
    records = list(croissant.records("split_device"))
    groups = pl.read_parquet(described_set / "splits" / "device.parquet")
    assert [record["split_device/id"].decode() for record in records] == groups["id"].to_list()


def test_a_bare_set_loads_too(bare_set: Path) -> None:
    loaded = mlcroissant.Dataset(jsonld=str(bare_set / "croissant.json"))
    assert len(list(loaded.records("sessions"))) == 4
