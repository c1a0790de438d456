"""What all tests share: how Hypothesis draws, and the real and published data beside the checkout, where it is.

Examples are the same in each run and take as long as they take, so that no result depends on luck or on how busy the
machine is; ``--hypothesis-profile=explore`` draws many new ones.
"""

from __future__ import annotations

import tarfile
from collections.abc import Iterator
from pathlib import Path

import pytest
from hypothesis import HealthCheck, settings

from tests import campaign
from tests.campaign import pytest_addoption, pytest_configure
from tests.stores import Bucket, azure_container, bucket, google_bucket
from tests.undrawn import undrawn
from vislam2tag.cli import options

options.ALL_CORES = 1
"""Tests of several processes ask for them by ``--jobs``: each imports all that it needs anew."""

__all__ = ["pytest_addoption", "pytest_configure"]
SHARED = Path(__file__).resolve().parents[2] / "shared" / "data"

settings.register_profile(
    "repeatable", derandomize=True, deadline=None, suppress_health_check=[HealthCheck.too_slow], print_blob=True
)
settings.register_profile("explore", settings.get_profile("repeatable"), derandomize=False, max_examples=1000)
settings.load_profile("repeatable")


def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    """Take the longest test first, so that not all but one worker wait for it at the end."""
    items.sort(key=lambda item: item.path.name != "test_fuzz.py")
    campaign.pytest_collection_modifyitems(config, items)


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


@pytest.fixture(scope="session")
def s3() -> Iterator[Bucket]:
    """An object store, empty but for what other tests put below names of their own."""
    with bucket() as made:
        yield made


@pytest.fixture(scope="session")
def azure() -> Iterator[Bucket]:
    """Azure's object store, as :func:`s3`."""
    with azure_container() as made:
        yield made


@pytest.fixture(scope="session")
def google() -> Iterator[Bucket]:
    """Google's object store, as :func:`s3`."""
    with google_bucket() as made:
        yield made


@pytest.fixture
def undrawn_figures() -> Iterator[None]:
    with undrawn():
        yield
