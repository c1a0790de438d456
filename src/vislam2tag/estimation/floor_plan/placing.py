"""A walk placed on the plans of a building: its poses, what is certain, and what would make it certain."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import TypeAlias

import numpy as np
from threadpoolctl import threadpool_limits

from vislam2tag.core.arrays import ComplexArray, IntArray, StatusArray
from vislam2tag.core.context import PlanOfFloor
from vislam2tag.core.placing import Candidate, Placing
from vislam2tag.core.status import Status
from vislam2tag.core.transforms import as_points
from vislam2tag.core.wall_costs import on_common_cells
from vislam2tag.estimation.floor_plan.acceptance import WalkFit, judged, misfit_of, plan_is_wrong
from vislam2tag.estimation.floor_plan.evidence import Fact, KnownPlace, KnownTurn, evidence_of
from vislam2tag.estimation.floor_plan.local_poses import LOCAL_LENGTH_M, LocalPoses, local_poses
from vislam2tag.estimation.floor_plan.pose_grid import PoseGrid
from vislam2tag.estimation.floor_plan.posterior import (
    AROUND_M,
    NOTHING,
    OF_DECOYS,
    BestPose,
    Evidence,
    Filtered,
    WalkPosterior,
    best_pose,
    filtered,
    open_shares,
    surroundings,
    walk_posterior,
)
from vislam2tag.estimation.floor_plan.samples import PossiblePath, possible_paths, telling_stretch
from vislam2tag.estimation.floor_plan.stretches import Stretches, stretches_of
from vislam2tag.estimation.odometry import Odometry

ENOUGH_NATS = 7.0
"""A decoy whose evidence is lower by more than this is not followed further."""
SCALE_STEP, MOST_STEPS, LEAST_CURVATURE = 0.02, 1.5, 2.0
"""Scales that are compared, how many steps away the best may be, and the least curvature of the evidence (nats)."""
LEAST_SCALE_ERROR = 0.008
"""A smaller error of the plan's scale does no harm."""
MOST_POSES = 3_000_000
"""If more poses are possible at first, the plan is too open (a hall of about 60 m x 60 m)."""
MOST_APART_M = 0.5
"""The path and a stretch's own place on the plan differ by more than this only if the tracker erred; usually by 0.1 to
0.3 m.
"""
AHEAD_POINTS = 10
"""So many points show the heading of a stretch, 2 m."""
POINTS_OF_STRETCH = 9
"""So many points of each stretch are kept of a candidate, its middle and others about 1.3 m apart: no corner is cut."""
MOST_CANDIDATES = 12
"""Paths that are shown."""


Cut: TypeAlias = Callable[..., Stretches]
"""Cuts an odometry into stretches, of a length if one is given."""


@dataclass(frozen=True)
class PlacedWalk:
    """A walk on its floor's plan: ``status`` (s,) of each stretch, the pose of each, and finer poses of those that are
    certain.
    """

    walk: Stretches
    status: StatusArray
    best: tuple[BestPose, ...]
    local: LocalPoses
    placing: Placing
    scale: float = 1.0
    """Size of the plan by the walk's shape: poses are those of the walk made so many times as large."""

    def frame_status(self, count: int) -> StatusArray:
        """Status (count,) of all frames of the odometry: that of their stretch, between two the worse of both."""
        frame = np.arange(count)
        first = np.array([one.first for one in self.walk.stretches])
        last = np.array([one.last for one in self.walk.stretches])
        after = np.searchsorted(first, frame, side="right") - 1
        inside = (after >= 0) & (frame <= last[after])
        following = np.minimum(after + 1, len(first) - 1)
        beside = np.where(self.status[after.clip(0)] != Status.OK, self.status[after.clip(0)], self.status[following])
        return np.where(inside, self.status[after.clip(0)], beside).astype(np.int8)

    def without_contradictions(self, found: ComplexArray, path: ComplexArray) -> PlacedWalk:
        """The same, if the path that was ``found`` (n,), BCS, is not where the certain stretches are by their shape.

        Such stretches contain faults of the tracker that it does not report. ``path`` (n,) is that of the odometry.
        """
        status = self.status.copy()
        for number, (stretch, pose) in enumerate(zip(self.walk.stretches, self.best, strict=True)):
            frames = slice(stretch.first, stretch.last + 1)
            expected = pose.place + np.exp(1j * pose.yaw_rad) * (path[frames] - stretch.middle)
            apart_m = float(np.sqrt(np.mean(np.abs(found[frames] - expected) ** 2)))
            if apart_m > MOST_APART_M and status[number] == Status.OK:
                status[number] = Status.FITS_NOWHERE
        placing = replace(self.placing, labelled_share=float(np.mean(status == Status.OK)))
        if not placing.labelled_share:
            placing = replace(placing, reason=Status.FITS_NOWHERE)
        return replace(self, status=status, placing=placing)


def place_walk(
    odometry: Odometry,
    plans: Sequence[PlanOfFloor],
    own: int,
    facts: Sequence[Fact] = (),
    floor: IntArray | None = None,
) -> PlacedWalk | None:
    """Place a walk on the plan of its ``own`` floor; None if that has no plan, or the walk has no stretch.

    If it leads over several floors, ``floor`` (n,) is the number of each frame's, or
    :data:`~vislam2tag.estimation.floor_plan.stretches.BETWEEN_FLOORS`; all need a plan.
    """
    cut = partial(stretches_of, floor=floor)
    walk = cut(odometry)
    if not walk.stretches:
        return None
    grids = _grids(plans, own, {one.floor for one in walk.stretches if one.floor is not None})
    if own not in grids:
        return None
    with threadpool_limits(limits=1):  # threads cost more than they save on matrices of this size
        grid = grids.pop(own)
        open_share, possible = open_shares(grid, walk)
        if possible * np.prod(grid.shape) > MOST_POSES:
            return _too_open(walk)
        posterior = walk_posterior(grid, walk, evidence_of(grid, walk, odometry, facts))
        scale = _scale(posterior, odometry, facts, cut)
        scale = scale if abs(scale - 1) > LEAST_SCALE_ERROR else 1.0
        if scale != 1:
            odometry = replace(odometry, path=odometry.path * scale)
            walk = cut(odometry)
            posterior = walk_posterior(grid, walk, evidence_of(grid, walk, odometry, facts))
        best = tuple(best_pose(grid, poses) for poses in posterior.poses)
        fit = _fit(odometry, walk, posterior, best, grids, facts, open_share, cut)
        status = judged(fit, best)
        local = local_poses(grid, walk, best, status == Status.OK, cut(odometry, LOCAL_LENGTH_M))
        placing = _placing(odometry, walk, posterior, fit, status, best)
        return PlacedWalk(walk, status, best, local, placing, scale)


def _grids(plans: Sequence[PlanOfFloor], own: int, visited: set[int]) -> dict[int, PoseGrid]:
    """Poses of a walk by the floor that it is taken to begin on; floors that it leads to are as many floors further.

    It has those for which all floors have a plan.
    """
    costs = {plan.number: plan.costs for plan in plans}
    number = sorted(costs)
    if not visited:
        return {floor: PoseGrid(found) for floor, found in costs.items() if found is not None}
    rank = {floor: at for at, floor in enumerate(number)}
    grids = {}
    for shift in range(-len(number), len(number) + 1) if {own, *visited} <= rank.keys() else ():
        taken = {floor: rank[floor] + shift for floor in {own, *visited}}
        on = {floor: costs[number[at]] for floor, at in taken.items() if 0 <= at < len(number)}
        known = {floor: found for floor, found in on.items() if found is not None}
        if len(known) == len(taken):
            known = on_common_cells(known)
            grids[number[taken[own]]] = PoseGrid(known[own], known)
    return grids


def _scale(posterior: WalkPosterior, odometry: Odometry, facts: Sequence[Fact], cut: Cut) -> float:
    """Size of the plan by the walk: the top of a parabola through the evidence of the walk at three scales.

    1 if the evidence has no top there, or is too flat.
    """

    def at(scale: float) -> float:
        other = replace(odometry, path=odometry.path * scale)
        walk = cut(other)
        evidence = evidence_of(posterior.grid, walk, other, facts)
        return filtered(posterior.grid, walk, evidence, negligible=OF_DECOYS, among=near).total

    near = surroundings(posterior.grid, posterior.poses[0])
    smaller, larger = at(1 - SCALE_STEP), at(1 + SCALE_STEP)
    curvature = 2 * posterior.log_evidence - smaller - larger
    if curvature < LEAST_CURVATURE:
        return 1.0
    return 1 + SCALE_STEP * float(np.clip((larger - smaller) / curvature / 2, -MOST_STEPS, MOST_STEPS))


def _too_open(walk: Stretches) -> PlacedWalk:
    """A walk on a plan on which too many poses are possible to compare them."""
    count = len(walk.stretches)
    nowhere = LocalPoses((), np.empty(0, dtype=np.complex128), np.empty(0), np.empty((0, 2, 2)))
    status = np.full(count, np.int8(Status.PLAN_TOO_OPEN))
    placing = Placing(walk.way_m, 0.0, 0.0, 0.0, (), 0.0, Status.PLAN_TOO_OPEN)
    return PlacedWalk(walk, status, (), nowhere, placing)


def _fit(
    odometry: Odometry,
    walk: Stretches,
    posterior: WalkPosterior,
    best: Sequence[BestPose],
    others: dict[int, PoseGrid],
    facts: Sequence[Fact],
    open_share: float,
    cut: Cut,
) -> WalkFit:
    """Compare the walk's evidence with that of decoys and of other floors."""
    grid, total = posterior.grid, posterior.log_evidence
    bound = total - ENOUGH_NATS

    def decoy(first: int) -> float:
        """Advantage of the walk over itself mirrored from a stretch on, nats."""
        mirror = Mirror.at(walk, first)
        path = replace(odometry, path=mirror.path(odometry.path))
        other = cut(path)
        evidence = evidence_of(grid, other, path, mirror.facts(facts))
        return total - reached(grid, other, evidence, posterior.filtered.first(first))

    def reached(on: PoseGrid, other: Stretches, evidence: Evidence, start: Filtered = NOTHING) -> float:
        """Logarithm of the evidence of another walk, or on another plan."""
        return filtered(on, other, evidence, start=start, bound=bound, negligible=OF_DECOYS).total

    # Who knows a place on a floor knows the floor.
    rivals = {} if any(isinstance(fact, KnownPlace) for fact in facts) else others
    half = len(walk.stretches) // 2
    return WalkFit(
        misfit=misfit_of(walk, best),
        mirror=decoy(0),
        exchanged=decoy(half) if half else ENOUGH_NATS,
        floors={number: total - reached(rival, walk, {}) for number, rival in rivals.items()},
        open_share=open_share,
        way_m=walk.way_m,
    )


@dataclass(frozen=True)
class Mirror:
    """Exchanges left and right of a walk from ``frame`` on, at the line through ``pivot``, complex metres, whose
    direction is the square root of ``turn``.
    """

    frame: int
    pivot: complex
    turn: complex

    @classmethod
    def at(cls, walk: Stretches, first: int) -> Mirror:
        """Mirror a walk from a stretch on, at the heading in which that begins."""
        points = walk.stretches[first].points
        ahead = complex(points[min(len(points) - 1, AHEAD_POINTS)] - points[0])
        turn = (ahead / abs(ahead)) ** 2 if abs(ahead) > 0 else 1.0 + 0j
        return cls(walk.stretches[first].first if first else 0, complex(points[0]), turn)

    def path(self, path: ComplexArray) -> ComplexArray:
        """A path (n,) after the exchange, complex metres."""
        mirrored = path.copy()
        mirrored[self.frame :] = self.pivot + self.turn * (path[self.frame :] - self.pivot).conj()
        return mirrored

    def facts(self, facts: Sequence[Fact]) -> list[Fact]:
        """Facts of the mirrored walk: what it saw is on its other side, and its heading is not known."""
        return [
            replace(fact, offset=self.turn * fact.offset.conjugate())
            if isinstance(fact, KnownPlace) and fact.frame >= self.frame
            else fact
            for fact in facts
            if not isinstance(fact, KnownTurn)
        ]


def _placing(
    odometry: Odometry,
    walk: Stretches,
    posterior: WalkPosterior,
    fit: WalkFit,
    status: StatusArray,
    best: Sequence[BestPose],
) -> Placing:
    reasons = status[status != Status.OK]
    if len(reasons):
        paths = possible_paths(walk, posterior, MOST_CANDIDATES)
    else:
        place, yaw_rad = np.array([one.place for one in best]), np.array([one.yaw_rad for one in best])
        certain = PossiblePath(1.0, place, yaw_rad, np.ones(len(best)))
        paths = (certain,)
    share = np.linspace(0, 1, 2 * POINTS_OF_STRETCH + 1)[1::2]
    frames = np.array([one.first + share * (one.last - one.first) for one in walk.stretches]).round().astype(np.int64)
    away = odometry.path[frames] - np.array([[one.middle] for one in walk.stretches])
    asked = asked_stretch(fit, status, best, paths)
    tap = None if asked is None else walk.stretches[asked]
    return Placing(
        way_m=fit.way_m,
        misfit=fit.misfit,
        mirror=fit.mirror,
        exchanged=fit.exchanged,
        floors=tuple(sorted(fit.floors.items())),
        labelled_share=1 - len(reasons) / len(status),
        reason=Status(int(np.bincount(reasons).argmax())) if len(reasons) == len(status) else Status.OK,
        frame=tuple(odometry.frame[frames.ravel()].tolist()),
        candidates=tuple(_candidate(path, away) for path in paths),
        best_tap=None if tap is None else int(odometry.frame[(tap.first + tap.last) // 2]),
    )


def asked_stretch(
    fit: WalkFit, status: StatusArray, best: Sequence[BestPose], paths: Sequence[PossiblePath]
) -> int | None:
    """Number of the stretch at which a known place helps most; None if none helps.

    With one path, that is the middle of the longest part without a place. If no part has one, it is the stretch whose
    place is the least certain. A known place cures neither walls across the path nor a wrong plan.
    """
    if plan_is_wrong(fit):
        return None
    fine = (Status.OK, Status.FITS_NOWHERE) if fit.refusal() is Status.OK else (Status.OK,)
    unsure = ~np.isin(status, fine)
    if len(paths) > 1 and unsure.any():
        return telling_stretch(paths)
    if unsure.all():
        return int(np.argmax([np.trace(one.covariance_m2) + (1 - one.mass) * AROUND_M**2 for one in best]))
    runs = np.flatnonzero(np.diff(unsure, prepend=False, append=False)).reshape(-1, 2)
    return int(runs[np.argmax(runs[:, 1] - runs[:, 0])].sum()) // 2 if len(runs) else None


def _candidate(path: PossiblePath, away: ComplexArray) -> Candidate:
    """A path with positions at points ``away`` (s, k) from the middles of its stretches, continuous frame."""
    turn = np.exp(1j * path.yaw_rad)
    position = path.place[:, None] + turn[:, None] * away
    return Candidate(path.weight, as_points(position.ravel()), float(np.angle(turn.sum())))
