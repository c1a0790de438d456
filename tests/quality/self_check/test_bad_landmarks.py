"""Bad landmarks, from left-out errors drawn as stated and with faults put in."""

from __future__ import annotations

import numpy as np
import pytest

from vislam2tag.core.arrays import FloatArray
from vislam2tag.quality.self_check.bad_landmarks import bad_landmarks, pooled
from vislam2tag.quality.self_check.record import Fault, LeftOutMark, SessionCheck

SURVEY_M, OWN_M = 0.02, 0.15


def sessions(
    count: int,
    shift: dict[str, tuple[float, float]] | None = None,
    *,
    marks: int = 8,
    seed: int = 1,
    own_m: float = OWN_M,
) -> list[SessionCheck]:
    """Sessions that predict each landmark with their own errors; ``shift`` adds to all offsets of a landmark."""
    rng = np.random.default_rng(seed)
    return [
        SessionCheck(
            slug=f"s{number}",
            floor=1,
            device="LG",
            session=str(number),
            well_founded=True,
            left_out=[
                mark(str(i), rng.normal(0, own_m, 2) + np.array((shift or {}).get(str(i), (0.0, 0.0))))
                for i in range(marks)
            ],
        )
        for number in range(count)
    ]


def mark(name: str, offset: FloatArray) -> LeftOutMark:
    variance = OWN_M**2 + SURVEY_M**2
    return LeftOutMark(
        floor=1,
        landmark=name,
        passes=1,
        surveyed_m=(3.0, 4.0),
        offset_m=(float(offset[0]), float(offset[1])),
        covariance_m2=(variance, 0.0, variance),
        survey_covariance_m2=(SURVEY_M**2, 0.0, SURVEY_M**2),
    )


def test_nothing_is_said_of_good_landmarks() -> None:
    assert [bad_landmarks(sessions(6, seed=seed)) for seed in range(20)] == [[]] * 20


@pytest.mark.parametrize("seed", range(5))
def test_a_landmark_that_all_sessions_put_elsewhere_is_named_with_where(seed: int) -> None:
    (bad,) = bad_landmarks(sessions(6, {"3": (0.4, -0.5)}, seed=seed))
    assert (bad.landmark, bad.fault, bad.sessions, bad.surveyed_m) == ("3", Fault.OFFSET, 6, (3.0, 4.0))
    assert bad.offset_m == pytest.approx((0.4, -0.5), abs=0.2)
    assert 0.03 < bad.sigma_m < 0.12


def test_a_landmark_that_moved_between_the_sessions_scatters() -> None:
    early, late = sessions(3, {"2": (0.0, 3.0)}), sessions(3, {"2": (4.0, -3.0)}, seed=2)
    (bad,) = bad_landmarks([*early, *late])
    assert (bad.landmark, bad.fault) == ("2", Fault.SCATTER)
    assert bad.size_m > 2


def test_one_session_alone_leaves_a_doubt() -> None:
    (bad,) = bad_landmarks(sessions(1, {"5": (2.0, 0.0)}))
    assert (bad.landmark, bad.fault) == ("5", Fault.DOUBT)


def test_one_session_that_strays_does_not_accuse_a_landmark_that_others_know() -> None:
    assert bad_landmarks([*sessions(6), *sessions(1, {"5": (2.0, 0.0)}, seed=9)]) == []


def test_a_session_whose_landmarks_are_all_off_accuses_none() -> None:
    assert bad_landmarks(sessions(1, own_m=4 * OWN_M)) == []


def test_sessions_with_too_few_landmarks_are_not_asked() -> None:
    unsure = [session.model_copy(update={"well_founded": False}) for session in sessions(4, {"3": (2.0, 0.0)})]
    assert bad_landmarks(unsure) == []


def test_pooling_gains_certainty_with_sessions_but_not_beyond_the_survey() -> None:
    rng = np.random.default_rng(3)
    survey = np.eye(2) * SURVEY_M**2
    sigmas = []
    for count in (4, 16, 64):
        offset = rng.normal(0, OWN_M, (count, 2)) + np.array([0.3, 0.0])
        together = pooled(offset, np.tile(np.eye(2) * OWN_M**2 + survey, (count, 1, 1)), survey)
        sigmas.append(np.sqrt(together.covariance[0, 0]))
    assert OWN_M > sigmas[0] > sigmas[1] > sigmas[2] > SURVEY_M
    assert sigmas[1] == pytest.approx(np.hypot(SURVEY_M, OWN_M / 4), rel=0.5)
