"""The module says what the kernel says, whichever of density and field is asked."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from tests.positioning.radio_fields import TWO_BUILDINGS, surveyed
from vislam2tag.positioning.cell_density.kernel import Setup, Shape, learned
from vislam2tag.positioning.cell_density.novelty import Growth, NoveltyRadii

torch = pytest.importorskip("torch", reason="networks need the extra 'models'")


@pytest.mark.parametrize("half", [0.0, 0.02, np.inf])
def test_places_are_the_kernels(half: float) -> None:
    from vislam2tag.positioning.cell_density.module import CellModule

    scans, places = surveyed(60, TWO_BUILDINGS)
    kernel = learned(scans, places, Shape(2.0, 0.1, 2.5), Setup(1, (), 0))
    asked, _ = surveyed(40, TWO_BUILDINGS, seed=1)
    radii = NoveltyRadii(1.0, Growth(1.0, 1.0), Growth(2.0, 1.0), 1.0)
    module = CellModule(kernel, half, radii, places.storey_height_m)
    xy, _, storey, *_ = module(torch.from_numpy(asked.dense()))
    answer = kernel.answer(asked)
    np.testing.assert_allclose(xy.numpy(), answer.between(half), atol=1e-6)
    np.testing.assert_array_equal(storey.numpy(), answer.storey_probability.argmax(axis=1))


def test_of_scans_that_are_equally_alike_both_take_the_same() -> None:
    from vislam2tag.positioning.cell_density.module import CellModule

    scans, places = surveyed(60)
    flat = replace(scans, rssi_dbm=np.where(scans.column < 8, -60.0, -110.0))  # few patterns, and some that are nothing
    kernel = learned(flat, places, Shape(2.0, 0.1, 2.5), Setup(1, (), 0))
    radii = NoveltyRadii(1.0, Growth(1.0, 1.0), Growth(2.0, 1.0), 1.0)
    module = CellModule(kernel, 0.02, radii, places.storey_height_m)
    xy, _, _, _, radius_68_m, _ = module(torch.from_numpy(flat.dense()))
    answer = kernel.answer(flat)
    np.testing.assert_allclose(xy.numpy(), answer.between(0.02), atol=1e-6)
    np.testing.assert_allclose(radius_68_m.numpy(), radii.radii_m(answer.spread_m, answer.novelty)[0], atol=1e-6)
