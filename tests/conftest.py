"""Fixtures shared by all tests: the real and published data beside the checkout, where it is."""

from __future__ import annotations

import tarfile
from pathlib import Path

import pytest

SHARED = Path(__file__).resolve().parents[2] / "shared" / "data"


def shared_folder(name: str) -> Path:
    folder = SHARED / name
    if not folder.is_dir():
        pytest.skip(f"the data folder ../shared/data/{name} is not beside this checkout")
    return folder


@pytest.fixture(scope="session")
def real_walks() -> Path:
    """Three real walks in the raw layout, with truth."""
    return shared_folder("real-walks")


@pytest.fixture(scope="session")
def agreement(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Generated sessions (``raw``) and what the published program makes of them (``published-output``)."""
    out = tmp_path_factory.mktemp("agreement")
    with tarfile.open(shared_folder("agreement") / "agreement.tar.xz") as archive:
        archive.extraction_filter = getattr(tarfile, "data_filter", None)  # Python 3.11.2 has none
        archive.extractall(out)
    return out
