"""The module says what the model says, whichever of density and field is asked."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from tests.positioning.radio_fields import TWO_BUILDINGS, surveyed
from vislam2tag.positioning.cell_density.density_model import DensityShape, LearningSetup, learned_model
from vislam2tag.positioning.cell_density.novelty import NoveltyRadii, RadiusGrowth

torch = pytest.importorskip("torch", reason="networks need the extra 'models'")


@pytest.mark.parametrize("half", [0.0, 0.02, np.inf])
def test_places_are_the_models(half: float) -> None:
    from vislam2tag.positioning.cell_density.torch_module import DensityModule

    scans, places = surveyed(60, TWO_BUILDINGS)
    model = learned_model(scans, places, DensityShape(2.0, 0.1, 2.5), LearningSetup(1, 0))
    asked, _ = surveyed(40, TWO_BUILDINGS, seed=1)
    radii = NoveltyRadii(1.0, RadiusGrowth(1.0, 1.0), RadiusGrowth(2.0, 1.0), 1.0)
    module = DensityModule(model, half, radii, places.storey_height_m)
    xy, _, storey, *_ = module(torch.from_numpy(asked.dense()))
    answer = model.answer(asked)
    np.testing.assert_allclose(xy.numpy(), answer.blended(half), atol=1e-6)
    np.testing.assert_array_equal(storey.numpy(), answer.storey_probability.argmax(axis=1))


def test_of_scans_that_are_equally_alike_both_take_the_same() -> None:
    from vislam2tag.positioning.cell_density.torch_module import DensityModule

    scans, places = surveyed(60)
    flat = replace(scans, rssi_dbm=np.where(scans.column < 8, -60.0, -110.0))  # few patterns, and some that are nothing
    model = learned_model(flat, places, DensityShape(2.0, 0.1, 2.5), LearningSetup(1, 0))
    radii = NoveltyRadii(1.0, RadiusGrowth(1.0, 1.0), RadiusGrowth(2.0, 1.0), 1.0)
    module = DensityModule(model, 0.02, radii, places.storey_height_m)
    xy, _, _, _, radius_68_m, _ = module(torch.from_numpy(flat.dense()))
    answer = model.answer(flat)
    np.testing.assert_allclose(xy.numpy(), answer.blended(0.02), atol=1e-6)
    np.testing.assert_allclose(radius_68_m.numpy(), radii.radii_m(answer.spread_m, answer.novelty)[0], atol=1e-6)
