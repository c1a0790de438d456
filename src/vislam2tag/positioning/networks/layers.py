"""What networks over scans are made of: the input scaling and dense layers."""

from __future__ import annotations

from collections.abc import Sequence
from enum import StrEnum

import torch

from vislam2tag.positioning.scans.radio_scans import RadioScans
from vislam2tag.positioning.scans.representation import EXPONENT, FAINTEST_DBM

NOT_HEARD_DBM = -110.0
"""What the paper's networks take an access point that is not heard for."""


class InputScale(StrEnum):
    """How levels become a network's inputs."""

    MIN_MAX = "min-max"
    """Linear from not heard (-110 dBm) to the strongest level in training; the paper's."""
    POWED = "powed"
    """The powed representation (Torres-Sospedra et al. 2015); the authors' for UJIIndoorLoc."""


class LevelScaling(torch.nn.Module):  # type: ignore[misc]  # torch counts as Any
    """From levels (n, a) in dBm, NaN where not heard, to inputs from 0 (not heard) to 1."""

    def __init__(self) -> None:
        super().__init__()
        for name in ("faintest_dbm", "strongest_dbm", "exponent"):
            self.register_buffer(name, torch.ones((), dtype=torch.float64))

    def fit(self, scans: RadioScans, scale: InputScale) -> None:
        """Take the limits from training scans; at least one of them hears something."""
        if scale is InputScale.POWED:
            limits = FAINTEST_DBM, 0.0, EXPONENT
        else:
            limits = NOT_HEARD_DBM, max(float(scans.rssi_dbm.max()), NOT_HEARD_DBM + 1.0), 1.0
        for buffer, value in zip(self.buffers(), limits, strict=True):
            buffer.fill_(value)

    def forward(self, level_dbm: torch.Tensor) -> torch.Tensor:
        """Scale levels (n, a); what is louder than anything in training counts as that."""
        heard = torch.where(torch.isnan(level_dbm), self.faintest_dbm, level_dbm)
        share = (heard - self.faintest_dbm) / (self.strongest_dbm - self.faintest_dbm)
        return share.clamp(0.0, 1.0) ** self.exponent


def linear(inputs: int, outputs: int) -> torch.nn.Linear:
    """Make a layer that starts as the published program's do: weights by Glorot and Bengio (2010), no bias."""
    layer = torch.nn.Linear(inputs, outputs)
    torch.nn.init.xavier_uniform_(layer.weight)
    torch.nn.init.zeros_(layer.bias)
    return layer


def dense(inputs: int, widths: Sequence[int], dropout: float) -> torch.nn.Sequential:
    """Make dense layers of these widths, each followed by ReLU and dropout."""
    layers: list[torch.nn.Module] = []
    for width in widths:
        layers += [linear(inputs, width), torch.nn.ReLU(), torch.nn.Dropout(dropout)]
        inputs = width
    return torch.nn.Sequential(*layers)
