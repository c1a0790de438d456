"""Values of models' parameters as the command line gives them."""

from __future__ import annotations

import json
from collections.abc import Sequence
from typing import Any

from vislam2tag.common.errors import UsageError


def value_of(text: str) -> Any:
    """Read numbers, true, false, null and lists as JSON has them, anything else as text."""
    try:
        value = json.loads(text)
    except ValueError:
        return text
    return tuple(value) if isinstance(value, list) else value


def parameters_of(texts: Sequence[str]) -> dict[str, Any]:
    """Read ``PARAMETER=VALUE``; raises UsageError for what is not of this form."""
    parameters = {}
    for text in texts:
        name, equals, value = text.partition("=")
        if not (name and equals):
            raise UsageError(f"--set {text}: give PARAMETER=VALUE, such as k=5")
        parameters[name] = value_of(value)
    return parameters
