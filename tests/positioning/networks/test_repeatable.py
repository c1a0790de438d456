"""Which device trains, and that training leaves PyTorch as it was."""

from __future__ import annotations

import pytest

from vislam2tag.common.errors import UsageError

torch = pytest.importorskip("torch", reason="networks need the extra 'models'")

from vislam2tag.positioning.networks.training import repeatable, training_device  # noqa: E402  # needs torch


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
