"""multi-CEL, the paper's better network, with its published settings.

The settings of the program behind the paper's numbers, in our terms (``../networks/multi_cel.py`` explains them).
"""

from __future__ import annotations

from typing import Any

from vislam2tag.common.errors import import_extra
from vislam2tag.positioning.registry import Positioner, register

PUBLISHED: dict[str, dict[str, Any]] = {
    "giaIndoorLoc": {},
    "tampere": {
        "cell_m": 20.0,
        "overlap": 0.5,
        "heads": (128,),
        "epochs": 100,
        "patience": 100,
        "validation_share": 0.2,
    },
    "ujiindoorloc": {
        "cell_m": 30.0,
        "backbone": (512, 512),
        "heads": (256,),
        "input_scale": "powed",
        "epochs": 20,
        "learning_rate": 5e-4,
    },
}
"""Parameters by data set; the defaults are those of the VI-SLAM2tag paper's table (giaIndoorLoc)."""


def multi_cel(**parameters: Any) -> Positioner:
    """Make a multi-CEL model; raises UsageError if PyTorch is not installed."""
    model: Positioner = import_extra("vislam2tag.positioning.networks.multi_cel").MultiCel(**parameters)
    return model


register("multi-cel", multi_cel)
