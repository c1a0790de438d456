"""Facts about a data set that only its makers know (title, licence, creators), from a ``dataset.toml``.

See docs/how-to/publish.md.
"""

from __future__ import annotations

import datetime as dt
import re
import tomllib
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal, get_args

from packaging.licenses import InvalidLicenseExpression, canonicalize_license_expression
from pydantic import AfterValidator, Field, StringConstraints, ValidationError

from vislam2tag.common.errors import DatasetError
from vislam2tag.common.files.given_files import read_toml_values
from vislam2tag.common.files.toml_file import toml_value
from vislam2tag.common.records import Record
from vislam2tag.site.georeference import Georeference

if TYPE_CHECKING:
    from vislam2tag.datasets.model import DatasetInfo, FloorInfo

DESCRIPTION_FILE = "dataset.toml"
"""Name of the file; each data set's folder contains one, filled in as far as known."""
DataCiteRelation = Literal[
    "IsDescribedBy",
    "IsDocumentedBy",
    "IsSupplementTo",
    "IsDerivedFrom",
    "IsNewVersionOf",
    "IsPreviousVersionOf",
    "IsPartOf",
    "HasPart",
    "IsReferencedBy",
    "References",
    "Cites",
    "IsCitedBy",
    "IsCompiledBy",
    "IsIdenticalTo",
    "IsVariantFormOf",
    "Requires",
]
"""Relations of DataCite 4.5 that a data set can have."""
_DOI = re.compile(r"10\.\d{4,9}(\.\d+)?/[A-Za-z0-9:/_;\-.()\[\]\\]+")
_ORCID = re.compile(r"(\d{4}-){3}\d{3}[\dX]")
_ADDRESS = re.compile(r"[^@\s]+@[^@\s]+\.[^@\s]+|https?://\S+")
_RELATED = re.compile(r"arXiv:\S+|https?://\S+")


def _licence(text: str) -> str:
    try:
        return str(canonicalize_license_expression(text))
    except InvalidLicenseExpression as error:
        raise ValueError(
            f"'{text}' is not an SPDX licence identifier such as CC-BY-4.0, CC0-1.0, ODbL-1.0 or LicenseRef-ours"
        ) from error


def _doi(text: str) -> str:
    bare = re.sub(r"^(https?://(dx\.)?doi\.org/|doi:)", "", text, flags=re.IGNORECASE)
    if not _DOI.fullmatch(bare):
        raise ValueError(f"'{text}' is not a DOI such as 10.5281/zenodo.1234567")
    return bare


def _orcid(text: str) -> str:
    """Check an ORCID and its last digit (ISO 7064, MOD 11-2)."""
    bare = re.sub(r"^https?://orcid\.org/", "", text)
    total = 0
    for digit in bare.replace("-", "")[:-1]:
        total = (total + (int(digit) if digit.isdigit() else 0)) * 2
    last = "0123456789X"[(12 - total % 11) % 11]
    if not _ORCID.fullmatch(bare) or bare[-1] != last:
        raise ValueError(f"'{text}' is not an ORCID such as 0000-0002-1825-0097 (check the digits)")
    return bare


def _address(text: str) -> str:
    if not _ADDRESS.fullmatch(text):
        raise ValueError(f"'{text}' is neither an e-mail address nor a URL")
    return text


def _related(text: str) -> str:
    if _RELATED.fullmatch(text) and "doi.org/" not in text:
        return text
    try:
        return _doi(text)
    except ValueError:
        raise ValueError(f"'{text}' is not a DOI, arXiv:number or URL") from None


NonEmptyText = Annotated[str, StringConstraints(strip_whitespace=True, min_length=1)]


class Person(Record):
    """A person or organisation that made the data set."""

    name: NonEmptyText
    """``Family, Given``; a name without a comma is an organisation."""
    affiliation: NonEmptyText | None = None
    orcid: Annotated[str, AfterValidator(_orcid)] | None = None


class Funding(Record):
    """A funder of the data set."""

    funder: NonEmptyText
    award: NonEmptyText | None = None
    """Number of the grant."""


class Related(Record):
    """A related work: a paper, the raw data, an earlier version."""

    identifier: Annotated[NonEmptyText, AfterValidator(_related)]
    """A DOI (``10...``), ``arXiv:...`` or a URL."""
    relation: DataCiteRelation
    """DataCite's relation of the data set to it, such as ``IsDescribedBy``."""


class _FloorEntry(Record):
    """Georeference of a floor."""

    number: int
    building: str = ""
    latitude_deg: Annotated[float, Field(ge=-90, le=90)]
    longitude_deg: Annotated[float, Field(ge=-180, le=180)]
    bearing_deg: float = 0.0


class Description(Record):
    """The content of a ``dataset.toml``. Every field is optional."""

    title: NonEmptyText | None = None
    description: NonEmptyText | None = None
    licence: Annotated[NonEmptyText, AfterValidator(_licence)] | None = None
    keywords: tuple[NonEmptyText, ...] = ()
    version: NonEmptyText | None = None
    published: dt.date | None = None
    publisher: NonEmptyText | None = None
    doi: Annotated[NonEmptyText, AfterValidator(_doi)] | None = None
    contact: Annotated[NonEmptyText, AfterValidator(_address)] | None = None
    creators: tuple[Person, ...] = ()
    funding: tuple[Funding, ...] = ()
    related: tuple[Related, ...] = ()
    floors: tuple[_FloorEntry, ...] = ()


_PARTS: Mapping[str, type[Record]] = {
    "creators": Person,
    "funding": Funding,
    "related": Related,
    "floors": _FloorEntry,
}


def read_description(path: Path) -> Description:
    """Read a ``dataset.toml``.

    Raises DatasetError with file and field if it cannot be read or a value is invalid.
    """
    try:
        values = read_toml_values(path)
    except OSError as error:
        raise DatasetError(
            f"{path}: cannot be read ({error.strerror}); fill in the {DESCRIPTION_FILE} in the data set's folder"
        ) from error
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        raise DatasetError(f"{path}: not a valid TOML file ({error}); correct it") from error
    try:
        return Description.model_validate(values)
    except ValidationError as error:
        raise DatasetError(f"{path}: {_wrong_field(error)}") from error


def with_description(info: DatasetInfo, description: Description) -> DatasetInfo:
    """Put a description into a manifest. Fields without a value keep that of the manifest.

    Raises DatasetError if it describes a floor that the data set does not have.
    """
    names = description.model_fields_set - {"floors"}
    stated = {name: value for name in names if (value := getattr(description, name)) or name not in _PARTS}
    return info.model_copy(update=stated | {"floors": _georeferenced(info.floors, description.floors)})


def _georeferenced(floors: tuple[FloorInfo, ...], parts: tuple[_FloorEntry, ...]) -> tuple[FloorInfo, ...]:
    """Give each described floor its georeference."""
    found = {(floor.building, floor.number): floor for floor in floors}
    for part in parts:
        key = (part.building, part.number)
        if key not in found:
            there = ", ".join(f"{building} {number}".strip() for building, number in found)
            raise DatasetError(
                f"{DESCRIPTION_FILE}: floors: the data set has no floor {part.number}; its floors: {there}"
            )
        place = Georeference(**part.model_dump(exclude={"number", "building"}))
        found[key] = found[key].model_copy(update={"georeference": place})
    return tuple(found.values())


def missing_fields(info: DatasetInfo) -> tuple[str, ...]:
    """Return the recommended fields for publication that have no value, in the template's order."""
    wanted = ("title", "description", "licence", "creators", "keywords", "version", "published", "publisher", "contact")
    return tuple(name for name in wanted if not getattr(info, name))


_TEMPLATE = (
    ("title", "", "A data set of Wi-Fi fingerprints of our building"),
    ("description", "contents, place and way of recording, intended use", "Recorded by ..."),
    ("licence", "SPDX identifier", "CC-BY-4.0"),
    ("keywords", "", ("indoor positioning", "Wi-Fi fingerprints")),
    ("version", "", "1.0.0"),
    ("published", "a date without quotation marks", dt.date(2026, 3, 1)),
    ("publisher", "the repository, such as Zenodo", "Zenodo"),
    ("doi", "if the repository has reserved one", "10.5281/zenodo.1234567"),
    ("contact", "e-mail address or URL", "maps@example.org"),
)
_TABLES: tuple[tuple[str, str, Mapping[str, object]], ...] = (
    (
        "creators",
        "one block for each person (Family, Given) or organisation (without a comma)",
        {"name": "Carberry, Josiah", "affiliation": "Brown University", "orcid": "0000-0002-1825-0097"},
    ),
    ("funding", "one block for each grant", {"funder": "A foundation", "award": "12345"}),
    (
        "related",
        f"DOI, arXiv:number or URL; relation: {', '.join(get_args(DataCiteRelation))}",
        {"identifier": "10.5555/12345678", "relation": "IsDescribedBy"},
    ),
    (
        "floors",
        "one block for each floor: position of the plan's lower left corner (WGS84), direction of up on the plan "
        "(clockwise from true north), building if there are several",
        {"number": 1, "latitude_deg": 50.7796, "longitude_deg": 6.0685, "bearing_deg": 0.0},
    ),
)


def description_text(info: DatasetInfo) -> str:
    """Write a ``dataset.toml`` from the manifest; unknown fields are comments to fill in."""
    lines = [
        "# Facts about the data set that only you know. Fill in, then: vislam2tag dataset ... --describe dataset.toml",
        "# All fields are optional. Lines that begin with # are comments.",
        "",
    ]
    for name, comment, example in _TEMPLATE:
        value = getattr(info, name)
        about = f"  # {comment}" if comment and not value else ""
        lines.append(f"{'' if value else '# '}{name} = {toml_value(value or example)}{about}")
    for name, comment, table in _TABLES:
        parts = _known_parts(info, name)
        lines += ["", f"# {comment}"]
        for part in parts or [table]:
            lines += [f"{'' if parts else '# '}{line}" for line in (f"[[{name}]]", *map(_line, part.items()))]
    return "\n".join(lines) + "\n"


def _known_parts(info: DatasetInfo, name: str) -> list[Mapping[str, object]]:
    if name != "floors":
        return [part.model_dump(exclude_none=True) for part in getattr(info, name)]
    return [
        {"number": floor.number, "building": floor.building, **floor.georeference.model_dump()}
        for floor in info.floors
        if floor.georeference
    ]


def _line(item: tuple[str, object]) -> str:
    return f"{item[0]} = {toml_value(item[1])}"


def _wrong_field(error: ValidationError) -> str:
    """Return the first wrong field, as it is written in the file, and why it is wrong."""
    wrong = error.errors()[0]
    place = "".join(f"[{part + 1}]" if isinstance(part, int) else f".{part}" for part in wrong["loc"]).lstrip(".")
    if wrong["type"] == "extra_forbidden":
        known = Description if len(wrong["loc"]) == 1 else _PARTS[str(wrong["loc"][0])]
        return f"{place}: no such field in a data set's description; fields are: {', '.join(known.model_fields)}"
    return f"{place}: {wrong['msg'].removeprefix('Value error, ')}"
