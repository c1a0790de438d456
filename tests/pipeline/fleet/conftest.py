"""A small fleet in a bucket, processed once; tests read it only."""

from __future__ import annotations

from pathlib import Path
from typing import NamedTuple

import pytest

from tests.cli.command import vislam2tag
from tests.stores import Bucket
from tests.surveys import make_survey

CONFIG = 'strategy = "local-corrected"\n'


class SmallFleet(NamedTuple):
    """Two surveys on disk, and a fleet of them in a bucket."""

    s3: Bucket
    surveys: dict[str, Path]
    config: Path
    name: str
    processed: list[str]
    """Requests that processing took."""

    @property
    def address(self) -> str:
        return self.s3.store(self.name).address


@pytest.fixture(scope="session")
def fleet(s3: Bucket, tmp_path_factory: pytest.TempPathFactory) -> SmallFleet:
    """Ward: two floors, a session each; hall: one floor, two devices."""
    folder = tmp_path_factory.mktemp("fleet")
    (folder / "settings.toml").write_text(CONFIG)
    surveys = {
        "hall": make_survey(folder / "hall", seconds=25.0),
        "ward": make_survey(folder / "ward", floors=2, devices=("LG",), seconds=25.0, seed=4),
    }
    made = SmallFleet(s3, surveys, folder / "settings.toml", "small-fleet", [])
    assert vislam2tag("fleet", "add", made.address, *surveys.values()).returncode == 0
    s3.seen()
    done = vislam2tag("fleet", "process", made.address, "--jobs", "1", "--config", made.config)
    assert done.returncode == 0, done.stderr
    return made._replace(processed=s3.seen())
