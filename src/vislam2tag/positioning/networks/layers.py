"""Parts of networks over scans: input scaling, dense layers, and a complete network from levels to places.

One module maps levels in dBm to places in metres, so that prediction and the ONNX export are the same.
"""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Sequence
from enum import StrEnum
from typing import NamedTuple

import torch

from vislam2tag.core.arrays import FloatArray
from vislam2tag.positioning.error_radii import SMALLEST_SCALE_M, SpreadRadii
from vislam2tag.positioning.radio_scans import EXPONENT, FAINTEST_DBM, RadioScans

NOT_HEARD_DBM = -110.0
"""Level of an access point that is not heard, in the paper's networks."""


class InputScale(StrEnum):
    """How levels become a network's inputs."""

    MIN_MAX = "min-max"
    """Linear from not heard (-110 dBm) to the strongest level in training; the paper's."""
    POWED = "powed"
    """The powed representation (Torres-Sospedra et al. 2015); the authors' for UJIIndoorLoc."""


class LevelScaling(torch.nn.Module):  # type: ignore[misc]  # torch counts as Any
    """From levels (n, a) in dBm, NaN if not heard, to inputs from 0 (not heard) to 1."""

    def __init__(self) -> None:
        super().__init__()
        for name in ("faintest_dbm", "strongest_dbm", "exponent"):
            self.register_buffer(name, torch.ones((), dtype=torch.float64))

    def fit(self, scans: RadioScans, scale: InputScale) -> None:
        """Set the limits from training scans; at least one of them hears something."""
        if scale is InputScale.POWED:
            limits = FAINTEST_DBM, 0.0, EXPONENT
        else:
            limits = NOT_HEARD_DBM, max(float(scans.rssi_dbm.max()), NOT_HEARD_DBM + 1.0), 1.0
        for buffer, value in zip(self.buffers(), limits, strict=True):
            buffer.fill_(value)

    def forward(self, level_dbm: torch.Tensor) -> torch.Tensor:
        """Scale levels (n, a); levels stronger than all in training count as the strongest one."""
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


OUTPUTS = ("xy", "z", "storey", "storey_probability", "radius_68_m", "radius_95_m")
"""What :meth:`Locator.forward` returns, as the fields of :class:`~vislam2tag.positioning.places.Positions`."""


class NetworkAnswer(NamedTuple):
    """Answers of a network for ``n`` scans."""

    xy: torch.Tensor
    """(n, 2) metres."""
    storey: torch.Tensor
    """(n,)"""
    storey_probability: torch.Tensor
    """(n, s)"""
    spread_m: torch.Tensor
    """(n,) spread of the network's own guesses; 0 if there is one."""


class Locator(torch.nn.Module):  # type: ignore[misc]  # torch counts as Any
    """Trained in single precision; answers in double, so that places far from the origin keep their precision."""

    def __init__(self, network: torch.nn.Module, storeys: int) -> None:
        super().__init__()
        self.network = network
        self.scaling = LevelScaling()
        self.constant("height_m", torch.full((storeys,), torch.nan))
        self.constant("radii", torch.ones(3))

    def constant(self, name: str, value: torch.Tensor) -> None:
        """Keep an array that is not a weight, but saved with the weights."""
        self.register_buffer(name, value.to(torch.float64))

    @abstractmethod
    def losses(self, inputs: torch.Tensor, *targets: torch.Tensor) -> torch.Tensor:
        """Return the loss (b,) of each example from its inputs (b, a) and the targets of its place."""

    @abstractmethod
    def answer(self, inputs: torch.Tensor) -> NetworkAnswer:
        """Estimate where scaled scans (n, a) were taken."""

    def forward(self, level_dbm: torch.Tensor) -> tuple[torch.Tensor, ...]:
        """Return OUTPUTS for levels (n, a), NaN if not heard; a scan that hears nothing is unknown: NaN and -1."""
        known = (~torch.isnan(level_dbm)).any(dim=1)
        answer = self.answer(self.scaling(level_dbm))
        base_m, factor_68, factor_95 = self.radii.unbind()
        scale_m = (base_m**2 + answer.spread_m**2).sqrt().clamp(min=SMALLEST_SCALE_M)
        return (
            torch.where(known[:, None], answer.xy, torch.nan),
            torch.where(known, self.height_m[answer.storey], torch.nan),
            torch.where(known, answer.storey, -1),
            torch.where(known[:, None], answer.storey_probability, torch.nan),
            torch.where(known, factor_68 * scale_m, torch.nan),
            torch.where(known, factor_95 * scale_m, torch.nan),
        )

    def set_heights(self, height_m: FloatArray) -> None:
        """Set the storeys' heights (s,)."""
        self.height_m.copy_(torch.from_numpy(height_m))

    def calibrate(self, radii: SpreadRadii) -> None:
        """Set the conversion of spreads to radii."""
        self.radii.copy_(torch.from_numpy(radii.array()))
