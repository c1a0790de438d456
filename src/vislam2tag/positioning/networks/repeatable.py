"""Where a network is trained, and that the same seed trains the same network."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

import torch

from vislam2tag.errors import UsageError


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
