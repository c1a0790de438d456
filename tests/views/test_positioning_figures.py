from __future__ import annotations

import numpy as np
import polars as pl
import pytest

from vislam2tag.positioning.benchmark import PREDICTIONS, with_errors
from vislam2tag.site.model import ControlPoints, Floor
from vislam2tag.views.panels import rendered
from vislam2tag.views.positioning_figures import (
    ErrorFloor,
    calibration,
    error_distributions_by_model,
    error_map,
    floor_confusion,
)

FLOOR = Floor(0, "ground", 30.0, 20.0, None, None, ControlPoints((), np.zeros((0, 2))))


def predictions(n: int = 40, radius_m: float | None = 2.0) -> pl.DataFrame:
    """Scans in a row, found 0 to 4 m off; every tenth on another floor, the last without answer."""
    off = np.linspace(0, 4, n)
    table = pl.DataFrame(
        {
            "scan_id": [str(index) for index in range(n)],
            "building": "",
            "floor": 0,
            "x": np.linspace(0, 29, n),
            "y": 10.0,
            "z": None,
            "found_building": "",
            "found_floor": np.where(np.arange(n) % 10 == 9, 1, 0),
            "found_x": np.linspace(0, 29, n) + off,
            "found_y": 10.0,
            "found_z": None,
            "radius_68_m": radius_m,
            "radius_95_m": None if radius_m is None else 2 * radius_m,
        },
        schema_overrides=PREDICTIONS,
    )
    answered = pl.col("scan_id") != str(n - 1)
    return with_errors(
        table.with_columns(pl.when(answered).then(pl.col(name)).name.keep() for name in PREDICTIONS if "found" in name)
    )


def test_curves_end_at_the_share_answered() -> None:
    errors = predictions()["error_m"].fill_null(np.nan).to_numpy()
    figure = error_distributions_by_model({"weighted-knn": errors, "nothing": np.full(3, np.nan)})
    lines = {line.get_label(): line for line in figure.axes[0].lines}
    knn = np.asarray(lines["weighted-knn"].get_xydata())
    assert knn[-1, 1] == pytest.approx(39 / 40)
    assert np.interp(2.0, knn[:, 0], knn[:, 1]) == pytest.approx(0.5, abs=0.03)
    assert np.asarray(lines["nothing"].get_ydata()).tolist() == [0]
    assert rendered(figure, "svg") == rendered(figure, "svg")


def test_the_map_shows_wrong_floors_apart() -> None:
    figure = error_map([ErrorFloor("ground", FLOOR, predictions())])
    right, wrong = figure.axes[0].collections
    assert len(np.asarray(right.get_offsets())) == 36
    assert len(np.asarray(wrong.get_offsets())) == 3
    assert figure.axes[0].get_xlim()[1] >= 30.0
    assert rendered(figure, "pdf").startswith(b"%PDF")


def test_confusion_is_in_shares_of_the_true_floor() -> None:
    counts = {"weighted-knn": np.array([[9.0, 1.0], [0.0, 0.0]])}
    figure = floor_confusion(["0", "1"], counts)
    image = np.asarray(figure.axes[0].images[0].get_array())
    np.testing.assert_allclose(image, np.array([[0.9, 0.1], [0.0, 0.0]]))
    assert [text.get_text() for text in figure.axes[0].texts] == ["90.0", "10.0"]
    assert rendered(figure, "svg")


def test_calibration_compares_errors_with_radii() -> None:
    figure = calibration({"weighted-knn": predictions(), "mute": predictions(radius_m=None)})
    shares = [float(np.asarray(line.get_xdata())[0]) for line in figure.axes[0].lines[2:4]]
    assert shares == [pytest.approx(0.5, abs=0.03), 1.0]
    radius_m, error_m = np.asarray(figure.axes[1].lines[1].get_xydata(), dtype=np.float64).T
    np.testing.assert_allclose(radius_m, 2.0)
    assert len(error_m) == 10
    assert rendered(figure, "svg")
