"""Front matter of ``README.md`` as Hugging Face reads it (hub-docs, ``datasetcard.md``)."""

from __future__ import annotations

from typing import Any

import yaml

from vislam2tag.dataset.card.licences import hugging_face_licence
from vislam2tag.dataset.model import DatasetInfo

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
