"""``process --together`` for walks that are placed on the plan: what each walk learns from the others of its floor.

Each session is mapped once to keep its candidates, its scans and the direction of its compass. Walks whose place is
certain, by the plan or by landmarks, have one candidate. Also names the one known place that would help most.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from vislam2tag.common.findings import Finding, counted
from vislam2tag.core.arrays import FloatArray, IntArray
from vislam2tag.core.context import PlacingHints, PossiblePosition
from vislam2tag.core.placing import Placing
from vislam2tag.core.status import Status
from vislam2tag.core.tracks import Trajectory
from vislam2tag.estimation.settings import MappingSettings
from vislam2tag.estimation.strategy import strategy_named
from vislam2tag.pipeline.run.failures import done_or_failed
from vislam2tag.positioning.candidate_walks import (
    CERTAIN,
    COMPASS_CONCENTRATION,
    CandidateWalk,
    JointCandidates,
    combined_walks,
    joint_candidates,
)
from vislam2tag.positioning.radio_scans import RadioScans
from vislam2tag.sessions.prepared import SessionTask, mappable_session
from vislam2tag.site.model import SessionKey

HINT_SIGMA_M = 2.0
"""Candidates are exact to this, per axis."""
ROUNDED_M, ROUNDED_SHARE, ROUNDED_RAD = 0.1, 0.01, 0.05
"""Hints are rounded, so that one more session changes others only if it adds information."""
REFUSED_TRUST = 0.5
"""A walk that fits its plan badly, or others as well, may be elsewhere."""
FEWEST_NORTHS = 2
"""So many certain walks show the plan's north."""


@dataclass(frozen=True)
class PlacedSession:
    """What other sessions may learn from one.

    It has candidates with probabilities ``weight`` (c,), positions ``position`` (c, k, 2), metres, at ``time_ns`` (k,),
    and directions ``north_rad`` (c,), ``bcs_R_enu`` by its compass; None if unknown. ``scans`` are its Wi-Fi scans. A
    tap would help most at ``ask_ns``; None if it is certain. ``start_ns`` is its first frame.
    """

    key: SessionKey
    weight: FloatArray | None = None
    time_ns: IntArray | None = None
    position: FloatArray | None = None
    north_rad: FloatArray | None = None
    scans: RadioScans | None = None
    ask_ns: int | None = None
    start_ns: int = 0
    error: str | None = None


def placed_session(strategy: str, settings: MappingSettings, task: SessionTask) -> PlacedSession:
    """Read and map a session for what others may learn; a failure is recorded as its ``error``."""
    key = task.ref.key
    return done_or_failed(key, lambda: _placed(strategy, settings, task), lambda error: PlacedSession(key, error=error))


def _placed(strategy: str, settings: MappingSettings, task: SessionTask) -> PlacedSession:
    from vislam2tag.pipeline.labels.together import scans_of

    key, prepared = task.ref.key, mappable_session(task)
    camera = prepared.session.camera
    if camera.without_poses:
        return PlacedSession(key)
    mapped = strategy_named(strategy, settings).map(camera, prepared.session.landmarks, prepared.landmarks)
    wifi = prepared.session.tables.get("wifi")
    scans = None if wifi is None or not len(wifi) else scans_of(key.device, wifi)
    start_ns = int(camera.time_ns[0])
    placing = mapped.placing
    if placing is None or not placing.candidates:
        return _by_landmarks(key, mapped, scans, start_ns)
    turns = np.array([one.turn_rad for one in placing.candidates])
    known = placing.compass_rad is not None and (camera.hints is None or camera.hints.north_rad is None)
    return PlacedSession(
        key,
        weight=_trust(placing) * np.array([one.weight for one in placing.candidates]),
        time_ns=camera.time_ns[list(placing.frame)],
        position=np.stack([one.position_bcs for one in placing.candidates]),
        north_rad=turns - placing.compass_rad if known and placing.compass_rad is not None else None,
        scans=scans,
        ask_ns=None if placing.best_tap is None else int(camera.time_ns[placing.best_tap]),
        start_ns=start_ns,
    )


def _trust(placing: Placing) -> float:
    """Probability that a walk is at one of its candidates at all."""
    return 1.0 if placing.reason in (Status.OK, Status.AMBIGUOUS, Status.TOO_SHORT) else REFUSED_TRUST


def _by_landmarks(key: SessionKey, mapped: Trajectory, scans: RadioScans | None, start_ns: int) -> PlacedSession:
    """A walk that landmarks place: one candidate, its labelled frames."""
    rows = np.flatnonzero(mapped.status == Status.OK)[::15]
    if len(rows) < 2:
        return PlacedSession(key)
    return PlacedSession(
        key, np.ones(1), mapped.time_ns[rows], mapped.position_bcs[None, rows, :2], None, scans, None, start_ns
    )


def placing_hints(sessions: Sequence[PlacedSession]) -> tuple[dict[SessionKey, PlacingHints], list[Finding]]:
    """What the walks of one floor say of each other, for those that are not certain, and which place to ask for."""
    known = sorted((one for one in sessions if one.weight is not None), key=lambda one: one.key)
    walks = [_walk(one) for one in known]
    north_rad = [_north_of_others(walks, number) for number in range(len(walks))]
    if any(north is not None for north in north_rad):
        walks = [replace(walk, north_rad=None) for walk in walks]  # it is a hint of its own
    core = combined_walks(walks)
    joint = joint_candidates(walks, core) if core else None
    hints: dict[SessionKey, PlacingHints] = {}
    for number, (one, walk) in enumerate(zip(known, walks, strict=True)):
        if walk.certain:
            continue
        places = _possible(one, walk, walks, number, core, joint)
        if places or north_rad[number] is not None:
            hints[one.key] = PlacingHints(places, north_rad[number])
    return hints, _question(known, joint)


def _walk(one: PlacedSession) -> CandidateWalk:
    assert one.weight is not None
    assert one.position is not None
    assert one.time_ns is not None
    if one.scans is None:
        return CandidateWalk(one.weight, np.empty((len(one.weight), 0, 2)), None, one.north_rad)
    within = (one.scans.time_ns >= one.time_ns[0]) & (one.scans.time_ns <= one.time_ns[-1])
    scans = one.scans[np.flatnonzero(within)]
    start = one.time_ns[0]
    at_s, known_s = (scans.time_ns - start) * 1e-9, (one.time_ns - start) * 1e-9
    position = np.stack(
        [np.stack([np.interp(at_s, known_s, axis) for axis in path.T], axis=1) for path in one.position]
    )
    return CandidateWalk(one.weight, position, scans, one.north_rad)


def _north_of_others(walks: Sequence[CandidateWalk], number: int) -> float | None:
    """The plan's north by the certain walks except one; None if there are too few."""
    said = [
        float(walk.north_rad[int(walk.weight.argmax())])
        for other, walk in enumerate(walks)
        if other != number and walk.certain and walk.north_rad is not None
    ]
    if len(said) < FEWEST_NORTHS:
        return None
    mean = np.exp(1j * np.array(said)).mean()
    if np.abs(mean) < 1 - 1 / COMPASS_CONCENTRATION:  # they disagree by more than usual compasses
        return None
    return round(float(np.angle(mean)) / ROUNDED_RAD) * ROUNDED_RAD


def _possible(
    one: PlacedSession,
    walk: CandidateWalk,
    walks: Sequence[CandidateWalk],
    number: int,
    core: list[int],
    joint: JointCandidates | None,
) -> tuple[PossiblePosition, ...]:
    """Where the others say that a walk was when its candidates differ most; empty if they say nothing."""
    if joint is None or len(core) < 2 or one.ask_ns is None or one.position is None or one.time_ns is None:
        return ()
    if number not in core:
        fixed = [index for index in core if walks[index].certain]
        joint, core = joint_candidates(walks, [*fixed, number]), [*fixed, number]
    said = joint.by_others(core.index(number))
    count = len(walk.weight)
    if np.ptp(said[:count]) < ROUNDED_SHARE:
        return ()
    at = int(np.abs(one.time_ns - one.ask_ns).argmin())
    weight = ROUNDED_SHARE * np.round(said[:count] / said.sum() / ROUNDED_SHARE)
    place = ROUNDED_M * np.round(one.position[:, at] / ROUNDED_M)
    return (PossiblePosition(int(one.time_ns[at]), place, weight, HINT_SIGMA_M),)


def _question(known: Sequence[PlacedSession], joint: JointCandidates | None) -> list[Finding]:
    """The one known place that would settle most walks; none if all are certain."""
    if joint is None:
        return []
    asks = [known[row].ask_ns for row in joint.walks.tolist()]
    # No other walk settles one that has only one path and is refused, in part or wholly.
    refused = [ask is not None and prior.max() >= CERTAIN for ask, prior in zip(asks, joint.prior, strict=True)]
    open_walks = [axis for axis, always in enumerate(refused) if always or joint.marginal(axis).max() < CERTAIN]
    asked = [axis for axis in open_walks if asks[axis] is not None]
    if not asked:
        return []
    gains = [joint.settled_by(axis) for axis in asked]
    best = known[int(joint.walks[asked[int(np.argmax(gains))]])]
    assert best.ask_ns is not None
    seconds = round((best.ask_ns - best.start_ns) * 1e-9)
    settled = max(round(max(gains)), 1)
    message = (
        f"the plan does not place {counted(len(open_walks), 'walk')} with certainty. One known place settles {settled}"
        f": say where session {best.key} was at {seconds // 60}:{seconds % 60:02d}, by a click on the plan in the "
        f"studio or by set_tap in corrections.toml (at_s = {seconds})"
    )
    return [Finding(kind="one_place_helps", file="", count=settled, message=message)]
