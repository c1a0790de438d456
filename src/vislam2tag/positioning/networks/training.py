"""The training loop: mini-batches, Adam, early stopping on held-out examples, best weights kept."""

from __future__ import annotations

import copy
import math
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass

import numpy as np
import torch

from vislam2tag.common.errors import DatasetError, UsageError
from vislam2tag.common.progress import Progress, silent

PUBLISHED_BATCH = 32
"""Examples a step where nothing else is asked for; learning rates are stated for it."""
_LARGEST_BATCH, _LEAST_STEPS = 512, 40
_CHECKED_AT_ONCE = 1024


@dataclass(frozen=True)
class TrainingExamples:
    """What a network learns from or is checked with."""

    count: int
    losses: Callable[[torch.Tensor], torch.Tensor]
    """From indices (b,) on the network's device to the loss of each of these examples (b,), through the network."""


@dataclass(frozen=True)
class TrainingSchedule:
    """How long and in which steps to train."""

    epochs: int = 50
    batch_size: int = PUBLISHED_BATCH
    learning_rate: float = 1e-3
    weight_decay: float = 0.0
    """Decoupled from the gradient (AdamW); 0 is Adam."""
    patience: int = 30
    """Epochs without a better held-out loss after which training ends."""
    seed: int = 0
    """Of the order of examples."""


@dataclass(frozen=True)
class TrainingHistory:
    """How a training went."""

    held_out_loss: tuple[float, ...]
    """Mean over the held-out examples after each epoch."""
    best_epoch: int
    """Whose weights the network has; counted from 0."""


def train(
    network: torch.nn.Module,
    examples: TrainingExamples,
    held_out: TrainingExamples,
    schedule: TrainingSchedule,
    progress: Progress[int] = silent,
) -> TrainingHistory:
    """Train the network; it ends with the weights that were best on the held-out examples, in evaluation mode.

    Raises DatasetError where the loss is no number any more. Nothing waits for a GPU within an epoch.
    """
    device = next(network.parameters()).device
    optimiser = torch.optim.AdamW(
        network.parameters(),
        lr=schedule.learning_rate,
        weight_decay=schedule.weight_decay,
        fused=device.type == "cuda" or None,
    )
    order = np.random.default_rng(schedule.seed)
    losses: list[float] = []
    best_epoch, best = 0, copy.deepcopy(network.state_dict())
    for epoch in range(schedule.epochs):
        network.train()
        shuffled = torch.from_numpy(order.permutation(examples.count)).to(device)
        for rows in shuffled.split(schedule.batch_size):
            optimiser.zero_grad()
            examples.losses(rows).mean().backward()
            optimiser.step()
        losses.append(_mean_loss(network, held_out, device))
        if not math.isfinite(losses[-1]):
            raise DatasetError(f"the loss grew without bound in epoch {epoch + 1}; lower the learning rate")
        if losses[-1] < min(losses[:-1], default=math.inf):
            best_epoch, best = epoch, copy.deepcopy(network.state_dict())
        progress(epoch + 1, schedule.epochs)
        if epoch - best_epoch >= schedule.patience:
            break
    network.load_state_dict(best)
    network.eval()
    return TrainingHistory(tuple(losses), best_epoch)


def _mean_loss(network: torch.nn.Module, examples: TrainingExamples, device: torch.device) -> float:
    network.eval()
    with torch.no_grad():
        batches = torch.arange(examples.count, device=device).split(_CHECKED_AT_ONCE)
        return sum(float(examples.losses(rows).sum()) for rows in batches) / examples.count


def batch_for(count: int, device: torch.device) -> tuple[int, float]:
    """Return how many of ``count`` examples a step takes, and what to multiply the learning rate by.

    A GPU computes a large batch as quickly as a small one, so that it gets 512, but leaves 40 steps an epoch; the rate
    of Adam grows with the root of the batch (Malladi et al. 2022). A processor keeps to the published batches.
    """
    most = _LARGEST_BATCH if device.type == "cuda" else PUBLISHED_BATCH
    size = max(PUBLISHED_BATCH, min(most, count // _LEAST_STEPS))
    return size, math.sqrt(size / PUBLISHED_BATCH)


def training_device(name: str) -> torch.device:
    """Return the device called ``cpu``, ``cuda``, ...; ``auto`` is the GPU where there is one, the CPU elsewhere.

    Raises UsageError for a device that is not there.
    """
    if name == "auto":
        name = "cuda" if torch.cuda.is_available() else "cpu"
    try:
        device = torch.device(name)
        torch.empty(0, device=device)
    except (AssertionError, RuntimeError) as error:
        raise UsageError(f"device '{name}' is not there ({str(error).splitlines()[0]}); use auto or cpu") from error
    return device


@contextmanager
def repeatable(seed: int, device: torch.device) -> Iterator[None]:
    """Seed PyTorch and hold it to one thread, so that a network on the CPU follows from its seed alone.

    More threads add in another order. On a GPU sums do so, too: there figures repeat, not bytes. PyTorch's own random
    numbers go on afterwards as if nothing had happened.
    """
    threads = torch.get_num_threads()
    with torch.random.fork_rng(devices=[device] if device.type == "cuda" else []):
        torch.manual_seed(seed)
        torch.set_num_threads(1)
        try:
            yield
        finally:
            torch.set_num_threads(threads)
