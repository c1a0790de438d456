"""What surveys, trajectories, data sets and radio maps show of themselves in a notebook."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import matplotlib as mpl
import numpy as np
import polars as pl
import pytest

from tests.datasets.factory import small_dataset
from tests.site.site import write_survey
from tests.walks import landmarks_at
from vislam2tag.common.errors import UsageError
from vislam2tag.core.status import Status
from vislam2tag.core.tracks import Trajectory
from vislam2tag.datasets.radio_maps import radio_maps
from vislam2tag.datasets.settings import RadioMapSettings
from vislam2tag.labeling.mapped_walk import MappedWalk
from vislam2tag.labeling.settings import ProcessSettings
from vislam2tag.labeling.tables import LabelledWalk
from vislam2tag.sessions.given_times import GivenTimes
from vislam2tag.sessions.registry import open_survey
from vislam2tag.site.model import SessionKey


@pytest.fixture(autouse=True)
def no_window() -> Iterator[None]:
    from matplotlib import pyplot

    with mpl.rc_context({"backend": "agg"}):
        yield
        pyplot.close("all")


@pytest.fixture
def trajectory() -> Trajectory:
    status = np.array([Status.OK, Status.OK, Status.TRACKING_LOST, Status.UNCERTAIN], dtype=np.int8)
    nothing = np.full((4, 2, 2), np.nan)
    return Trajectory(np.arange(4) * 10**9, np.arange(12.0).reshape(4, 3), np.zeros((4, 4)), nothing, status)


def test_a_trajectory_is_one_line_a_table_and_a_drawing(trajectory: Trajectory) -> None:
    assert repr(trajectory) == "Trajectory(frames: 4, duration: 3.0 s, labelled: 50 %, visits: 0)"
    assert "<td>50 %</td>" in trajectory._repr_html_()
    axes = trajectory.plot()
    labels = [text.get_text() for text in axes.get_legend().get_texts()]
    assert labels == ["ok", "uncertain"]
    assert np.isfinite(axes.lines[0].get_xdata()).sum() == 2
    assert trajectory.plot(axes=axes) is axes


def test_a_mapped_walk_draws_its_path_and_the_landmarks_of_its_floor(trajectory: Trajectory) -> None:
    settings = ProcessSettings()
    landmarks = landmarks_at({"7": (0.0, 0.0), "8": (5.0, 1.0)})
    walk = LabelledWalk(SessionKey(0, "", ""), trajectory, trajectory, {}, settings.labels, "")
    times = GivenTimes(pl.Series(trajectory.time_ns), "time_ns")
    drawn = MappedWalk(walk, replace(landmarks, floor=np.array([0, 1])), (), times)
    axes = drawn.plot()
    assert [text.get_text() for text in axes.get_legend().get_texts()] == ["landmark", "ok", "uncertain"]
    assert [text.get_text() for text in axes.texts] == ["7"]
    with pytest.raises(UsageError, match="floor 2 does not exist; available floors: 0, 1"):
        drawn.plot(floor=2)


def test_a_survey_draws_the_floor_that_is_asked_for(tmp_path: Path) -> None:
    survey = open_survey(write_survey(tmp_path / "<b>"), 0.02)
    assert len(repr(survey)) < 300
    assert "&lt;b&gt;" in survey._repr_html_()
    first = survey.site.floors[0]
    assert survey.plot().get_title() == survey.plot(floor=first.number).get_title() == first.name
    with pytest.raises(UsageError, match="floor 99 does not exist; available floors:"):
        survey.plot(floor=99)


def test_a_data_set_draws_its_labelled_fingerprints() -> None:
    dataset = small_dataset()
    assert repr(dataset).startswith("Dataset(name: ")
    axes = dataset.plot(floor=0)
    assert [text.get_text() for text in axes.get_legend().get_texts()] == ["wifi: 22 fingerprints"]


def test_radio_maps_draw_the_strongest_signal() -> None:
    maps = next(radio_maps(small_dataset(), RadioMapSettings(cell_m=2.0)))
    assert len(repr(maps)) < 200
    (image,) = maps.plot().images
    assert np.nanmax(np.asarray(image.get_array())) == pytest.approx(np.nanmax(maps.mean_dbm))
    assert replace(maps, scans=7)._facts()["fingerprints"] == 7
