"""Writes the card of a data set into its folder, ready for upload to a repository.

``README.md`` describes the data set, how it was made, how to load it, and what it contains.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

import polars as pl
from jinja2 import Environment, PackageLoader, StrictUndefined

from vislam2tag import __version__
from vislam2tag.common.files.folder import Folder
from vislam2tag.datasets import card_metadata
from vislam2tag.datasets.description import DESCRIPTION_FILE, description_text, missing_fields
from vislam2tag.datasets.folder import listed_files, sha256_of
from vislam2tag.datasets.model import Dataset, DatasetSource
from vislam2tag.datasets.schema import SCHEMAS, UNITS, meaning
from vislam2tag.datasets.statistics_record import DatasetStatistics

NOT_STATED = "not stated"
LABELS = "process"
"""Kind of a source that this program labelled."""
_ABOUT = {
    "fingerprints": "one row for each scan (or time window), with its position and standard deviation",
    "readings": "one row for each transmitter heard in a scan",
    "access_points": "one row for each transmitter",
    "sessions": "one row for each walk",
    "magnetic": "one row for each window of magnetometer readings",
    "imu_windows": "windows of accelerometer and gyroscope readings, with the displacement",
}
_KINDS: Mapping[str, str] = {
    "String": "text",
    "Boolean": "yes or no",
    "Date": "date",
    "Datetime": "date and time",
}


def readme_text(dataset: Dataset, statistics: DatasetStatistics) -> str:
    """Write ``README.md``; unknown facts are marked as not stated."""
    info = dataset.info
    context: dict[str, Any] = {
        "front_matter": card_metadata.front_matter(info),
        "info": info,
        "statistics": statistics,
        "labels": {name: technology.labels for name, technology in statistics.technologies.items()},
        "not_stated": NOT_STATED,
        "missing": missing_fields(info),
        "about": _ABOUT,
        "columns": {name: list(_columns(name)) for name in info.tables},
        "splits": {name: split.info for name, split in dataset.splits.items()},
        "licence_url": card_metadata.licence_url(info.licence) if info.licence else None,
        "bibtex": card_metadata.bibtex(info),
        "registered": card_metadata.datacite_text(info) is not None,
        "authors": "; ".join(person.name for person in info.creators),
        "made": [_made(source) for source in info.sources],
        "by_labels": any(source.kind == LABELS for source in info.sources),
        "version": __version__,
    }
    return _environment().get_template("README.md.j2").render(context)


def _environment() -> Environment:
    environment = Environment(
        loader=PackageLoader("vislam2tag.datasets", "."),
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
        keep_trailing_newline=True,
    )
    environment.filters |= {"cell": cell, "number": number}
    return environment


def cell(value: object) -> str:
    """Write a value into a cell of a Markdown table."""
    return str(value).replace("|", "\\|").replace("\n", " ")


def number(value: float | None, digits: int = 0, unit: str = "") -> str:
    """Write a number with its unit; None as a dash."""
    return "-" if value is None else f"{value:,.{digits}f}{unit}"


def _columns(table: str) -> Iterable[tuple[str, str, str, str]]:
    """Yield name, type, unit and meaning of each column."""
    for column, kind in SCHEMAS[table].items():
        yield column, _kind(kind), UNITS.get(column, ""), meaning(table, column)


def _kind(kind: pl.DataType) -> str:
    inner = str(kind.inner if isinstance(kind, pl.List) else kind).partition("(")[0]
    return ("list of " if isinstance(kind, pl.List) else "") + _KINDS.get(inner, inner.lower())


def _made(source: DatasetSource) -> str:
    if source.kind == LABELS:
        return f"labels of the survey `{source.name}` by vislam2tag {source.version}"
    return f"`{source.name}`, format {source.kind}, by vislam2tag {source.version}"


README, CITATION, DATACITE, CROISSANT = "README.md", "CITATION.cff", "datacite.json", "croissant.json"
SUMS = "SHA256SUMS"


def write_card(dataset: Dataset, statistics: DatasetStatistics, folder: Folder) -> None:
    """Write the card into the data set's folder as the last step: ``SHA256SUMS`` covers all files except hidden ones.

    ``README.md`` (with Hugging Face's front matter), ``croissant.json`` and ``dataset.toml`` are always written.
    ``CITATION.cff`` and ``datacite.json`` need the fields that their schemas require; the card lists missing ones.
    """
    texts = {
        README: readme_text(dataset, statistics),
        CITATION: card_metadata.citation_text(dataset.info),
        DATACITE: card_metadata.datacite_text(dataset.info),
        CROISSANT: card_metadata.croissant_text(dataset.info),
        DESCRIPTION_FILE: description_text(dataset.info),
    }
    for name, text in texts.items():
        if text is not None:
            folder.write(name, text)
    folder.write(SUMS, _sums(folder.path))


def _sums(folder: Path) -> str:
    """One line for each file below the folder, sorted by name, in the format of ``sha256sum``."""
    return "".join(f"{sha256_of(folder / name)}  {name}\n" for name in listed_files(folder) if name != SUMS)
