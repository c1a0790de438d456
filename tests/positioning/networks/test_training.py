"""The training loop learns, stops and repeats; which device trains, and that PyTorch is left as it was."""

from __future__ import annotations

import numpy as np
import pytest

from vislam2tag.common.errors import DatasetError, UsageError

pytest.importorskip("torch", reason="networks need the extra 'models'")
import torch

from vislam2tag.positioning.networks.training import (
    TrainingExamples,
    TrainingSchedule,
    batch_for,
    repeatable,
    train,
    training_device,
)


class Scripted:
    """Held-out examples with these losses, epoch after epoch; keeps the weight that each was asked with."""

    def __init__(self, network: torch.nn.Linear, losses: list[float]) -> None:
        self.network, self.losses = network, iter(losses)
        self.seen: list[float] = []

    def __call__(self, rows: np.ndarray) -> torch.Tensor:
        assert not self.network.training
        self.seen.append(self.network.weight.tolist()[0][0])
        return torch.full((len(rows),), next(self.losses))


def line(network: torch.nn.Linear) -> TrainingExamples:
    x = torch.linspace(-1, 1, 64)[:, None]
    return TrainingExamples(64, lambda rows: (network(x[rows]) - 3 * x[rows]).square()[:, 0])


def test_it_learns_a_line() -> None:
    network = torch.nn.Linear(1, 1)
    history = train(network, line(network), line(network), TrainingSchedule(epochs=100, learning_rate=0.05))
    assert network.weight.tolist()[0][0] == pytest.approx(3.0, abs=0.01)
    assert history.held_out_loss[-1] < 1e-3


def test_best_weights_are_kept_and_patience_ends_it() -> None:
    network = torch.nn.Linear(1, 1)
    held_out = Scripted(network, [5, 4, 2, 3, 3, 3, 3, 3])
    steps: list[tuple[int, int]] = []
    schedule = TrainingSchedule(epochs=8, patience=3)
    examples = TrainingExamples(5, held_out)
    history = train(network, line(network), examples, schedule, lambda done, total: steps.append((done, total)))
    assert history.best_epoch == 2
    assert list(history.held_out_loss) == [5, 4, 2, 3, 3, 3]
    assert network.weight.tolist()[0][0] == held_out.seen[2] != held_out.seen[-1]
    assert steps == [(epoch, 8) for epoch in range(1, 7)]
    assert not network.training


def test_a_loss_that_is_no_number_ends_it() -> None:
    network = torch.nn.Linear(1, 1)
    with pytest.raises(DatasetError, match="lower the learning rate"):
        train(network, line(network), TrainingExamples(5, Scripted(network, [1, float("nan")])), TrainingSchedule())


def test_a_gpu_gets_larger_batches_where_there_are_examples_for_them_and_a_processor_the_published_ones() -> None:
    gpu, processor = torch.device("cuda"), torch.device("cpu")
    assert batch_for(100_000, gpu) == (512, 4.0)  # the rate grows with the root of 16
    size, faster = batch_for(4000, gpu)
    assert size == 100  # 40 steps an epoch
    assert faster**2 == pytest.approx(100 / 32)
    assert batch_for(500, gpu) == (32, 1.0)
    assert batch_for(100_000, processor) == (32, 1.0)


def test_batch_of_one_and_one_example() -> None:
    network = torch.nn.Linear(1, 1)
    one = TrainingExamples(1, line(network).losses)
    assert len(train(network, one, one, TrainingSchedule(epochs=3, batch_size=1)).held_out_loss) == 3


def test_the_same_seed_draws_the_same_and_leaves_no_trace() -> None:
    before, threads = torch.random.get_rng_state(), torch.get_num_threads()
    drawn = []
    for seed in (1, 1, 2):
        with repeatable(seed, torch.device("cpu")):
            assert torch.get_num_threads() == 1
            drawn.append(torch.rand(3).tolist())
    assert drawn[0] == drawn[1] != drawn[2]
    assert torch.equal(torch.random.get_rng_state(), before)
    assert torch.get_num_threads() == threads


def test_devices() -> None:
    assert training_device("cpu").type == "cpu"
    assert training_device("auto").type == ("cuda" if torch.cuda.is_available() else "cpu")
    for name in ("cuda:99", "abacus"):
        with pytest.raises(UsageError, match=f"device '{name}' is not there"):
            training_device(name)


@pytest.mark.parametrize("there", [False, True])
def test_auto_takes_the_gpu_where_there_is_one(monkeypatch: pytest.MonkeyPatch, there: bool) -> None:
    monkeypatch.setattr(torch.cuda, "is_available", lambda: there)
    made = torch.empty
    monkeypatch.setattr(torch, "empty", lambda *size, **_: made(*size))  # no GPU is asked for memory
    assert training_device("auto").type == ("cuda" if there else "cpu")
    assert training_device("cpu").type == "cpu"


@pytest.mark.parametrize("name", ["abacus", "meta:x"])
def test_a_device_that_is_not_there(name: str) -> None:
    with pytest.raises(UsageError, match=f"device '{name}' is not there .*; use auto or cpu"):
        training_device(name)


@pytest.mark.skipif(torch.cuda.is_available(), reason="there is a GPU")
def test_a_gpu_that_is_not_there() -> None:
    with pytest.raises(UsageError, match="device 'cuda' is not there"):
        training_device("cuda")


def test_random_numbers_and_threads_are_left_as_they_were() -> None:
    threads = torch.get_num_threads()
    torch.manual_seed(3)
    expected = torch.rand(2)
    torch.manual_seed(3)
    with repeatable(7, torch.device("cpu")):
        first = torch.rand(2)
        assert torch.get_num_threads() == 1
    assert torch.equal(torch.rand(2), expected)
    assert torch.get_num_threads() == threads
    with repeatable(7, torch.device("cpu")):
        assert torch.equal(torch.rand(2), first)
