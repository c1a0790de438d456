"""Functions of all positioners with a network: validation set, training, calibration, prediction, weights.

Training uses mini-batches and Adam, with early stopping on held-out examples; the best weights are kept.
"""

from __future__ import annotations

import copy
import math
from abc import abstractmethod
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from typing import Any, ClassVar, Self

import numpy as np
import torch

from vislam2tag.common.errors import DatasetError, UsageError
from vislam2tag.common.progress import Progress, silent
from vislam2tag.core.arrays import AnyArray, FloatArray
from vislam2tag.positioning.error_radii import fitted_radii
from vislam2tag.positioning.networks.layers import OUTPUTS, InputScale, Locator
from vislam2tag.positioning.places import LabelledScans, Positions, ScanPlaces, usable_validation
from vislam2tag.positioning.radio_scans import CheckedArrays, RadioScans
from vislam2tag.positioning.registry import NamedArrays, Positioner

PUBLISHED_BATCH = 32
"""Default number of examples in a step; learning rates are given for it."""
_LARGEST_BATCH, _LEAST_STEPS = 512, 40
_CHECKED_AT_ONCE = 1024


@dataclass(frozen=True, kw_only=True)
class NetworkSettings:
    """Parameters of all networks."""

    backbone: Sequence[int] = (512,)
    """Widths of layers, like ``heads`` and ``head``."""
    dropout: float = 0.5
    head_dropout: float = 0.25
    input_scale: str = "min-max"
    epochs: int = 50
    batch_size: int = 0
    """0: 32, on a GPU up to 512 with an adapted learning rate (:func:`.batch_for`)."""
    learning_rate: float = 1e-3
    weight_decay: float = 0.0
    """Decoupled from the gradient (AdamW); 0 is Adam."""
    patience: int = 30
    """Training ends after this number of epochs without a better held-out loss."""
    validation_share: float = 0.1
    """Share of the training data that is held out at random for early stopping and calibration, if ``fit`` gets no
    validation set; at least one scan."""
    seed: int = 0
    device: str = "auto"
    """Where to train: ``auto`` (the GPU if there is one), ``cpu``, ``cuda``. Predictions are made on the CPU."""


@dataclass(frozen=True)
class TrainingExamples:
    """Examples for training or validation."""

    count: int
    losses: Callable[[torch.Tensor], torch.Tensor]
    """From indices (b,) on the network's device to the loss of each of these examples (b,), through the network."""


@dataclass(frozen=True)
class TrainingHistory:
    """Course of a training."""

    held_out_loss: tuple[float, ...]
    """Mean over the held-out examples after each epoch."""
    best_epoch: int
    """Epoch of the network's weights, counted from 0."""


def train(
    network: torch.nn.Module,
    examples: TrainingExamples,
    held_out: TrainingExamples,
    settings: NetworkSettings,
    progress: Progress[int] = silent,
) -> TrainingHistory:
    """Train the network; it then has the weights with the smallest held-out loss, and is in evaluation mode.

    Raises DatasetError if the loss becomes NaN or infinite. There is no synchronisation with a GPU within an epoch.
    """
    device = next(network.parameters()).device
    size, faster = batch_for(examples.count, device, settings.batch_size)
    optimiser = torch.optim.AdamW(
        network.parameters(),
        lr=faster * settings.learning_rate,
        weight_decay=settings.weight_decay,
        fused=device.type == "cuda" or None,
    )
    order = np.random.default_rng(settings.seed)
    losses: list[float] = []
    best_epoch, best = 0, copy.deepcopy(network.state_dict())
    for epoch in range(settings.epochs):
        network.train()
        shuffled = torch.from_numpy(order.permutation(examples.count)).to(device)
        for rows in shuffled.split(size):
            optimiser.zero_grad()
            examples.losses(rows).mean().backward()
            optimiser.step()
        losses.append(_mean_loss(network, held_out, device))
        if not math.isfinite(losses[-1]):
            raise DatasetError(f"the training loss diverged in epoch {epoch + 1}; lower the learning rate")
        if losses[-1] < min(losses[:-1], default=math.inf):
            best_epoch, best = epoch, copy.deepcopy(network.state_dict())
        progress(epoch + 1, settings.epochs)
        if epoch - best_epoch >= settings.patience:
            break
    network.load_state_dict(best)
    network.eval()
    return TrainingHistory(tuple(losses), best_epoch)


def _mean_loss(network: torch.nn.Module, examples: TrainingExamples, device: torch.device) -> float:
    network.eval()
    with torch.no_grad():
        batches = torch.arange(examples.count, device=device).split(_CHECKED_AT_ONCE)
        return sum(float(examples.losses(rows).sum()) for rows in batches) / examples.count


def batch_for(count: int, device: torch.device, asked_for: int = 0) -> tuple[int, float]:
    """Return the batch size for ``count`` examples, and the factor on the learning rate.

    A given batch size is kept, with its rate.

    A GPU computes a large batch as fast as a small one, so it gets up to 512 examples, with at least 40 steps in an
    epoch. The rate of Adam grows with the square root of the batch size (Malladi et al. 2022). A CPU uses the published
    batch size.
    """
    if asked_for:
        return asked_for, 1.0
    most = _LARGEST_BATCH if device.type == "cuda" else PUBLISHED_BATCH
    size = max(PUBLISHED_BATCH, min(most, count // _LEAST_STEPS))
    return size, math.sqrt(size / PUBLISHED_BATCH)


def training_device(name: str) -> torch.device:
    """Return the device named ``cpu``, ``cuda``, ...; ``auto`` is the GPU if there is one, otherwise the CPU.

    Raises UsageError for a device that is not available.
    """
    if name == "auto":
        name = "cuda" if torch.cuda.is_available() else "cpu"
    try:
        device = torch.device(name)
        torch.empty(0, device=device)
    except (AssertionError, RuntimeError) as error:
        raise UsageError(f"device '{name}' is not available ({str(error).splitlines()[0]}); use auto or cpu") from error
    return device


@contextmanager
def repeatable(seed: int, device: torch.device) -> Iterator[None]:
    """Seed PyTorch and limit it to one thread, so that a network on the CPU depends only on its seed.

    More threads would change the order of sums. On a GPU the order also varies, so figures repeat there, but not bytes.
    PyTorch's own random numbers are restored afterwards.
    """
    threads = torch.get_num_threads()
    with torch.random.fork_rng(devices=[device] if device.type == "cuda" else []):
        torch.manual_seed(seed)
        torch.set_num_threads(1)
        try:
            yield
        finally:
            torch.set_num_threads(threads)


_RANGES = {
    "epochs": (1, math.inf),
    "batch_size": (0, math.inf),
    "learning_rate": (1e-9, 1.0),
    "weight_decay": (0.0, 1.0),
    "patience": (1, math.inf),
    "validation_share": (0.0, 0.9),
    "seed": (0, 2**32 - 1),
    "dropout": (0.0, 0.95),
    "head_dropout": (0.0, 0.95),
    "cell_m": (0.1, 1e4),
    "overlap": (0.0, 2.0),
    "class_weight": (0.0, math.inf),
    "code_weight": (0.0, math.inf),
}
_WIDTHS = ("backbone", "heads", "head")
_AT_ONCE = 1024


def refuse_impossible(parameters: Mapping[str, Any]) -> None:
    """Raise UsageError for the first value outside the range of its parameter.

    Unknown names may have any value.
    """
    for name, (least, most) in _RANGES.items():
        value = parameters.get(name, least)
        if not least <= value <= most:
            raise UsageError(f"{name} {value!r}: expected {_between(least, most)}")
    for name in _WIDTHS:
        widths = parameters.get(name, ())
        if not all(isinstance(width, int) and width >= 1 for width in widths):
            raise UsageError(f"{name} {widths!r}: expected layer widths such as [512, 256], or [] for no hidden layer")
    scale = parameters.get("input_scale", InputScale.MIN_MAX)
    if scale not in list(InputScale):
        raise UsageError(f"input_scale {scale!r}: expected one of {', '.join(InputScale)}")


def _between(least: float, most: float) -> str:
    return f"{least:g} or more" if math.isinf(most) else f"{least:g} to {most:g}"


class NetworkPositioner(Positioner):
    """A model with a :class:`Locator`; its parameters are the fields of its ``kind`` of settings.

    A model makes its locator from training data (``_new_locator``) or for saved arrays (``_empty_locator``), and the
    targets of its loss from places (``_targets``).
    """

    kind: ClassVar[type[NetworkSettings]]
    settings: NetworkSettings
    locator_: Locator
    history_: TrainingHistory

    def __init__(self, **parameters: Any) -> None:
        """Make a model with parameters that differ from the defaults."""
        self.settings = self.kind(**parameters)

    def get_params(self, deep: bool = True) -> dict[str, Any]:
        """Return all parameters, sorted by name."""
        del deep
        return dict(sorted(vars(self.settings).items()))

    def set_params(self, **params: Any) -> Self:
        """Change parameters, as scikit-learn's searches do; raises ValueError for an unknown one."""
        if unknown := params.keys() - vars(self.settings).keys():
            raise ValueError(f"{type(self).__name__} has no parameter {', '.join(sorted(unknown))}")
        self.settings = replace(self.settings, **params)
        return self

    @abstractmethod
    def _new_locator(self, places: ScanPlaces) -> Locator:
        """Make an untrained locator for these places."""

    @abstractmethod
    def _empty_locator(self, arrays: Mapping[str, FloatArray]) -> Locator:
        """Make a locator for arrays of these shapes."""

    @abstractmethod
    def _targets(self, places: ScanPlaces) -> Sequence[AnyArray]:
        """Return the additional arguments of :meth:`Locator.losses`: arrays of length n."""

    def _fit(self, scans: RadioScans, places: ScanPlaces, validation: LabelledScans | None) -> None:
        refuse_impossible(self.get_params())
        device = training_device(self.settings.device)
        learned, held_out = self._parts(scans, places, validation)
        with repeatable(self.settings.seed, device):
            locator = self._new_locator(places)
            locator.scaling.fit(scans, InputScale(self.settings.input_scale))
            locator.set_heights(places.storey_height_m)
            locator.to(device)
            self.history_ = train(
                locator.network,
                self._examples(locator, learned, device),
                self._examples(locator, held_out, device),
                self.settings,
                self.progress,
            )
            self.locator_ = locator.cpu().double().eval()
            self._calibrate(*held_out)

    def _parts(
        self, scans: RadioScans, places: ScanPlaces, validation: LabelledScans | None
    ) -> tuple[LabelledScans, LabelledScans]:
        """Return the training and held-out scans; a single scan is both."""
        if given := usable_validation(validation):
            taught = np.isin(given[1].storey, places.storey)
            if taught.any():
                return (scans, places), (given[0][taught], given[1][taught])
        order = np.random.default_rng(self.settings.seed).permutation(len(scans))
        count = max(1, round(self.settings.validation_share * len(scans)))
        held_out, learned = np.sort(order[:count]), np.sort(order[count:])
        if not len(learned):
            learned = held_out
        return (scans[learned], places[learned]), (scans[held_out], places[held_out])

    def _examples(self, locator: Locator, part: LabelledScans, device: torch.device) -> TrainingExamples:
        """Put inputs and targets on the device once, because a GPU would wait for transfers of every batch."""
        scans, places = part
        blocks = (scans[start : start + _AT_ONCE] for start in range(0, len(scans), _AT_ONCE))
        inputs = torch.cat([locator.scaling(levels(block).to(device)).float() for block in blocks])
        targets = [torch.from_numpy(target).to(device) for target in self._targets(places)]

        def losses(rows: torch.Tensor) -> torch.Tensor:
            return locator.losses(inputs[rows], *(target[rows] for target in targets))

        return TrainingExamples(len(scans), losses)

    def _calibrate(self, scans: RadioScans, places: ScanPlaces) -> None:
        """Fit the radii to the errors on held-out scans.

        The same scans stopped the training, so the errors are slightly too small.
        """
        locator = self.locator_
        xy, spread_m = in_batches(scans, lambda level: xy_and_spread(locator, level))
        locator.calibrate(fitted_radii(np.hypot(*(xy - places.xy).T), spread_m))

    def _predict(self, scans: RadioScans) -> Positions:
        with repeatable(self.settings.seed, torch.device("cpu")):
            found = dict(zip(OUTPUTS, in_batches(scans, self.locator_), strict=True))
        return Positions(storeys=self.storeys_, **found)

    def torch_module(self) -> Locator:
        """Return the locator, for export."""
        return self.locator_

    def arrays(self) -> NamedArrays:
        """Return weights and constants by name."""
        return {name: value.numpy().astype(np.float64) for name, value in self.locator_.state_dict().items()}

    def restore(self, arrays: Mapping[str, FloatArray]) -> None:
        """Restore weights and constants; raises ValueError if they are not those of this model."""
        refuse_impossible(self.get_params())
        checked = CheckedArrays(arrays)
        for name, array in ((name, array) for name, array in arrays.items() if array.size):
            checked.floats(name, *array.shape, unknown=name == "height_m")
        # Missing arrays must be detected before layers of their widths are allocated.
        sizes = {size for array in arrays.values() for size in array.shape}
        if not {width for name in _WIDTHS for width in self.get_params().get(name, ())} <= sizes:
            raise ValueError("the arrays do not fit the model: the widths of its layers are missing")
        try:
            locator = self._empty_locator(arrays).double()
            locator.load_state_dict({name: torch.tensor(value) for name, value in arrays.items()})
        except (KeyError, RuntimeError) as error:
            raise ValueError(f"the arrays do not fit the model: {error}") from error
        self.locator_ = locator.eval()


def in_batches(scans: RadioScans, answer: Callable[[torch.Tensor], tuple[Any, ...]]) -> tuple[AnyArray, ...]:
    """Answer scans in batches, so that the levels of only a few are in memory."""
    starts = range(0, max(len(scans), 1), _AT_ONCE)
    with torch.no_grad():
        found = [answer(levels(scans[start : start + _AT_ONCE])) for start in starts]
    return tuple(np.concatenate([part.numpy() for part in parts]) for parts in zip(*found, strict=True))


def xy_and_spread(locator: Locator, level_dbm: torch.Tensor) -> tuple[torch.Tensor, torch.Tensor]:
    """Return places of scans with these levels (n, a), and the spread of guesses."""
    answer = locator.answer(locator.scaling(level_dbm))
    return answer.xy, answer.spread_m


def levels(scans: RadioScans) -> torch.Tensor:
    """Make the (n, a) levels in dBm, NaN if not heard."""
    return torch.from_numpy(scans.dense())
