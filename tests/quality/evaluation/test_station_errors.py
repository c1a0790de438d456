from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from tests.quality.evaluation.maps import straight_walk
from tests.quality.evaluation.stations import BCS_T_STATION, CLOCK_NS, before_station, corridor_walk, frame, measured
from vislam2tag.quality.evaluation.station_clock import StationWalk, align_device
from vislam2tag.quality.evaluation.station_errors import clock_offset, station_findings, station_point_errors
from vislam2tag.quality.evaluation.truth import Truth, TruthKind


def test_errors_at_the_stations_rate() -> None:
    walk = straight_walk(shift=(0.4, 0.3))
    seconds = np.arange(1.0, 9.0, 0.25)
    time_ns = ((1 + seconds) * 1e9).astype(np.int64)
    truth = Truth(time_ns, np.column_stack((seconds, np.zeros_like(seconds))))
    errors = station_point_errors(walk, truth)
    assert errors.kind is TruthKind.TOTAL_STATION
    np.testing.assert_allclose(errors.error_m, 0.5)
    np.testing.assert_allclose(errors.along_m, 0.4)
    np.testing.assert_allclose(errors.across_m, 0.3)
    assert not station_point_errors(walk, Truth(time_ns + 10**12, truth.position_bcs)).labelled.any()


def test_the_papers_clock_is_that_of_least_error_over_all_walks() -> None:
    walks = [corridor_walk(1000.0, seed=1), corridor_walk(2000.0, seed=2)]
    found = clock_offset([(walk, measured(walk, 4.23)) for walk in walks], BCS_T_STATION)
    assert (found - CLOCK_NS) / 1e9 == pytest.approx(4.23, abs=0.011)


def test_findings_say_why_a_walk_is_not_scored() -> None:
    walks = before_station([corridor_walk(1000.0, seed=1), corridor_walk(2000.0, seed=2)])
    restarted = StationWalk(walks[1].reference, replace(measured(walks[1].reference, 3600.0), left_out=3), frame())
    walks = [walks[0], walks[0], restarted]
    alignment = align_device(walks)
    assert station_findings(walks[0], alignment, 0) == []
    kinds = {finding.kind: finding for finding in station_findings(restarted, alignment, 2)}
    assert list(kinds) == ["station_rows", "station_no_overlap"]
    assert kinds["station_rows"].count == 3
    assert "+3600." in kinds["station_no_overlap"].message


def test_an_unsure_clock_is_a_finding() -> None:
    walk = before_station([corridor_walk()])[0]
    alignment = replace(align_device([walk]), clock_sigma_s=0.4)
    (finding,) = station_findings(walk, alignment, 0)
    assert (finding.kind, "0.40 s" in finding.message) == ("station_clock", True)
