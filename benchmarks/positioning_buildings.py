"""Surveys of other buildings, and of one whose radio waves differ: what positioning models are tried on.

    python benchmarks/positioning_buildings.py 31 survey && vislam2tag dataset survey --out fingerprints
    vislam2tag benchmark fingerprints --model cell-density --split random --split block --out figures

31: a large one; 32: a small one with few access points and two phones; 33: deeper, shorter shadows, and many misses.
"""

from __future__ import annotations

import argparse
from functools import partial
from pathlib import Path
from typing import Any

from vislam2tag.simulation import survey
from vislam2tag.simulation.scenario import Scenario, regular_survey
from vislam2tag.simulation.sensors.devices import device_names
from vislam2tag.simulation.settings import BuildingSettings

HARSH: dict[str, Any] = {
    "path_loss_exponent": 2.6,
    "wall_loss_db": 4.0,
    "shadowing_sigma_db": 7.0,
    "shadowing_length_m": 2.5,
    "fading_sigma_db": 4.0,
    "miss_share": 0.2,
}


def scenario(seed: int) -> Scenario:
    """Plan the walks."""
    large = BuildingSettings(width_m=100, height_m=60, access_points=16, cross_corridors=2)
    small = BuildingSettings(width_m=40, height_m=26, access_points=8)
    floors, devices, sessions, minutes, building = {
        31: (2, 3, 3, 5, large),
        32: (4, 2, 3, 2, small),
        33: (3, 4, 2, 3, BuildingSettings()),
    }[seed]
    numbers, names = tuple(range(floors)), device_names(devices)
    return regular_survey(seed, "default", numbers, names, sessions, 60.0 * minutes, building)


def main() -> None:
    """Write the raw survey."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("seed", type=int, choices=(31, 32, 33))
    parser.add_argument("out", type=Path)
    arguments = parser.parse_args()
    if arguments.seed == 33:  # no option of the simulator: nothing else needs other radio waves
        survey.RadioSettings = partial(survey.RadioSettings, **HARSH)  # type: ignore[assignment, attr-defined]
    survey.simulate(scenario(arguments.seed), arguments.out, survey.WritingOptions())


if __name__ == "__main__":
    main()
