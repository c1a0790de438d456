"""Labels of a small simulated survey, and of the survey that the published program's output is known for."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.surveys import make_survey
from vislam2tag.labeling.settings import LabelRule, LabelSettings
from vislam2tag.pipeline.labels.process import process
from vislam2tag.settings import Settings


@pytest.fixture(scope="session")
def survey(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Two floors, a walk each, a scan that repeats readings."""
    folder = tmp_path_factory.mktemp("formats") / "survey"
    return make_survey(folder, floors=2, devices=("LG",), seconds=120.0, traps=("stale_wifi", "odd_ssids"))


@pytest.fixture(scope="session")
def labels(survey: Path) -> Path:
    """By the paper's strategy, which states no sigma: the labelled layout loses none."""
    out = survey.parent / "labels"
    process(survey, out, Settings(strategy="local"))
    return out


@pytest.fixture(scope="session")
def labels_as_published(agreement: Path) -> Path:
    """Labels by the published program's own rules."""
    out = agreement / "labels"
    rule = LabelSettings(rule=LabelRule.NEXT_FRAME)
    process(agreement / "raw", out, Settings(strategy="local-corrected", labels=rule))
    return out
