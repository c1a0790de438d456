"""How to cite the data set: ``CITATION.cff`` (Citation File Format 1.2.0) and BibTeX."""

from __future__ import annotations

import re
from typing import Any

import yaml

from vislam2tag.dataset.card.hugging_face import licence_url
from vislam2tag.dataset.model import DatasetInfo, Person

ORCID_URL = "https://orcid.org/"


def citation_text(info: DatasetInfo) -> str | None:
    """Write ``CITATION.cff``; None where no creator is stated, without whom the format allows none."""
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
        # The format's list of licences is of 2021 and knows neither one's own nor expressions.
        "license" if url else "": info.licence,
        "license-url": url,
        "version": info.version,
        "date-released": info.published,
        "doi": info.doi,
        "identifiers": [{"type": "url", "value": url, "description": "related"} for url in dict.fromkeys(related)],
    }
    stated = {name: value for name, value in fields.items() if name and value}
    return yaml.safe_dump(stated, sort_keys=False, allow_unicode=True, width=120)


def bibtex(info: DatasetInfo) -> str | None:
    """Write the set as an entry of BibTeX; None where no creator is stated."""
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
    """Write a name; that of an organisation in braces, so that it stays whole."""
    return _braced(person.name) if "," in person.name else f"{{{_braced(person.name)}}}"


def _braced(text: str) -> str:
    """Write text so that it stands in braces: with what TeX takes for its own escaped, unpaired braces left out."""
    return re.sub(r"([&%$#_])", r"\\\1", re.sub(r"[{}\\]", "", " ".join(text.split())))


def _author(person: Person) -> dict[str, str]:
    family, comma, given = person.name.partition(",")
    names = {"family-names": family.strip(), "given-names": given.strip()} if comma else {"name": person.name}
    orcid = {"orcid": ORCID_URL + person.orcid} if person.orcid else {}
    # An organisation has no affiliation in this format.
    affiliation = {"affiliation": person.affiliation} if person.affiliation and comma else {}
    return {name: value for name, value in (names | affiliation | orcid).items() if value}
