"""``datacite.json``: what a repository asks for when it registers a DOI (DataCite metadata schema 4.5)."""

from __future__ import annotations

import json
from typing import Any

from vislam2tag.dataset.card.citation import ORCID_URL
from vislam2tag.dataset.card.hugging_face import licence_url
from vislam2tag.dataset.model import DatasetInfo, Funding, Person, Related

REQUIRED = ("creators", "publisher", "published")
"""What the schema asks for besides a title and has no word for unknown."""


def datacite_text(info: DatasetInfo) -> str | None:
    """Write ``datacite.json``; None where a field that the schema requires is not stated."""
    if not all(getattr(info, name) for name in REQUIRED) or info.published is None:
        return None
    fields: dict[str, Any] = {
        "doi": info.doi,
        "types": {"resourceType": "Indoor positioning data set", "resourceTypeGeneral": "Dataset"},
        "creators": [_creator(person) for person in info.creators],
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
    stated = {name: value for name, value in fields.items() if value}
    return json.dumps(stated, indent=1, ensure_ascii=False) + "\n"


def _creator(person: Person) -> dict[str, Any]:
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
