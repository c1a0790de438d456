"""Three kinds of walks, by what they imitate."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from second_generator.habits import (
    Corrections,
    Drift,
    Gait,
    Habits,
    Kidnaps,
    Losses,
    Sheets,
    Sight,
    SightingErrors,
    Surveying,
    Updates,
)
from second_generator.random_numbers import log_uniform, one_of


def published(rng: np.random.Generator) -> Habits:
    """Draw habits as in sessions of the published layout.

    Every landmark is logged in each frame, as long as it is within 0.9 m with one error all along a pass; map updates
    come with or without a landmark in view; kidnaps are taken back by less than they were; orientations say nothing.
    """
    return Habits(
        gait=Gait(
            rate_hz=30.0,
            duration_s=one_of(rng, 120.0, 120.0, 300.0, 600.0),
            speed_mps=rng.uniform(0.8, 1.1),
            pauses_per_min=one_of(rng, 0.0, 0.5),
        ),
        sheets=Sheets(spacing_m=rng.uniform(10, 18), count=int(rng.integers(9, 26)), aside_m=(0.05, 0.85)),
        sight=Sight(reach_m=0.88, reach_spread_m=0.06),
        errors=SightingErrors(pass_bias_m=rng.uniform(0.03, 0.07), convention="constant"),
        drift=Drift(slip_m_per_sqrt_s=0.0057, heading_walk_rad_per_sqrt_s=0.003, scale_wander=0.006),
        surveying=Surveying(mis_surveyed=0.04 * (rng.random() < 0.3)),
        updates=Updates(per_min=1.5),
        losses=Losses(per_min=0.5),
        kidnaps=Kidnaps(per_min=0.2 * (rng.random() < 0.6), end=one_of(rng, "time", "landmark")),
        corrections=Corrections(per_min=rng.uniform(0.1, 0.5)),
        camera_yaw="bcs",
    )


def iphone(rng: np.random.Generator) -> Habits:
    """Draw habits as on real walks with an iPhone.

    Two poses a second, one to eight sightings a pass, some of them far off; no map updates and no losses; small
    breaks; scale and heading that differ from leg to leg.
    """
    return Habits(
        gait=Gait(
            rate_hz=2.0,
            duration_s=rng.uniform(240, 600),
            speed_mps=rng.uniform(0.9, 1.3),
            pauses_per_min=rng.uniform(0.5, 2.0),
            stands_at_sheet=rng.uniform(0.3, 1.0),
        ),
        sheets=Sheets(spacing_m=rng.uniform(10, 22), count=int(rng.integers(6, 26)), aside_m=(0.4, 0.9)),
        sight=Sight(
            reach_m=rng.uniform(0.8, 1.2),
            reach_spread_m=0.2,
            pattern=one_of(rng, "one", "few"),
            missed=rng.uniform(0, 0.2),
        ),
        errors=SightingErrors(
            pass_bias_m=rng.uniform(0.005, 0.04),
            frame_noise_m=rng.uniform(0.002, 0.006),
            outlier=rng.uniform(0, 0.08),
            outlier_pass=rng.uniform(0, 0.03),
            convention="yaw",
            heading_noise_rad=np.radians(rng.uniform(0.3, 2.0)),
        ),
        drift=Drift(
            slip_m_per_sqrt_m=rng.uniform(0.006, 0.03),
            heading_walk_rad_per_sqrt_s=log_uniform(rng, 0.0006, 0.005),
            heading_rate_rad_per_s=rng.normal(0, 0.0003),
            turn_gain=rng.normal(0, 0.006),
            scale_bias=rng.normal(0, 0.005),
            scale_wander=rng.uniform(0.002, 0.008),
        ),
        surveying=Surveying(),
        breaks_per_min=one_of(rng, 0.0, 0.2, 0.6),
        camera_yaw="acs",
    )


def varied(rng: np.random.Generator) -> Habits:
    """Draw habits wider than any measured ones, each apart from the others."""
    reach_m = log_uniform(rng, 0.6, 5.0)
    convention = one_of(rng, "constant", "arcore", "arcore", "arcore-leaning", "yaw")
    return Habits(
        gait=_varied_gait(rng),
        sheets=Sheets(
            spacing_m=rng.uniform(6, 25),
            count=int(log_uniform(rng, 3, 60)),
            aside_m=(0.1, max(0.6, min(0.7 * reach_m, 2.0))),
            height_spread_m=0.15,
        ),
        sight=Sight(
            reach_m=reach_m,
            reach_spread_m=reach_m * rng.uniform(0, 0.2),
            pattern=one_of(rng, "all", "all", "one", "few", "blink", "first"),
            missed=_at_times(0.5, rng.uniform(0, 0.4), rng),
        ),
        errors=SightingErrors(
            pass_bias_m=log_uniform(rng, 0.005, 0.2),
            depth_bias=_at_times(0.3, rng.normal(0, 0.03), rng),
            frame_noise_m=_at_times(0.5, log_uniform(rng, 0.001, 0.03), rng),
            settling=1.0 if rng.random() < 0.7 else rng.uniform(0.05, 0.5),
            outlier=_at_times(0.4, rng.uniform(0.01, 0.1), rng),
            outlier_pass=_at_times(0.4, rng.uniform(0.01, 0.1), rng),
            convention="constant" if convention == "constant" else "yaw" if convention == "yaw" else "arcore",
            heading_noise_rad=np.radians(log_uniform(rng, 1, 10)),
            lean_rad=0.15 if convention == "arcore-leaning" else 0.0,
        ),
        drift=_varied_drift(rng),
        surveying=Surveying(
            sigma_m=one_of(rng, 0.01, 0.02, 0.02, 0.05),
            mis_surveyed=_at_times(0.3, rng.uniform(0.02, 0.12), rng),
            moved=_at_times(0.15, 0.1, rng),
            swapped=_at_times(0.12, 0.05, rng),
            unsurveyed=_at_times(0.3, rng.uniform(0.1, 0.5), rng),
            headings=convention != "constant" and rng.random() < 0.3,
        ),
        updates=Updates(
            per_min=_at_times(0.7, log_uniform(rng, 0.2, 6), rng),
            size_m=log_uniform(rng, 0.02, 5),
            turn_rad=log_uniform(rng, 0.001, 0.15),
            scale=_at_times(0.5, 0.003, rng),
            uneven=_at_times(0.6, rng.uniform(0, 0.6), rng),
        ),
        losses=Losses(
            per_min=_at_times(0.6, rng.uniform(0.1, 1.0), rng),
            rows=one_of(rng, "pose", "pose", "none"),
            motion=one_of(rng, "normal", "frozen", "frozen-right", "drifting"),
            ends_in_break=_at_times(0.5, rng.uniform(0.2, 0.8), rng),
        ),
        kidnaps=Kidnaps(
            per_min=_at_times(0.4, rng.uniform(0.1, 0.5), rng),
            size_m=log_uniform(rng, 0.5, 30),
            turn_rad=_at_times(0.5, rng.uniform(0.02, 1.0), rng),
            end=one_of(rng, "time", "landmark", "never"),
        ),
        corrections=Corrections(
            per_min=_at_times(0.5, rng.uniform(0.1, 1.0), rng), at_revisit=_at_times(0.5, rng.uniform(0.2, 1.0), rng)
        ),
        breaks_per_min=_at_times(0.4, rng.uniform(0.1, 0.8), rng),
        camera_yaw=one_of(rng, "bcs", "acs", "constant"),
    )


def _varied_gait(rng: np.random.Generator) -> Gait:
    return Gait(
        rate_hz=one_of(rng, 2, 5, 10, 15, 20, 24, 30, 60) * rng.uniform(0.95, 1.0),
        duration_s=min(120 + rng.exponential(120), 900),
        jitter=_at_times(0.6, rng.uniform(0.005, 0.2), rng),
        holes_per_min=_at_times(0.3, rng.uniform(0.2, 1.0), rng),
        speed_mps=rng.uniform(0.6, 1.5),
        pauses_per_min=_at_times(0.6, rng.uniform(0.2, 2.0), rng),
        stands_at_sheet=_at_times(0.4, rng.uniform(0, 0.8), rng),
    )


def _varied_drift(rng: np.random.Generator) -> Drift:
    return Drift(
        slip_m_per_sqrt_s=_at_times(0.6, log_uniform(rng, 0.001, 0.02), rng),
        slip_m_per_sqrt_m=_at_times(0.6, log_uniform(rng, 0.002, 0.03), rng),
        pose_noise_m=_at_times(0.5, log_uniform(rng, 0.0005, 0.01), rng),
        heading_walk_rad_per_sqrt_s=log_uniform(rng, 0.0003, 0.006),
        heading_rate_rad_per_s=_at_times(0.3, rng.normal(0, 0.0005), rng),
        turn_gain=_at_times(0.4, rng.normal(0, 0.01), rng),
        scale_bias=_at_times(0.5, rng.uniform(-0.02, 0.02), rng),
        scale_wander=_at_times(0.6, log_uniform(rng, 0.001, 0.012), rng),
        scale_memory_s=log_uniform(rng, 5, 120),
    )


def _at_times(probability: float, value: float, rng: np.random.Generator) -> float:
    return value if rng.random() < probability else 0.0


Style = Callable[[np.random.Generator], Habits]
STYLES: dict[Style, float] = {published: 0.3, iphone: 0.25, varied: 0.45}
"""How often each comes."""


def draw_style(rng: np.random.Generator) -> Style:
    """Draw one of the styles."""
    return list(STYLES)[int(rng.choice(len(STYLES), p=list(STYLES.values())))]
