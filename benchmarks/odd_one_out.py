"""How often the odd one out is named: a surveyed landmark, or a sheet that hung elsewhere when one walk passed it.

Generated floors with 20 surveyed landmarks and 8 walks of 3 minutes. Without a fault, whatever is named is a false
alarm; then one reference at a time is moved, in a direction drawn at random. "Possible" is what the best test names
whose false alarms are 2 % of floors, were errors normal with the deviations that each comparison states.

    python benchmarks/odd_one_out.py                      seeds 21 to 24, 10 faults of each kind and size on each
    python benchmarks/odd_one_out.py --seeds 31 32 --faults 5
"""

from __future__ import annotations

import argparse
from dataclasses import replace

import numpy as np
from scipy import stats

from landmark_survey import SIGMA_M, Site, generated_sites
from vislam2tag.core.similarity import as_complex
from vislam2tag.landmark_survey.landmark_map import join
from vislam2tag.landmark_survey.odd_one_out import Comparison, Votes, vote
from vislam2tag.smoother.landmark_priors import LandmarkPriors

SIZES_M = (1.0, 0.5)
FALSE_ALARMS = 0.02
"""Wanted of the best test: at most this share of floors with one."""


def main() -> None:
    """Print false alarms, and for each kind and size of fault how often it is named."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seeds", type=int, nargs="+", default=[21, 22, 23, 24])
    parser.add_argument("--severity", default="default")
    parser.add_argument("--faults", type=int, default=10)
    options = parser.parse_args()
    sites = list(generated_sites(options.seeds, options.severity))
    priors = [survey(site, seed) for site, seed in zip(sites, options.seeds, strict=True)]
    votes = [vote(join(site.maps, prior)) for site, prior in zip(sites, priors, strict=True)]
    named = [one.odd for one in votes]
    references = sum(len(site.landmarks.ids) + sum(len(one.landmark) for one in site.maps) for site in sites)
    print(
        f"no fault: {sum(map(len, named))} of {references} references named, on {sum(map(bool, named))} of {len(sites)}"
    )
    print("| fault | injected | named | possible | others named too |")
    print("| --- " * 5 + "|")
    rng = np.random.default_rng(0)
    for size_m in SIZES_M:
        for kind, inject in (("survey of a landmark", moved_survey), ("sheet elsewhere in one walk", moved_sight)):
            hits, extra, number = 0, 0, 0
            for site, prior in zip(sites, priors, strict=True):
                for _ in range(options.faults):
                    changed, new, culprit = inject(site, prior, size_m, rng)
                    odd = [(one.landmark, one.walk) for one in vote(join(changed.maps, new)).odd]
                    hits, extra, number = hits + (culprit in odd), extra + len(set(odd) - {culprit}), number + 1
            best = possible(votes, size_m, surveys=inject is moved_survey)
            print(
                f"| {kind}, {size_m} m | {number} | {hits / number:.0%} | {best:.0%} | {extra / number:.2f} |",
                flush=True,
            )


def possible(votes: list[Votes], size_m: float, *, surveys: bool) -> float:
    """Power of the most powerful test of each comparison that is invariant to direction: a noncentral chi-squared."""
    power = []
    for found in votes:
        compared = [one for one in found.fitting if np.isfinite(one.sigma_m)]
        least = stats.chi2.isf(FALSE_ALARMS / len(compared), 2)
        sigma_m = np.array([one.sigma_m for one in compared if (one.walk is None) == surveys])
        power.append(stats.ncx2.sf(least, 2, (size_m / sigma_m) ** 2))
    return float(np.concatenate(power).mean())


def survey(site: Site, seed: int) -> LandmarkPriors:
    """All landmarks surveyed, with the errors stated."""
    priors = LandmarkPriors.nothing(len(site.landmarks.ids))
    rng = np.random.default_rng(seed)
    off = SIGMA_M * (rng.standard_normal((len(priors.position), 2)) @ (1, 1j))
    priors.position[:] = as_complex(site.landmarks.position_bcs) + off
    priors.covariance[:] = np.eye(2) * SIGMA_M**2
    return priors


Injected = tuple[Site, LandmarkPriors, tuple[int, int | None]]
"""Walks and survey with a fault, and whose it is: landmark, and walk where it is one walk's alone."""


def moved_survey(site: Site, priors: LandmarkPriors, size_m: float, rng: np.random.Generator) -> Injected:
    """A landmark that some walk passed is surveyed elsewhere."""
    landmark = int(rng.choice(np.unique(np.concatenate([one.landmark for one in site.maps]))))
    position = priors.position.copy()
    position[landmark] += size_m * np.exp(1j * rng.uniform(0, 2 * np.pi))
    return site, replace(priors, position=position), (landmark, None)


def moved_sight(site: Site, priors: LandmarkPriors, size_m: float, rng: np.random.Generator) -> Injected:
    """A sheet hung elsewhere when one walk passed it."""
    walk = int(rng.integers(len(site.maps)))
    row = int(rng.integers(len(site.maps[walk].landmark)))
    position = site.maps[walk].position.copy()
    position[row] += size_m * np.exp(1j * rng.uniform(0, 2 * np.pi))
    maps = [replace(one, position=position) if i == walk else one for i, one in enumerate(site.maps)]
    return replace(site, maps=maps), priors, (int(site.maps[walk].landmark[row]), walk)


def described(odd: tuple[Comparison, ...]) -> str:
    """In one line."""
    return ", ".join(f"{one.landmark}/{one.walk} {one.size_m:.2f} m ({one.sigmas:.1f})" for one in odd)


if __name__ == "__main__":
    main()
