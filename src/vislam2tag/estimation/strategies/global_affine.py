"""The paper's global mapping by an affine transformation (section V-A)."""

from __future__ import annotations

from vislam2tag.core.transforms import Affine2
from vislam2tag.estimation.strategies.global_ import GlobalMapping
from vislam2tag.estimation.strategy import register

NEEDS = "three surveyed landmarks seen that are not on one line"

register("global-affine", lambda settings: GlobalMapping(Affine2, settings.visit_radius_m, NEEDS))
