"""datacite.json is valid by DataCite's own schema, or is not written."""

from __future__ import annotations

import json
from pathlib import Path
from typing import get_args

import pytest
from datacite import schema45

from vislam2tag.dataset.card.datacite import REQUIRED, datacite_text
from vislam2tag.dataset.description import DataCiteRelation
from vislam2tag.dataset.folder import open_dataset


def test_a_described_set_is_valid_and_whole(described_set: Path) -> None:
    record = json.loads((described_set / "datacite.json").read_text("utf-8"))
    schema45.validator.validate(record)
    assert record["publicationYear"] == "2026"
    assert record["creators"][0]["givenName"] == "Josiah"
    assert "nameType" not in record["creators"][1]
    assert record["rightsList"][0]["rightsIdentifier"] == "CC-BY-4.0"
    assert [part["relatedIdentifierType"] for part in record["relatedIdentifiers"]] == ["DOI", "arXiv", "URL"]
    assert record["fundingReferences"] == [{"funderName": "A foundation", "awardNumber": "12"}]


def test_a_bare_set_has_none(bare_set: Path) -> None:
    assert not (bare_set / "datacite.json").exists()


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
