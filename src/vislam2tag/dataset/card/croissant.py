"""``croissant.json``: the tables as machine-learning libraries load them (Croissant 1.1, docs.mlcommons.org)."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping
from typing import Any

import polars as pl

from vislam2tag.dataset.card.citation import ORCID_URL, bibtex
from vislam2tag.dataset.card.columns import column_text
from vislam2tag.dataset.card.hugging_face import licence_url
from vislam2tag.dataset.model import DatasetInfo, Person, TableAccount
from vislam2tag.dataset.schema import KEYS, SCHEMAS

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
_CONTEXT: dict[str, Any] = {
    "@language": "en",
    "@vocab": "https://schema.org/",
    "citeAs": "cr:citeAs",
    "column": "cr:column",
    "conformsTo": "dct:conformsTo",
    "containedIn": "cr:containedIn",
    "cr": "http://mlcommons.org/croissant/",
    "data": {"@id": "cr:data", "@type": "@json"},
    "dataType": {"@id": "cr:dataType", "@type": "@vocab"},
    "dct": "http://purl.org/dc/terms/",
    "description": {"@container": "@language"},
    "equivalentProperty": "cr:equivalentProperty",
    "examples": {"@id": "cr:examples", "@type": "@json"},
    "extract": "cr:extract",
    "field": "cr:field",
    "fileObject": "cr:fileObject",
    "fileProperty": "cr:fileProperty",
    "fileSet": "cr:fileSet",
    "format": "cr:format",
    "includes": "cr:includes",
    "isArray": "cr:isArray",
    "arrayShape": "cr:arrayShape",
    "isLiveDataset": "cr:isLiveDataset",
    "jsonPath": "cr:jsonPath",
    "key": "cr:key",
    "md5": "cr:md5",
    "name": {"@container": "@language"},
    "parentField": "cr:parentField",
    "path": "cr:path",
    "rai": "http://mlcommons.org/croissant/RAI/",
    "recordSet": "cr:recordSet",
    "references": "cr:references",
    "regex": "cr:regex",
    "repeated": "cr:repeated",
    "replace": "cr:replace",
    "samplingRate": "cr:samplingRate",
    "sc": "https://schema.org/",
    "separator": "cr:separator",
    "source": "cr:source",
    "subField": "cr:subField",
    "transform": "cr:transform",
}
"""The context that the standard's text gives, whole, as its readers compare it."""


def croissant_text(info: DatasetInfo) -> str:
    """Write ``croissant.json`` of the tables and splits that the manifest accounts for."""
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
        "creator": [_creator(person) for person in info.creators],
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
    stated = {name: value for name, value in fields.items() if value}
    return json.dumps(stated, indent=1, ensure_ascii=False) + "\n"


def _files(info: DatasetInfo) -> Iterator[tuple[str, TableAccount, dict[str, pl.DataType]]]:
    """Yield the name, the account and the columns of each table, then of each split."""
    for name, account in info.tables.items():
        yield name, account, dict(SCHEMAS[name])
    for name, account in info.splits.items():
        yield f"split_{name}", account, _SPLIT_SCHEMA


def _creator(person: Person) -> dict[str, Any]:
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
