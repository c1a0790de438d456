from __future__ import annotations

from pathlib import Path

import numpy as np
import polars as pl
import pytest
from PIL import Image

from tests.preparation.registration.networks import survey
from tests.quality.evaluation.maps import floor_with
from tests.walks import corridor_walk, landmarks_at
from vislam2tag.core.transforms import Similarity2
from vislam2tag.estimation.settings import MappingSettings
from vislam2tag.estimation.strategy import strategy_named
from vislam2tag.preparation.registration.register import FloorMeasurements, register_floor
from vislam2tag.site.model import ControlPoints, Floor, Site
from vislam2tag.views.panels import rendered
from vislam2tag.views.site_figures import landmark_configuration, residual_figure, scan_labels, workflow

LANDMARKS = landmarks_at({"7": (1.0, 2.0), "9": (18.0, 8.0)})


def planned_floor(plan: Path) -> Floor:
    return Floor(0, "", 20.0, 10.0, None, plan, ControlPoints(("a",), np.array([(5.0, 5.0)])))


@pytest.fixture
def plan(tmp_path: Path) -> Path:
    path = tmp_path / "floorplan.png"
    Image.new("RGB", (200, 100), "grey").save(path)
    return path


def test_configuration_shows_plan_ids_and_control_points(plan: Path) -> None:
    empty = floor_with(np.zeros((0, 2)), number=5)
    (axes,) = landmark_configuration(Site((planned_floor(plan), empty), LANDMARKS)).axes
    assert [text.get_text() for text in axes.texts] == ["a", "7", "9"]
    assert list(axes.images[0].get_extent()) == [0, 20, 0, 10]
    assert axes.get_xlim() == (0, 20)
    assert {line.get_label() for line in axes.lines} == {"landmark", "control point"}


def test_unreadable_plan_leaves_the_landmarks(plan: Path) -> None:
    plan.write_bytes(b"no image")
    figure = landmark_configuration(Site((planned_floor(plan),), LANDMARKS))
    assert not figure.axes[0].images
    assert rendered(figure, "svg").startswith(b"<?xml")


def test_site_without_landmarks_has_no_panel() -> None:
    assert not landmark_configuration(Site((), LANDMARKS.select([]))).axes


def test_each_scan_has_its_readings_and_their_mean(plan: Path) -> None:
    wifi = pl.DataFrame(
        {"scan": [4, 4, 5, 6], "x": [1.0, 3.0, 9.0, None], "y": [2.0, 2.0, 4.0, None]},
        schema_overrides={"scan": pl.Int32},
    )
    (axes,) = scan_labels(planned_floor(plan), LANDMARKS, wifi).axes
    (readings,) = axes.collections
    assert np.asarray(readings.get_offsets()).tolist() == [[1, 2], [3, 2], [9, 4]]
    colours = np.asarray(readings.get_facecolor())
    assert (colours[0] == colours[1]).all()
    assert (colours[1] != colours[2]).any()
    means = next(line for line in axes.lines if line.get_label() == "mean of a scan")
    assert np.asarray(means.get_xydata()).tolist() == [[2, 2], [9, 4]]


def test_walk_without_wifi_still_has_its_workflow(plan: Path) -> None:
    camera, log, landmarks, _ = corridor_walk(Similarity2.identity(), {"a": (5.0, 0.4), "b": (15.0, -0.4)})
    mapped = strategy_named("local", MappingSettings()).map(camera, log, landmarks)
    nothing = pl.DataFrame(schema={"scan": pl.Int32, "x": pl.Float64, "y": pl.Float64})
    figure = workflow(planned_floor(plan), landmarks, camera, log, mapped, nothing)
    assert len(figure.axes) == 4
    assert rendered(figure, "svg").startswith(b"<?xml")


FLOOR = Floor(1, "", 60.0, 30.0, None, None, ControlPoints((), np.empty((0, 2))))


def test_points_regions_and_residuals_are_drawn() -> None:
    drawn = survey(1)
    found = register_floor(1, FloorMeasurements(shots=drawn.shots, known=drawn.known))
    figure = residual_figure(FLOOR, found)
    plan, residuals = figure.axes
    assert plan.get_xlim() == (0, 60)
    assert {text.get_text() for text in plan.texts} == {one.point for one in found.landmarks}
    assert "times enlarged" in plan.get_title(loc="left")
    assert sum(patch.get_height() for patch in residuals.patches) == len(found.residuals)  # type: ignore[attr-defined]
    assert rendered(figure, "svg") == rendered(residual_figure(FLOOR, found), "svg")


def test_nothing_registered_is_still_a_figure() -> None:
    empty = register_floor(1, FloorMeasurements())
    assert rendered(residual_figure(FLOOR, empty), "png").startswith(b"\x89PNG")
