from __future__ import annotations

import pytest
from pydantic import ValidationError

from vislam2tag.settings import FindingSettings


@pytest.mark.parametrize("name", sorted(FindingSettings.model_fields))
@pytest.mark.parametrize("value", [0.0, -1.0, float("nan")])
def test_limits_of_findings_are_positive(name: str, value: float) -> None:
    with pytest.raises(ValidationError):
        FindingSettings.model_validate({name: value})
