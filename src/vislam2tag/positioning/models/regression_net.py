"""The paper's 3-D regression network, with its published settings.

The settings of the program behind the paper's numbers, in our terms (``../networks/regression.py`` explains them).
"""

from __future__ import annotations

from typing import Any

from vislam2tag.common.errors import import_extra
from vislam2tag.positioning.registry import Positioner, register

PUBLISHED: dict[str, dict[str, Any]] = {
    "giaIndoorLoc": {},
    "tampere": {"head": (128,), "epochs": 100, "patience": 100, "validation_share": 0.2},
}
"""Parameters by data set; the defaults are those of the VI-SLAM2tag paper's table (giaIndoorLoc)."""


def regression_net(**parameters: Any) -> Positioner:
    """Make a 3-D regression model; raises UsageError if PyTorch is not installed."""
    model: Positioner = import_extra("vislam2tag.positioning.networks.regression").RegressionNet(**parameters)
    return model


register("regression-net", regression_net)
