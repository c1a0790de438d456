from __future__ import annotations

import json

import pytest
from pydantic import ValidationError

from vislam2tag.labeling.settings import LabelSettings
from vislam2tag.sessions.settings import FindingSettings
from vislam2tag.settings import Settings


@pytest.mark.parametrize("name", sorted(FindingSettings.model_fields))
@pytest.mark.parametrize("value", [0.0, -1.0, float("nan")])
def test_limits_of_findings_are_positive(name: str, value: float) -> None:
    with pytest.raises(ValidationError):
        FindingSettings.model_validate({name: value})


@pytest.mark.parametrize("limit_m", [0.3, float("inf")])
def test_the_limit_of_uncertainty_survives_strict_json(limit_m: float) -> None:
    settings = Settings(labels=LabelSettings(max_sigma_m=limit_m))
    text = json.dumps(settings.model_dump(mode="json"), allow_nan=False)
    assert Settings.model_validate_json(text) == settings
    assert Settings.model_validate_json(settings.model_dump_json()) == settings


@pytest.mark.parametrize("limit_m", [0.0, -1.0, float("nan")])
def test_the_limit_of_uncertainty_is_positive(limit_m: float) -> None:
    with pytest.raises(ValidationError):
        LabelSettings(max_sigma_m=limit_m)
