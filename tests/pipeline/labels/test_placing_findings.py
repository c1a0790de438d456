"""What is reported of a walk that was placed on a plan: what was placed, why the rest was not, and the plan."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import cast

import numpy as np
import pytest

from tests.pipeline.labels.mapped import walk
from tests.walks import landmarks_at
from vislam2tag.common.findings import Severity
from vislam2tag.core.placing import Candidate, Placing
from vislam2tag.core.status import Status
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


def prepared() -> PreparedSession:
    """A session on floor 3, of which these findings use nothing else."""
    floor = Floor(3, "3", 10.0, 10.0, None, None, ControlPoints((), NOWHERE))
    ref = SessionRef(SessionKey(3, "LG", "walk"), Path(), "published", "s")
    task = SessionTask(ref, Site((floor,), landmarks_at({})), Corrections())
    return PreparedSession(task, cast(Session, None), landmarks_at({}), (), ())


def found(placing: Placing | None, *statuses: Status) -> dict[str, tuple[Severity, str]]:
    """Kinds, severities and messages for a walk whose frames, a second apart, have these statuses."""
    _, trajectory = walk(np.arange(float(len(statuses))), list(statuses))
    placed = replace(trajectory, placing=placing)
    return {each.kind: (each.severity, each.message) for each in placing_findings(prepared(), placed)}


def test_a_walk_that_no_plan_placed_has_none() -> None:
    assert found(None, Status.OK, Status.NO_MAPPING) == {}


def test_a_placed_walk_says_that_its_labels_are_as_exact_as_the_plan() -> None:
    ((kind, (severity, message)),) = found(GOOD, Status.OK, Status.OK).items()
    assert (kind, severity) == ("placed_on_plan", Severity.INFO)
    assert message.startswith("100% of the walk was placed")
    assert "as exact as the plan" in message


def test_a_part_that_is_not_certain_is_reported_beside_it() -> None:
    placing = replace(GOOD, labelled_share=0.8)
    both = found(placing, Status.OK, Status.OK, Status.AMBIGUOUS)
    assert both.keys() == {"placed_on_plan", "not_placed"}
    assert both["placed_on_plan"][1].startswith("80%")
    severity, message = both["not_placed"]
    assert severity is Severity.WARNING
    assert message.startswith("20 % of the walk has no position, because its shape fits several places")


@pytest.mark.parametrize(
    ("reason", "why", "cure"),
    [
        (Status.AMBIGUOUS, "its shape fits several places of the plan of floor 3", "Tap one known place"),
        (Status.FITS_NOWHERE, "does not fit the plan of floor 3 (0.08 nats per 10 m", "Check the plan and its scale"),
        (Status.FITS_MIRROR, "plan of floor 3 fits its mirror image about as well (12.0 nats", "Tap one known place"),
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


def test_the_commonest_reason_of_the_frames_counts() -> None:
    statuses = (Status.FITS_NOWHERE, Status.TOO_SHORT, Status.TOO_SHORT, Status.OK)
    assert "its way of" in found(replace(GOOD, labelled_share=0.3), *statuses)["not_placed"][1]


def candidates(*weights: float) -> tuple[Candidate, ...]:
    return tuple(Candidate(weight, NOWHERE, 0.0) for weight in weights)


def test_possible_places_are_counted_with_their_probabilities() -> None:
    placing = replace(REFUSED, candidates=candidates(0.5, 0.3, 0.1, 0.05))
    (_, message) = found(placing, Status.AMBIGUOUS)["not_placed"]
    assert "fits 4 or more places (50%, 30%, 10% probable)" in message
    alone = replace(REFUSED, candidates=candidates(1.0))
    assert "fits several places of" in found(alone, Status.AMBIGUOUS)["not_placed"][1]


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
        (1.02, 0.004, "2.0% too large"),
        (0.97, 0.004, "3.0% too small"),
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
        assert "0.4%" in message
