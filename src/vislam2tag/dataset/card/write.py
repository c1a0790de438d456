"""Writes the card of a data set into its folder, so that the folder uploads to a repository as it is."""

from __future__ import annotations

from pathlib import Path

from vislam2tag.common.files.folder import Folder
from vislam2tag.dataset.card.citation import citation_text
from vislam2tag.dataset.card.croissant import croissant_text
from vislam2tag.dataset.card.datacite import datacite_text
from vislam2tag.dataset.card.readme import readme_text
from vislam2tag.dataset.description import DESCRIPTION_FILE, description_text
from vislam2tag.dataset.folder import listed_files, sha256_of
from vislam2tag.dataset.model import Dataset
from vislam2tag.dataset.statistics.record import DatasetStatistics

README, CITATION, DATACITE, CROISSANT = "README.md", "CITATION.cff", "datacite.json", "croissant.json"
SUMS = "SHA256SUMS"


def write_card(dataset: Dataset, statistics: DatasetStatistics, folder: Folder) -> None:
    """Write the card into the data set's folder, last of all: ``SHA256SUMS`` covers all files except hidden ones.

    ``README.md`` (with Hugging Face's front matter), ``croissant.json`` and ``dataset.toml`` are always written,
    ``CITATION.cff`` and ``datacite.json`` only where what their schemas require is stated; the card says what is not.
    """
    texts = {
        README: readme_text(dataset, statistics),
        CITATION: citation_text(dataset.info),
        DATACITE: datacite_text(dataset.info),
        CROISSANT: croissant_text(dataset.info),
        DESCRIPTION_FILE: description_text(dataset.info),
    }
    for name, text in texts.items():
        if text is not None:
            folder.write(name, text)
    folder.write(SUMS, _sums(folder.path))


def _sums(folder: Path) -> str:
    """One line a file below the folder, as ``sha256sum`` writes and checks them; by name."""
    return "".join(f"{sha256_of(folder / name)}  {name}\n" for name in listed_files(folder) if name != SUMS)
