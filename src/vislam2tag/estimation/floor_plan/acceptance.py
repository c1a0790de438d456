"""Which stretches of a walk are certain enough to be labelled, and why the others are not.

The posterior only compares poses; it does not know that none fits. So four conditions must hold:

* mass: the posterior within 2 m and 20 degrees of the best pose is at least :data:`LEAST_MASS` (each stretch);
* fit: the best path crosses hardly any wall (each stretch and the whole walk);
* decoys: the walk fits clearly better than its mirror image, and than itself with left and right exchanged from the
  middle on, as if the tracker had turned there;
* floors: no other floor's plan explains it nearly as well.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from vislam2tag.core.arrays import BoolArray, FloatArray, StatusArray
from vislam2tag.core.placing import Placing
from vislam2tag.core.status import Status
from vislam2tag.estimation.floor_plan.posterior import BestPose
from vislam2tag.estimation.floor_plan.stretches import Stretches

LEAST_MASS = 0.99
MOST_MISFIT = 0.25
"""Cost of the best path, nats per 10 m; usually 0.03 to 0.16 on the right plan, 0.2 to 1 on others."""
MOST_MISFIT_NATS = 2.5
"""Cost of one stretch; a wall costs about 4."""
LEAST_MIRROR_NATS, USUAL_MISFIT, NATS_PER_MISFIT = 4.0, 0.14, 25.0
"""Required advantage over the mirror image: more for walks that fit worse than usual."""
MIRRORED_NATS = 5.0
"""If the mirror image fits better by so much, the plan is mirrored."""
LEAST_EXCHANGED_NATS = 1.0
LEAST_FLOOR_NATS = 0.5
"""Required advantage over each other floor: few sessions are filed under a wrong floor."""
SHORT_M = 60.0
"""A shorter way is called too short where it is ambiguous."""
OPEN_SHARE = 0.15
"""If so large a share of all poses fits a stretch, the plan is too open for its shape."""


@dataclass(frozen=True)
class WalkFit:
    """How well a walk fits a plan: ``misfit`` in nats per 10 m, and by how many nats its evidence exceeds others.

    These are its ``mirror`` image, itself ``exchanged`` from the middle on, and other ``floors``, by number.
    ``open_share`` is the share of all poses that fit the first stretch.
    """

    misfit: float
    mirror: float
    exchanged: float
    floors: dict[int, float]
    open_share: float
    way_m: float

    def refusal(self) -> Status:
        """Why no stretch of the walk counts; OK if some may."""
        if self.misfit > MOST_MISFIT:
            return Status.FITS_NOWHERE if self.mirror > -MIRRORED_NATS else Status.FITS_MIRROR
        if self.mirror < required_mirror_nats(self.misfit):
            return Status.FITS_MIRROR
        if self.exchanged < LEAST_EXCHANGED_NATS:
            return Status.FITS_NOWHERE
        if any(nats < LEAST_FLOOR_NATS for nats in self.floors.values()):
            return Status.FITS_OTHER_FLOOR
        return Status.OK

    def vague(self) -> Status:
        """Why a stretch has several possible places."""
        if self.open_share > OPEN_SHARE:
            return Status.PLAN_TOO_OPEN
        return Status.TOO_SHORT if self.way_m < SHORT_M else Status.AMBIGUOUS


def required_mirror_nats(misfit: float) -> float:
    """Advantage over its mirror image that a walk with a ``misfit`` (nats per 10 m) needs, nats."""
    return LEAST_MIRROR_NATS + NATS_PER_MISFIT * max(misfit - USUAL_MISFIT, 0.0)


def plan_is_wrong(fit: WalkFit | Placing) -> bool:
    """Whether a walk fits its plan so badly, or the mirror image so much better, that no known place helps."""
    return fit.misfit > MOST_MISFIT or fit.mirror <= -MIRRORED_NATS


def misfit_of(walk: Stretches, best: Sequence[BestPose]) -> float:
    """Cost of the best path, nats per 10 m."""
    return -10 * sum(pose.fit for pose in best) / max(walk.way_m, 1e-9)


def judged(fit: WalkFit, best: Sequence[BestPose]) -> StatusArray:
    """Status (s,) of each stretch."""
    refusal = fit.refusal()
    mass: FloatArray = np.array([pose.mass for pose in best])
    crossing: BoolArray = np.array([-pose.fit > MOST_MISFIT_NATS for pose in best])
    if refusal is not Status.OK:
        # What fits several places is first of all ambiguous.
        vague = mass < 0.5 if refusal is not Status.FITS_NOWHERE else np.zeros(len(mass), dtype=bool)
        return np.where(vague, np.int8(fit.vague()), np.int8(refusal)).astype(np.int8)
    status = np.where(mass >= LEAST_MASS, np.int8(Status.OK), np.int8(fit.vague()))
    return np.where(crossing & (mass >= LEAST_MASS), np.int8(Status.FITS_NOWHERE), status).astype(np.int8)
