"""Surveys and runs shared by the pipeline's tests; they are read only."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.pipeline.paper.paper_copy import make_paper_copy
from tests.surveys import make_survey
from vislam2tag.pipeline.labels.process import process
from vislam2tag.settings import Settings


@pytest.fixture(scope="session")
def clean_survey(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Two floors, two phones, a perfect tracker."""
    return make_survey(tmp_path_factory.mktemp("clean") / "survey", floors=2, seconds=120.0)


@pytest.fixture(scope="session")
def clean_run(clean_survey: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The output folder of ``process`` with its defaults."""
    out = tmp_path_factory.mktemp("clean_run") / "out"
    process(clean_survey, out)
    return out


@pytest.fixture(scope="session")
def local_run(clean_survey: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The output folder of a strategy that does not label everything."""
    out = tmp_path_factory.mktemp("local_run") / "out"
    process(clean_survey, out, Settings(strategy="local-corrected"))
    return out


@pytest.fixture(scope="session")
def paper_copy(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The sessions that the paper's figures show, as one survey."""
    return make_paper_copy(tmp_path_factory.mktemp("paper") / "evaluation_data")
