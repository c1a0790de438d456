"""Surveys that the studio's tests share; what a test changes it puts back."""

from __future__ import annotations

import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from tests.studio.faulty_survey import write_faulty_survey
from tests.studio.running import Page, running_studio
from vislam2tag.pipeline.labels.process import process


@pytest.fixture(scope="session")
def faulty(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The folder of a survey with faults, labelled."""
    folder = tmp_path_factory.mktemp("faulty")
    survey = write_faulty_survey(folder)
    process(survey, folder / "labels")
    return folder


@pytest.fixture(scope="session")
def faults(faulty: Path) -> dict[str, Any]:
    content: dict[str, Any] = json.loads((faulty / "faults.json").read_text())
    return content


@pytest.fixture(scope="session")
def page(faulty: Path) -> Iterator[Page]:
    """A page of a studio on that survey, entered."""
    with running_studio(faulty / "survey", "--labels", str(faulty / "labels"), "--jobs", "1") as page:
        assert page.enter().status_code == 204
        yield page
