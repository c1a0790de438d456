"""Machine-readable parts of a data set's card: citation, DOI metadata and machine-learning metadata.

- Licences by name and link, and the front matter of ``README.md`` as Hugging Face reads it (``datasetcard.md``).
- ``CITATION.cff`` (Citation File Format 1.2.0) and BibTeX.
- ``datacite.json``: the metadata that a repository needs to register a DOI (DataCite metadata schema 4.5).
- ``croissant.json``: the tables for machine-learning libraries (Croissant 1.1, docs.mlcommons.org).
"""

from __future__ import annotations

import json
import re
from collections.abc import Iterator, Mapping
from types import MappingProxyType
from typing import Any

import polars as pl
import yaml

from vislam2tag.datasets.description import Funding, Person, Related
from vislam2tag.datasets.model import DatasetInfo, TableAccount
from vislam2tag.datasets.schema import KEYS, SCHEMAS, column_text

_TEXTS = MappingProxyType(
    {
        "CC0-1.0": "https://creativecommons.org/publicdomain/zero/1.0/",
        "CC-BY-4.0": "https://creativecommons.org/licenses/by/4.0/",
        "CC-BY-SA-4.0": "https://creativecommons.org/licenses/by-sa/4.0/",
        "CC-BY-NC-4.0": "https://creativecommons.org/licenses/by-nc/4.0/",
        "CC-BY-NC-SA-4.0": "https://creativecommons.org/licenses/by-nc-sa/4.0/",
        "CC-BY-ND-4.0": "https://creativecommons.org/licenses/by-nd/4.0/",
        "ODbL-1.0": "https://opendatacommons.org/licenses/odbl/1-0/",
        "ODC-By-1.0": "https://opendatacommons.org/licenses/by/1-0/",
        "PDDL-1.0": "https://opendatacommons.org/licenses/pddl/1-0/",
    }
)
_HUGGING_FACE = MappingProxyType(
    {
        **{name: name.lower() for name in _TEXTS if name.startswith("CC")},
        "ODbL-1.0": "odbl",
        "ODC-By-1.0": "odc-by",
        "PDDL-1.0": "pddl",
        "Apache-2.0": "apache-2.0",
        "MIT": "mit",
    }
)
"""Licences of https://huggingface.co/docs/hub/repositories-licenses that are used for data."""
_SIZES = ("1K", "10K", "100K", "1M", "10M", "100M", "1B")
_TAGS = ("indoor-positioning", "fingerprinting", "wifi", "rssi", "tabular")


def licence_url(licence: str) -> str | None:
    """Return the URL of an SPDX licence's text; None for a custom licence and for an expression of several."""
    if licence.startswith("LicenseRef-") or " " in licence:
        return None
    return _TEXTS.get(licence, f"https://spdx.org/licenses/{licence}.html")


def hugging_face_licence(licence: str | None) -> dict[str, str]:
    """Return the licence's fields for Hugging Face's front matter: its own name, or ``other`` with name and link."""
    if licence is None:
        return {}
    if licence in _HUGGING_FACE:
        return {"license": _HUGGING_FACE[licence]}
    return {"license": "other", "license_name": licence.lower(), "license_link": licence_url(licence) or "LICENSE"}


def front_matter(info: DatasetInfo) -> str:
    """Write the YAML block: each table is a configuration, and the fingerprints are the default."""
    first = next(iter(info.tables), "")
    fields: dict[str, Any] = {
        "pretty_name": info.title or info.name,
        **hugging_face_licence(info.licence),
        "tags": [*_TAGS, *(word for word in info.keywords if word.lower() not in _TAGS)],
        "size_categories": [_size(info.tables[first].rows)] if first else [],
        "configs": [
            {"config_name": name, "data_files": account.file} | ({"default": True} if name == first else {})
            for name, account in info.tables.items()
        ],
    }
    return f"---\n{_yaml(fields)}---\n"


def _yaml(fields: dict[str, Any]) -> str:
    """YAML of the fields that have a value."""
    stated = {name: value for name, value in fields.items() if name and value}
    return yaml.safe_dump(stated, sort_keys=False, allow_unicode=True, width=120)


def _size(rows: int) -> str:
    place = sum(rows >= 1000 * 10**power for power in range(len(_SIZES)))
    below, above = (*_SIZES, None)[place], (None, *_SIZES)[place]
    return "n>1B" if below is None else f"{above}<n<{below}" if above else f"n<{below}"


def _json(fields: dict[str, Any]) -> str:
    """JSON of the fields that have a value."""
    stated = {name: value for name, value in fields.items() if value}
    return json.dumps(stated, indent=1, ensure_ascii=False) + "\n"


ORCID_URL = "https://orcid.org/"


def citation_text(info: DatasetInfo) -> str | None:
    """Write ``CITATION.cff``; None without a creator, which the format requires."""
    if not info.creators:
        return None
    url = licence_url(info.licence) if info.licence else None
    related = [part.identifier for part in info.related if part.identifier.startswith("http")]
    fields: dict[str, Any] = {
        "cff-version": "1.2.0",
        "message": "If you use this data set, please cite it as below.",
        "type": "dataset",
        "title": info.title or info.name,
        "abstract": info.description,
        "authors": [_author(person) for person in info.creators],
        "keywords": list(dict.fromkeys(info.keywords)),
        # The format's list of licences is of 2021 and has neither custom licences nor expressions.
        "license" if url else "": info.licence,
        "license-url": url,
        "version": info.version,
        "date-released": info.published,
        "doi": info.doi,
        "identifiers": [{"type": "url", "value": url, "description": "related"} for url in dict.fromkeys(related)],
    }
    return _yaml(fields)


def bibtex(info: DatasetInfo) -> str | None:
    """Write the data set as a BibTeX entry; None without a creator."""
    if not info.creators:
        return None
    fields = {
        "author": " and ".join(_bibtex_author(person) for person in info.creators),
        "title": _braced(info.title or info.name),
        "year": info.published and f"{info.published.year:04d}",
        "publisher": info.publisher and _braced(info.publisher),
        "version": info.version and _braced(info.version),
        "doi": info.doi,
    }
    lines = [f"  {name} = {{{value}}}" for name, value in fields.items() if value]
    return f"@misc{{{re.sub(r'[^A-Za-z0-9._-]+', '-', info.name)},\n" + ",\n".join(lines) + "\n}"


def _bibtex_author(person: Person) -> str:
    """Write a name; organisations are in braces, so that they stay whole."""
    return _braced(person.name) if "," in person.name else f"{{{_braced(person.name)}}}"


def _braced(text: str) -> str:
    """Write text for use in braces: TeX special characters are escaped, and unpaired braces removed."""
    return re.sub(r"([&%$#_])", r"\\\1", re.sub(r"[{}\\]", "", " ".join(text.split())))


def _author(person: Person) -> dict[str, str]:
    family, comma, given = person.name.partition(",")
    names = {"family-names": family.strip(), "given-names": given.strip()} if comma else {"name": person.name}
    orcid = {"orcid": ORCID_URL + person.orcid} if person.orcid else {}
    # An organisation has no affiliation in this format.
    affiliation = {"affiliation": person.affiliation} if person.affiliation and comma else {}
    return {name: value for name, value in (names | affiliation | orcid).items() if value}


REQUIRED = ("creators", "publisher", "published")
"""Fields that the schema requires besides a title, and for which it has no value for "unknown"."""


def datacite_text(info: DatasetInfo) -> str | None:
    """Write ``datacite.json``; None if a field that the schema requires is missing."""
    if not all(getattr(info, name) for name in REQUIRED) or info.published is None:
        return None
    fields: dict[str, Any] = {
        "doi": info.doi,
        "types": {"resourceType": "Indoor positioning data set", "resourceTypeGeneral": "Dataset"},
        "creators": [_datacite_creator(person) for person in info.creators],
        "titles": [{"title": info.title or info.name}],
        "publisher": {"name": info.publisher},
        "publicationYear": f"{info.published.year:04d}",
        "dates": [{"date": info.published.isoformat(), "dateType": "Issued"}],
        "subjects": [{"subject": word} for word in dict.fromkeys(info.keywords)],
        "descriptions": [{"description": info.description, "descriptionType": "Abstract"}] if info.description else [],
        "version": info.version,
        "rightsList": [_rights(info.licence)] if info.licence else [],
        "fundingReferences": [_funding(part) for part in info.funding],
        "relatedIdentifiers": [_related(part) for part in info.related],
        "sizes": [f"{sum(table.size_bytes for table in info.tables.values())} bytes"] if info.tables else [],
        "formats": ["application/vnd.apache.parquet"] if info.tables else [],
        "schemaVersion": "http://datacite.org/schema/kernel-4",
    }
    return _json(fields)


def _datacite_creator(person: Person) -> dict[str, Any]:
    family, comma, given = (part.strip() for part in person.name.partition(","))
    creator: dict[str, Any] = {"name": person.name}
    if comma:
        creator |= {"nameType": "Personal", "givenName": given, "familyName": family}
    if person.affiliation:
        creator["affiliation"] = [{"name": person.affiliation}]
    if person.orcid:
        identifier = {"nameIdentifier": ORCID_URL + person.orcid, "nameIdentifierScheme": "ORCID"}
        creator["nameIdentifiers"] = [identifier | {"schemeUri": ORCID_URL.rstrip("/")}]
    return creator


def _rights(licence: str) -> dict[str, str]:
    url = licence_url(licence)
    if url is None:
        return {"rights": licence}
    spdx = {"rightsIdentifier": licence, "rightsIdentifierScheme": "SPDX", "schemeUri": "https://spdx.org/licenses/"}
    return {"rights": licence, "rightsUri": url, **spdx}


def _funding(part: Funding) -> dict[str, str]:
    return {"funderName": part.funder} | ({"awardNumber": part.award} if part.award else {})


def _related(part: Related) -> dict[str, str]:
    kind = "URL" if part.identifier.startswith("http") else "arXiv" if part.identifier.startswith("arXiv") else "DOI"
    return {
        "relatedIdentifier": part.identifier,
        "relatedIdentifierType": kind,
        "relationType": part.relation,
    }


_SPLIT_SCHEMA: dict[str, pl.DataType] = {"id": pl.String(), "group": pl.String()}
_TYPES: Mapping[str, str] = {
    "String": "sc:Text",
    "Boolean": "sc:Boolean",
    "Date": "sc:Date",
    "Datetime": "sc:DateTime",
    "Int32": "cr:Int32",
    "Int64": "cr:Int64",
    "Float32": "cr:Float32",
    "Float64": "cr:Float64",
}
_TERMS = (
    "@language @vocab citeAs column conformsTo containedIn cr data dataType dct description equivalentProperty "
    "examples extract field fileObject fileProperty fileSet format includes isArray arrayShape isLiveDataset jsonPath",
    "key md5 name parentField path rai recordSet references regex repeated replace samplingRate sc separator source "
    "subField transform",
)
_CONTEXT: dict[str, Any] = {name: f"cr:{name}" for name in " ".join(_TERMS).split()} | {
    "@language": "en",
    "@vocab": "https://schema.org/",
    "conformsTo": "dct:conformsTo",
    "cr": "http://mlcommons.org/croissant/",
    "data": {"@id": "cr:data", "@type": "@json"},
    "dataType": {"@id": "cr:dataType", "@type": "@vocab"},
    "dct": "http://purl.org/dc/terms/",
    "description": {"@container": "@language"},
    "examples": {"@id": "cr:examples", "@type": "@json"},
    "name": {"@container": "@language"},
    "rai": "http://mlcommons.org/croissant/RAI/",
    "sc": "https://schema.org/",
}
"""The context that the standard's text gives, whole, as its readers compare it."""


def croissant_text(info: DatasetInfo) -> str:
    """Write ``croissant.json`` for the tables and splits in the manifest."""
    files = list(_files(info))
    doi = f"https://doi.org/{info.doi}" if info.doi else None
    fields: dict[str, Any] = {
        "@context": _CONTEXT,
        "@type": "sc:Dataset",
        "conformsTo": "http://mlcommons.org/croissant/1.1",
        "name": info.name,
        "alternateName": info.title,
        "description": info.description or info.title,
        "license": (licence_url(info.licence) or info.licence) if info.licence else None,
        "creator": [_croissant_creator(person) for person in info.creators],
        "publisher": {"@type": "sc:Organization", "name": info.publisher} if info.publisher else None,
        "keywords": list(info.keywords),
        "citeAs": bibtex(info),
        "version": info.version,
        "datePublished": info.published.isoformat() if info.published else None,
        "url": doi,
        "funder": [{"@type": "sc:Organization", "name": part.funder} for part in info.funding],
        "distribution": [_file(account) for _, account, _ in files],
        "recordSet": [_records(name, account, schema) for name, account, schema in files],
    }
    return _json(fields)


def _files(info: DatasetInfo) -> Iterator[tuple[str, TableAccount, dict[str, pl.DataType]]]:
    """Yield the name, the account and the columns of each table, then of each split."""
    for name, account in info.tables.items():
        yield name, account, dict(SCHEMAS[name])
    for name, account in info.splits.items():
        yield f"split_{name}", account, _SPLIT_SCHEMA


def _croissant_creator(person: Person) -> dict[str, Any]:
    kind = "sc:Person" if "," in person.name else "sc:Organization"
    creator: dict[str, Any] = {"@type": kind, "name": person.name}
    if person.affiliation:
        creator["affiliation"] = {"@type": "sc:Organization", "name": person.affiliation}
    if person.orcid:
        creator["sameAs"] = ORCID_URL + person.orcid
    return creator


def _file(account: TableAccount) -> dict[str, Any]:
    return {
        "@type": "cr:FileObject",
        "@id": account.file,
        "name": account.file,
        "contentUrl": account.file,
        "contentSize": f"{account.size_bytes} B",
        "encodingFormat": "application/x-parquet",
        "sha256": account.sha256,
    }


def _records(name: str, account: TableAccount, schema: dict[str, pl.DataType]) -> dict[str, Any]:
    records: dict[str, Any] = {"@type": "cr:RecordSet", "@id": name, "name": name}
    if name in KEYS:
        records["key"] = {"@id": f"{name}/{KEYS[name]}"}
    return records | {"field": [_field(name, account.file, column, kind) for column, kind in schema.items()]}


def _field(table: str, file: str, column: str, kind: pl.DataType) -> dict[str, Any]:
    inner = kind.inner if isinstance(kind, pl.List) else kind
    field = {
        "@type": "cr:Field",
        "@id": f"{table}/{column}",
        "name": column,
        "description": column_text(table, column),
        "dataType": _TYPES[str(inner.base_type())],
        "source": {"fileObject": {"@id": file}, "extract": {"column": column}},
    }
    return field | ({"isArray": True, "arrayShape": "-1"} if isinstance(kind, pl.List) else {})
