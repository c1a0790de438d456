"""The module says what the kernel says, whichever of density and field is asked."""

from __future__ import annotations

import numpy as np
import pytest

from tests.positioning.radio_fields import TWO_BUILDINGS, surveyed
from vislam2tag.positioning.cell_kernel import Setup, Shape, learned
from vislam2tag.positioning.novelty import Growth, NoveltyRadii

torch = pytest.importorskip("torch", reason="networks need the extra 'models'")


@pytest.mark.parametrize("half", [0.0, 0.02, np.inf])
def test_places_are_the_kernels(half: float) -> None:
    from vislam2tag.positioning.networks.cell_module import CellModule

    scans, places = surveyed(60, TWO_BUILDINGS)
    kernel = learned(scans, places, Shape(2.0, 0.1, 2.5), Setup(1, (), 0))
    asked, _ = surveyed(40, TWO_BUILDINGS, seed=1)
    radii = NoveltyRadii(1.0, Growth(1.0, 1.0), Growth(2.0, 1.0), 1.0)
    module = CellModule(kernel, half, radii, places.storey_height_m)
    xy, _, storey, *_ = module(torch.from_numpy(asked.dense()))
    answer = kernel.answer(asked)
    np.testing.assert_allclose(xy.numpy(), answer.between(half), atol=1e-6)
    np.testing.assert_array_equal(storey.numpy(), answer.storey_probability.argmax(axis=1))
