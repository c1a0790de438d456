"""What is reported of a walk that was placed on a plan: what was placed, why the rest was not, and the plan."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import cast

import numpy as np
import pytest

from tests.pipeline.labels.mapped import walk
from tests.walks import landmarks_at
from vislam2tag.common.findings import Severity
from vislam2tag.core.context import FixLog
from vislam2tag.core.placing import Candidate, Placing
from vislam2tag.core.status import Status
from vislam2tag.core.tracks import CameraTrack, Landmarks, Visit
from vislam2tag.pipeline.labels.placing_findings import placing_findings
from vislam2tag.sessions.model import Session
from vislam2tag.sessions.prepared import PreparedSession, SessionTask
from vislam2tag.site.corrections.file import Corrections
from vislam2tag.site.model import ControlPoints, Floor, SessionKey, SessionRef, Site

GOOD = Placing(
    way_m=140.0, misfit=0.08, mirror=12.0, exchanged=8.0, floors=((2, 9.0),), labelled_share=1.0, reason=Status.OK
)
REFUSED = replace(GOOD, labelled_share=0.0, reason=Status.AMBIGUOUS)
NOWHERE = np.empty((0, 2))
NONE = landmarks_at({})


def prepared(camera: CameraTrack, landmarks: Landmarks) -> PreparedSession:
    """A session on floor 3, of which these findings use nothing else."""
    floor = Floor(3, "3", 10.0, 10.0, None, None, ControlPoints((), NOWHERE))
    ref = SessionRef(SessionKey(3, "LG", "walk"), Path(), "published", "s")
    task = SessionTask(ref, Site((floor,), landmarks_at({})), Corrections())
    return PreparedSession(task, cast(Session, SimpleNamespace(camera=camera)), landmarks, (), ())


def found(
    placing: Placing | None,
    *statuses: Status,
    fixes: FixLog | None = None,
    landmarks: Landmarks = NONE,
    visits: tuple[Visit, ...] = (),
) -> dict[str, tuple[Severity, str]]:
    """Kinds, severities and messages for a walk whose frames, a second apart, have these statuses."""
    camera, trajectory = walk(np.arange(float(len(statuses))), list(statuses))
    placed = replace(trajectory, placing=placing, visits=visits)
    session = prepared(replace(camera, fixes=fixes), landmarks)
    return {each.kind: (each.severity, each.message) for each in placing_findings(session, placed)}


def test_a_walk_that_no_plan_placed_has_none() -> None:
    assert found(None, Status.OK, Status.NO_MAPPING) == {}


def test_a_placed_walk_says_that_its_labels_are_as_exact_as_the_plan() -> None:
    ((kind, (severity, message)),) = found(GOOD, Status.OK, Status.OK).items()
    assert (kind, severity) == ("placed_on_plan", Severity.INFO)
    assert message.startswith("100 % of the walk was placed")
    assert "as exact as the plan" in message


def test_a_part_that_is_not_certain_is_reported_beside_it() -> None:
    placing = replace(GOOD, labelled_share=0.8)
    both = found(placing, Status.OK, Status.OK, Status.AMBIGUOUS)
    assert both.keys() == {"placed_on_plan", "not_placed"}
    assert both["placed_on_plan"][1].startswith("80 %")
    severity, message = both["not_placed"]
    assert severity is Severity.WARNING
    assert message.startswith("20 % of the walk has no position, because its shape fits several places")


@pytest.mark.parametrize(
    ("reason", "why", "cure"),
    [
        (Status.AMBIGUOUS, "its shape fits several places of the plan of floor 3", "Tap one known place"),
        (Status.FITS_NOWHERE, "about as well with left and right exchanged from its middle on", "Tap one known place"),
        (Status.FITS_MIRROR, "plan of floor 3 fits its mirror image about as well (the walk", "Tap one known place"),
        (Status.FITS_OTHER_FLOOR, "the plan of floor 5 fits it about as well as that of floor 3", "on this floor"),
        (Status.TOO_SHORT, "its way of 140 m fits several places of the plan of floor 3", "Tap one known place"),
        (Status.PLAN_TOO_OPEN, "the plan of floor 3 shows so few walls", "Use landmarks"),
    ],
)
def test_each_refusal_has_its_reason_and_a_cure(reason: Status, why: str, cure: str) -> None:
    placing = replace(REFUSED, reason=reason, floors=((2, 9.0), (5, 1.0)))
    ((kind, (severity, message)),) = found(placing, reason, reason).items()
    assert (kind, severity) == ("not_placed", Severity.WARNING)
    assert message.startswith("100 % of the walk has no position, because ")
    assert why in message
    assert cure in message.partition(why)[2]


@pytest.mark.parametrize(
    ("changes", "reason", "why"),
    [
        ({"misfit": 0.2502}, Status.FITS_NOWHERE, "floor 3 (0.26 nats per 10 m; at most 0.25 is accepted): wherever"),
        ({"exchanged": 0.98}, Status.FITS_NOWHERE, "(the walk fits better by 0.9 nats; at least 1 is required)"),
        ({"mirror": 2.97}, Status.FITS_MIRROR, "better by 2.9 nats; for a walk that fits like this, at least 4.0 are"),
        (
            {"mirror": 4.98, "misfit": 0.18},
            Status.FITS_MIRROR,
            "by 4.9 nats; for a walk that fits like this, at least 5",
        ),
        ({"mirror": -1.0}, Status.FITS_MIRROR, "the plan of floor 3 fits its mirror image better. Tap one"),
        ({"mirror": -6.0}, Status.FITS_MIRROR, "the plan of floor 3 fits its mirror image better. Check the plan"),
        ({"misfit": 0.3, "mirror": -6.0}, Status.FITS_MIRROR, "fits its mirror image better. Check the plan"),
    ],
)
def test_numbers_differ_from_the_limit_that_applied(changes: dict[str, float], reason: Status, why: str) -> None:
    placing = replace(REFUSED, reason=reason, **changes)  # type: ignore[arg-type]
    assert why in found(placing, reason)["not_placed"][1]


def test_a_part_through_walls_is_not_the_whole_walk() -> None:
    message = found(replace(GOOD, labelled_share=0.9), Status.OK, Status.FITS_NOWHERE)["not_placed"][1]
    assert "10 % of the walk has no position, because this part goes through walls of the plan of floor 3" in message
    assert "Check the plan" in message


def test_the_tap_that_shows_the_floor_has_its_moment() -> None:
    placing = replace(REFUSED, reason=Status.FITS_OTHER_FLOOR, best_tap=1)
    assert (
        "settles it, best where the walk was at 0:01" in found(placing, *[Status.FITS_OTHER_FLOOR] * 2)["not_placed"][1]
    )


def test_the_commonest_reason_of_the_frames_counts() -> None:
    statuses = (Status.FITS_NOWHERE, Status.TOO_SHORT, Status.TOO_SHORT, Status.OK)
    assert "its way of" in found(replace(GOOD, labelled_share=0.3), *statuses)["not_placed"][1]


def candidates(*weights: float) -> tuple[Candidate, ...]:
    return tuple(Candidate(weight, NOWHERE, 0.0) for weight in weights)


def test_possible_places_are_counted_with_their_probabilities() -> None:
    placing = replace(REFUSED, candidates=candidates(0.5, 0.3, 0.1, 0.05))
    (_, message) = found(placing, Status.AMBIGUOUS)["not_placed"]
    assert "fits 4 or more places (50 %, 30 %, 10 % probable)" in message
    alone = replace(REFUSED, candidates=candidates(1.0))
    assert "fits several places of" in found(alone, Status.AMBIGUOUS)["not_placed"][1]
    rare = replace(REFUSED, candidates=candidates(0.996, 0.004))
    assert "fits several places of" in found(rare, Status.AMBIGUOUS)["not_placed"][1]


@pytest.mark.parametrize(("frame", "clock", "at_s"), [(3, "0:03", 3), (90, "1:30", 90)])
def test_the_best_moment_for_a_tap_is_given_as_corrections_need_it(frame: int, clock: str, at_s: int) -> None:
    message = found(replace(REFUSED, best_tap=frame), *[Status.AMBIGUOUS] * 100)["not_placed"][1]
    assert f"best where the walk was at {clock} (at_s = {at_s})" in message
    assert "set_tap to corrections.toml" in message


def test_a_walk_that_landmarks_place_has_no_frames_to_report() -> None:
    assert found(REFUSED, Status.OK, Status.OK) == {}


@pytest.mark.parametrize(("mirror", "reported"), [(-5.0, True), (-4.9, False), (3.0, False)])
def test_a_plan_that_fits_the_mirror_image_better_is_mirrored(mirror: float, reported: bool) -> None:
    kinds = found(replace(REFUSED, reason=Status.FITS_MIRROR, mirror=mirror), Status.FITS_MIRROR)
    assert ("plan_mirrored" in kinds) == reported
    if reported:
        severity, message = kinds["plan_mirrored"]
        assert severity is Severity.WARNING
        assert "by 5 nats" in message
        assert "flip it" in message


@pytest.mark.parametrize(
    ("scale", "sigma", "words"),
    [
        (1.02, 0.004, "2.0 % too large"),
        (0.97, 0.004, "3.0 % too small"),
        (1.0079, 0.001, ""),
        (1.02, 0.007, ""),
        (float("nan"), float("nan"), ""),
    ],
)
def test_a_plan_of_another_size_than_the_way_is_reported(scale: float, sigma: float, words: str) -> None:
    kinds = found(replace(GOOD, scale=scale, scale_sigma=sigma), Status.OK)
    assert ("plan_scale" in kinds) == bool(words)
    if words:
        severity, message = kinds["plan_scale"]
        assert severity is Severity.WARNING
        assert words in message
        assert "0.4 %" in message


OK = Status.OK
PATH = Candidate(1.0, np.array([(0.0, 10.0), (100.0, 10.0)]), 0.0)
"""It moves by 1 m/s."""
ON_PATH = replace(GOOD, frame=(0, 100), candidates=(PATH,))


def tap(at_s: float, x: float, y: float, sigma_m: float | None = None) -> FixLog:
    """A place that someone tapped; frames begin at 10**12 ns."""
    sigma = None if sigma_m is None else np.array([sigma_m])
    return FixLog(np.array([10**12 + round(at_s * 1e9)]), np.array([(x, y)]), ("tap",), sigma)


@pytest.mark.parametrize(
    ("fix", "off"),
    [
        (tap(65.5, 65.5, 20.0), "10 m"),
        (tap(65.5, 62.3, 10.0), "3 m"),
        (tap(65.5, 65.5, 12.9), ""),
        (tap(65.5, 65.5, 20.0, 4.0), ""),
        (tap(65.5, 65.5, 12.9, 0.1), "3 m"),
        (tap(65.5, 65.5, 20.0, np.nan), "10 m"),
    ],
)
def test_a_tap_that_the_rest_of_the_walk_outvotes_is_reported(fix: FixLog, off: str) -> None:
    kinds = found(ON_PATH, *[OK] * 101, fixes=fix)
    assert ("place_disagrees" in kinds) == bool(off)
    if off:
        severity, message = kinds["place_disagrees"]
        assert severity is Severity.WARNING
        assert message.startswith(f"the tap at 1:05 (at_s = 65.5) is {off} from where the walk fits the plan. Correct")


def test_a_tap_disagrees_only_with_paths_that_are_probable() -> None:
    other = replace(PATH, position_bcs=PATH.position_bcs + np.array([0.0, 10.0]))
    wrong = tap(65.0, 65.0, 20.0)

    def disagrees(*weights: float, **changes: float) -> bool:
        both = tuple(replace(one, weight=weight) for one, weight in zip((PATH, other), weights, strict=False))
        placing = replace(ON_PATH, candidates=both, **changes)  # type: ignore[arg-type]
        return "place_disagrees" in found(placing, *[OK] * 101, fixes=wrong)

    assert disagrees(0.95, 0.05)
    assert not disagrees(0.8, 0.2)
    assert not disagrees()
    assert not disagrees(1.0, misfit=0.3), "the plan is wrong, so no path is right"


def test_a_landmark_that_the_rest_of_the_walk_outvotes_is_reported() -> None:
    surveyed = landmarks_at({"a": (50.0, 18.0), "b": (60.0, 12.0), "c": (70.0, 30.0), "d": (80.0, 30.0)})
    surveyed = replace(surveyed, floor=np.array([3, 3, 3, 1]))
    visits = (Visit(50, "a", 1.0), Visit(51, "a", 1.0), Visit(60, "b", 1.5), Visit(80, "d", 1.0), Visit(90, "new", 1.0))
    (message,) = [
        one
        for kind, (_, one) in found(ON_PATH, *[OK] * 101, landmarks=surveyed, visits=visits).items()
        if "dis" in kind
    ]
    assert message.startswith("landmark a is 8 m from where the walk fits the plan.")
