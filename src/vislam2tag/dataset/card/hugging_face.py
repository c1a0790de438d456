"""Licences by name and link, and the front matter of ``README.md`` as Hugging Face reads it (``datasetcard.md``)."""

from __future__ import annotations

from types import MappingProxyType
from typing import Any

import yaml

from vislam2tag.dataset.model import DatasetInfo

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
"""Of https://huggingface.co/docs/hub/repositories-licenses, those that data are given under."""
_SIZES = (
    (1_000, "n<1K"),
    (10_000, "1K<n<10K"),
    (100_000, "10K<n<100K"),
    (1_000_000, "100K<n<1M"),
    (10_000_000, "1M<n<10M"),
    (100_000_000, "10M<n<100M"),
    (1_000_000_000, "100M<n<1B"),
)
_TAGS = ("indoor-positioning", "fingerprinting", "wifi", "rssi", "tabular")


def licence_url(licence: str) -> str | None:
    """Return where the text of an SPDX licence stands; None for one of one's own and for an expression of several."""
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
    """Write the YAML block: each table is a configuration of its own, the fingerprints the default."""
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
    stated = {name: value for name, value in fields.items() if value}
    return "---\n" + yaml.safe_dump(stated, sort_keys=False, allow_unicode=True, width=120) + "---\n"


def _size(rows: int) -> str:
    return next((name for most, name in _SIZES if rows < most), "n>1B")
