"""Training of a network that learns densities over cells from augmented scans; only this needs PyTorch."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
import torch

from vislam2tag.common.errors import DatasetError
from vislam2tag.core.arrays import FloatArray, IntArray
from vislam2tag.positioning.cell_density.dense_network import DenseNetwork
from vislam2tag.positioning.networks.training import repeatable, training_device
from vislam2tag.positioning.scans.representation import augmented

TargetDensities = Callable[[IntArray], FloatArray]
"""From rows (b,) to what the network should say of them (b, c)."""


@dataclass(frozen=True)
class NetworkSchedule:
    """How long, in which steps, and where to train."""

    steps: int = 1750
    batch_size: int = 32
    learning_rate: float = 1e-3
    widths: Sequence[int] = (512, 512)
    dropout: float = 0.5
    device: str = "auto"


def trained_network(
    level: FloatArray, targets: TargetDensities, exponent: float, schedule: NetworkSchedule, seed: int
) -> DenseNetwork:
    """Train on augmented copies of levels (n, a), with steps that grow and then shrink (Smith and Topin 2018).

    Raises DatasetError where the loss is no number any more, UsageError where the device is not there.
    """
    device = training_device(schedule.device)
    rng = np.random.default_rng(seed)
    with repeatable(seed, device):
        network = _network(level.shape[1], schedule, targets(np.array([0])).shape[1]).to(device)
        optimiser = torch.optim.AdamW(network.parameters(), lr=schedule.learning_rate, weight_decay=0.0)
        cycle = torch.optim.lr_scheduler.OneCycleLR(optimiser, schedule.learning_rate, total_steps=schedule.steps)
        for rows in _batches(len(level), schedule, rng):
            inputs = DenseNetwork.inputs(augmented(level[rows], rng), exponent)
            logit = network(torch.from_numpy(inputs.astype(np.float32)).to(device))
            target = torch.from_numpy(targets(rows).astype(np.float32)).to(device)
            loss = -(target * torch.log_softmax(logit, dim=1)).sum(dim=1).mean()
            optimiser.zero_grad()
            loss.backward()
            optimiser.step()
            cycle.step()
        if not torch.isfinite(loss):  # asked once: a GPU would be waited for at each step
            raise DatasetError("the loss grew without bound; lower the learning rate")
    layers = [layer for layer in network.cpu() if isinstance(layer, torch.nn.Linear)]
    return DenseNetwork(
        weights=tuple(layer.weight.detach().numpy().T.astype(np.float64) for layer in layers),
        biases=tuple(layer.bias.detach().numpy().astype(np.float64) for layer in layers),
        exponent=exponent,
    )


def _network(inputs: int, schedule: NetworkSchedule, outputs: int) -> torch.nn.Sequential:
    layers: list[torch.nn.Module] = []
    for width in schedule.widths:
        layers += [torch.nn.Linear(inputs, width), torch.nn.ReLU(), torch.nn.Dropout(schedule.dropout)]
        inputs = width
    return torch.nn.Sequential(*layers, torch.nn.Linear(inputs, outputs))


def _batches(count: int, schedule: NetworkSchedule, rng: np.random.Generator) -> list[IntArray]:
    """Draw the rows (b,) of each step; all scans come once before any comes again."""
    size = min(count, max(schedule.batch_size, min(count // 40, 256)))
    rounds = -(-schedule.steps // (count // size))
    return [
        order[start : start + size]
        for order in (rng.permutation(count) for _ in range(rounds))
        for start in range(0, count - size + 1, size)
    ][: schedule.steps]
