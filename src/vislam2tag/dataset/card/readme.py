"""``README.md``: what a data set is, how it was made, how to load it, what is in it and what is not."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any

import polars as pl
from jinja2 import Environment, PackageLoader, StrictUndefined

from vislam2tag import __version__
from vislam2tag.dataset.card.citation import bibtex
from vislam2tag.dataset.card.columns import meaning
from vislam2tag.dataset.card.datacite import datacite_text
from vislam2tag.dataset.card.hugging_face import front_matter, licence_url
from vislam2tag.dataset.description import missing_fields
from vislam2tag.dataset.model import Dataset, DatasetInfo, DatasetSource
from vislam2tag.dataset.schema import SCHEMAS, UNITS
from vislam2tag.dataset.statistics.record import DatasetStatistics

NOT_STATED = "not stated"
LABELS = "process"
"""Kind of a source that this program labelled."""
_ABOUT = {
    "fingerprints": "one row a scan (or window of time): where it was taken and how sure that is",
    "readings": "one row for each transmitter heard in a scan",
    "access_points": "one row a transmitter",
    "sessions": "one row a walk",
    "magnetic": "one row a window of the magnetometer's readings",
    "imu_windows": "windows of accelerometer and gyroscope with the way walked meanwhile",
}
_KINDS: Mapping[str, str] = {
    "String": "text",
    "Boolean": "yes or no",
    "Date": "date",
    "Datetime": "date and time",
}


def readme_text(dataset: Dataset, statistics: DatasetStatistics) -> str:
    """Write ``README.md``; what nobody stated stands there as not stated."""
    info = dataset.info
    context: dict[str, Any] = {
        "front_matter": front_matter(info),
        "info": info,
        "statistics": statistics,
        "labels": {name: technology.labels for name, technology in statistics.technologies.items()},
        "not_stated": NOT_STATED,
        "missing": missing_fields(info),
        "about": _ABOUT,
        "columns": {name: list(_columns(name)) for name in info.tables},
        "splits": {name: split.info for name, split in dataset.splits.items()},
        "licence_url": licence_url(info.licence) if info.licence else None,
        "bibtex": bibtex(info),
        "registered": datacite_text(info) is not None,
        "authors": _authors(info),
        "made": [_made(source) for source in info.sources],
        "by_labels": any(source.kind == LABELS for source in info.sources),
        "version": __version__,
    }
    return _environment().get_template("README.md.j2").render(context)


def _environment() -> Environment:
    environment = Environment(
        loader=PackageLoader("vislam2tag.dataset.card", "."),
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


def _authors(info: DatasetInfo) -> str:
    return "; ".join(person.name for person in info.creators)


def _made(source: DatasetSource) -> str:
    if source.kind == LABELS:
        return f"labels of the survey `{source.name}` by vislam2tag {source.version}"
    return f"`{source.name}`, format {source.kind}, by vislam2tag {source.version}"
