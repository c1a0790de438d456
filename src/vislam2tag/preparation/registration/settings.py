"""How well surveyors' tools measure, and when a measurement is called wrong."""

from __future__ import annotations

from pydantic import Field

from vislam2tag.common.records import FiniteRecord


class RegistrationSettings(FiniteRecord):
    """Standard deviations before the adjustment; each is per axis, metres, unless said otherwise."""

    shot_sigma_m: float = Field(default=0.003, gt=0)
    """One shot of a total station, pointing included."""
    height_sigma_m: float = Field(default=0.005, gt=0)
    """Height of one shot."""
    control_sigma_m: float = Field(default=0.005, gt=0)
    """A known point whose file gives no sigma."""
    least_sigma_m: float = Field(default=0.002, gt=0)
    """No landmark is stated better than this: a sheet is paper, and its centre a matter of millimetres."""
    tape_sigma_m: float = Field(default=0.02, gt=0)
    """One distance by tape, its slope and sag included."""
    target_sigma_m: float = Field(default=0.03, gt=0)
    """A wall or corner that tape distances lead to and whose file gives no sigma: as drawn against as built."""
    click_px: float = Field(default=2.0, gt=0)
    """How well one clicks, pixels of the screen."""
    plan_sigma_m: float = Field(default=0.1, gt=0)
    """A plan against the building."""
    prior_freedom: float = Field(default=10.0, gt=0)
    """How many redundant measurements the standard deviations above are worth: the fewer there really are, the less
    the adjustment's own sigma0 says against them."""
    false_alarm: float = Field(default=0.01, gt=0, lt=1)
    """Probability that a survey without a gross error has a measurement called wrong."""
