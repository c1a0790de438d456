"""Walks with several possible paths, which the Wi-Fi that they share and their compasses distinguish."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.special import i0

from tests.positioning.test_walk_ties import heard, route
from vislam2tag.core.arrays import FloatArray
from vislam2tag.positioning import candidate_walks as module
from vislam2tag.positioning.candidate_walks import (
    COMPASS_CONCENTRATION,
    NONE_SHARE,
    CandidateWalk,
    JointCandidates,
    alike_limit,
    combined_walks,
    joint_candidates,
)

AWAY = np.array([0.0, 40.0])


def walk(*weight: float, north_rad: list[float] | None = None) -> CandidateWalk:
    """A walk without scans."""
    north = None if north_rad is None else np.array(north_rad)
    return CandidateWalk(np.array(weight), np.empty((len(weight), 0, 2)), None, north)


def in_hall(seed: int, *weight: float, shifts: tuple[FloatArray, ...] = (0 * AWAY, AWAY)) -> CandidateWalk:
    """A walk through the hall with its scans; its paths are the true one and others that are shifted."""
    rng = np.random.default_rng(seed)
    way = route(rng)
    position = np.stack([way[::2] + shift for shift in shifts[: len(weight)]])
    return CandidateWalk(np.array(weight), position, heard(way, rng), None)


def test_only_clear_preferences_count_and_none_of_the_paths_is_always_possible() -> None:
    assert walk(0.995, 0.005).prior.tolist() == [1, 0]
    assert walk(0.995, 0.005).certain
    alike = walk(0.5, 0.3)  # by half a nat, which the plan's errors may be
    np.testing.assert_allclose(alike.prior, [0.4, 0.4, 0.2])
    assert not alike.certain
    clear = walk(0.9, 0.1).prior
    assert clear[0] / clear[1] == pytest.approx(9 / np.exp(1))
    assert clear[2] == NONE_SHARE
    assert clear.sum() == pytest.approx(1)


def test_walks_that_share_nothing_are_independent() -> None:
    walks = [walk(0.9, 0.1), walk(1.0), walk(0.5, 0.3, 0.2)]
    joint = joint_candidates(walks, [0, 1, 2])
    priors = [one.prior for one in walks]
    np.testing.assert_allclose(joint.weight, np.einsum("i,j,k->ijk", *priors), atol=1e-12)
    for axis, prior in enumerate(priors):
        np.testing.assert_allclose(joint.marginal(axis), prior, atol=1e-12)
        np.testing.assert_allclose(joint.by_others(axis), 1 / len(prior))
    assert [joint.settled_by(axis) for axis in range(3)] == pytest.approx([1, 0, 1])


def test_similar_scans_show_which_path_a_walk_took() -> None:
    known, unsure, other = in_hall(1, 1.0), in_hall(2, 0.5, 0.5), in_hall(3, 0.5, 0.5)
    joint = joint_candidates([unsure, known, other], [1, 2, 0])
    assert joint.walks.tolist() == [1, 2, 0]
    assert joint.weight.shape == (1, 3, 3)
    for axis in (1, 2):
        assert joint.marginal(axis)[0] > 0.99
    by_hall = joint_candidates([known, unsure], [0, 1]).marginal(1)
    assert 0.99 < by_hall[0] < joint.marginal(2)[0], "two walks say more than one"


def test_what_others_say_of_a_walk_does_not_follow_from_its_own_weights() -> None:
    known = in_hall(1, 1.0)
    said = [joint_candidates([known, in_hall(2, *own)], [0, 1]).by_others(1) for own in ((0.8, 0.2), (0.1, 0.9))]
    np.testing.assert_allclose(said[0], said[1], rtol=1e-6)
    assert said[0][0] > 0.9
    assert said[0].sum() == pytest.approx(1)


def test_a_walk_that_took_none_of_its_paths_is_recognised() -> None:
    lost = in_hall(2, 0.5, 0.5, shifts=(AWAY, 2 * AWAY))
    joint = joint_candidates([in_hall(1, 1.0), lost], [0, 1])
    assert joint.by_others(1)[2] > 0.9


def test_scans_that_are_not_similar_say_nothing() -> None:
    known, elsewhere = in_hall(1, 1.0), in_hall(2, 0.5, 0.5)
    assert elsewhere.scans is not None
    names = tuple(f"other {name}" for name in elsewhere.scans.access_points)
    strange = replace(elsewhere, scans=replace(elsewhere.scans, access_points=names))
    np.testing.assert_allclose(joint_candidates([known, strange], [0, 1]).by_others(1), 1 / 3)


def test_compasses_agree_about_north() -> None:
    joint = joint_candidates([walk(1.0, north_rad=[0.4]), walk(0.5, 0.5, north_rad=[0.4, 0.4 + np.pi])], [0, 1])
    right, wrong, _ = joint.by_others(1)
    assert right / wrong == pytest.approx(i0(2 * COMPASS_CONCENTRATION))
    unknown = joint_candidates([walk(1.0), walk(0.5, 0.5, north_rad=[0.4, 2.0])], [0, 1])
    np.testing.assert_allclose(unknown.by_others(1), 1 / 3)


def joint_of(weight: list[object]) -> JointCandidates:
    """Joint probabilities of walks with equal candidates."""
    given = np.array(weight)
    return JointCandidates(np.arange(given.ndim), given, tuple(np.full(size, 1 / size) for size in given.shape))


def test_a_known_place_settles_the_walks_that_depend_on_it() -> None:
    assert joint_of([[0.5, 0.0], [0.0, 0.5]]).settled_by(0) == pytest.approx(2)
    assert joint_of([[0.25, 0.25], [0.25, 0.25]]).settled_by(0) == pytest.approx(1)
    one_sided = joint_of([[0.5, 0.0], [0.25, 0.25]])  # only the first path of one settles the other
    assert [one_sided.settled_by(axis) for axis in (0, 1)] == pytest.approx([1.5, 1.25])
    three = joint_of([[[0.25, 0.25], [0.0, 0.0]], [[0.0, 0.0], [0.25, 0.25]]])
    assert [three.settled_by(axis) for axis in range(3)] == pytest.approx([2, 2, 1])
    assert joint_of([[0.5, 0.5], [0.0, 0.0]]).settled_by(1) == pytest.approx(1), "the first is certain already"


def test_the_most_certain_walks_are_combined(monkeypatch: pytest.MonkeyPatch) -> None:
    walks = [walk(0.5, 0.5), walk(1.0), walk(0.3, 0.3, 0.2, 0.2), walk(0.6, 0.4)]
    assert combined_walks(walks) == [0, 1, 2, 3]
    monkeypatch.setattr(module, "MOST_COMBINATIONS", 2 * 3 * 3)
    assert combined_walks(walks) == [0, 1, 3]
    assert combined_walks([]) == []


def test_how_similar_scans_are_that_are_close_is_learned_within_walks() -> None:
    near, far = in_hall(1, 1.0), in_hall(1, 1.0)
    stretched = CandidateWalk(far.weight, far.position * 4, far.scans, None)
    assert 0.5 < alike_limit([near]) < alike_limit([stretched]) <= 1
    assert alike_limit([walk(1.0)]) == np.inf
