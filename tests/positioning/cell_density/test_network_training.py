"""Networks beside the kernel: they learn, repeat, and answer without PyTorch."""

from __future__ import annotations

import numpy as np
import pytest

torch = pytest.importorskip("torch", reason="PyTorch is the extra 'models'")

from tests.positioning.radio_fields import surveyed  # noqa: E402
from vislam2tag.common.errors import UsageError  # noqa: E402
from vislam2tag.positioning.cell_density.density_cells import cells_near  # noqa: E402
from vislam2tag.positioning.cell_density.network_training import NetworkSchedule, trained_network  # noqa: E402
from vislam2tag.positioning.cell_density.scan_kernels import levels  # noqa: E402
from vislam2tag.positioning.models.cell_density import CellDensity  # noqa: E402

QUICK = NetworkSchedule(steps=120, widths=(64,), dropout=0.1, learning_rate=1e-2)


def test_it_learns_and_repeats() -> None:
    scans, places = surveyed(120)
    cells = cells_near(places, 4.0)
    densities = cells.label_densities(places, 5.0)
    first, again = (trained_network(levels(scans), lambda rows: densities[rows], 1.7, QUICK, seed=2) for _ in range(2))
    density = first(levels(scans))
    np.testing.assert_array_equal(density, again(levels(scans)))
    np.testing.assert_allclose(density.sum(axis=1), 1.0)
    error = np.hypot(*(cells.median(density * cells.on(places.storey)) - places.xy).T)
    middle = np.hypot(*(places.xy.mean(axis=0) - places.xy).T)
    assert error.mean() < 0.7 * middle.mean()


def test_a_device_that_is_not_there() -> None:
    schedule = NetworkSchedule(device="cuda:99")
    with pytest.raises(UsageError, match="is not there"):
        trained_network(np.ones((2, 1)), lambda rows: np.ones((len(rows), 1)), 1.0, schedule, seed=0)


def test_the_model_keeps_its_networks(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(NetworkSchedule, "__init__", lambda self: self.__dict__.update(QUICK.__dict__))
    scans, places = surveyed(40)
    model = CellDensity(networks=(1.7, 1.0)).fit(scans, places)
    back = CellDensity(networks=(1.7, 1.0))
    back.access_points_, back.storeys_ = model.access_points_, model.storeys_
    back.restore(model.arrays())
    assert len(back.density_.networks) == 2
    np.testing.assert_array_equal(back.predict(scans).xy, model.predict(scans).xy)
