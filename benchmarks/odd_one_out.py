"""How often the odd one out is named: a surveyed landmark, or a sheet that hung elsewhere for one walk or for a day.

Generated floors with 20 surveyed landmarks and 8 walks of 3 minutes, every other of which is taken for one of a second
day. Without a fault, a survey or a day that is named is a false alarm. So is a walk's sight, unless the walk, laid on
the true places of all landmarks by the rest of its map, has that one off to within half of what is said: there the
tracker slipped, or a sighting erred. Then one reference at a time is moved, in a direction drawn at random. "Possible"
is what the best test names whose false alarms are 2 % of floors, were errors normal with the deviations that each
comparison states: none where nothing can be compared. Last, all walks of a device are longer or shorter by a share,
also where few landmarks are surveyed, and less exactly.

    python benchmarks/odd_one_out.py                      seeds 21 to 24, 10 faults of each kind and size on each
    python benchmarks/odd_one_out.py --seeds 31 32 --faults 5
"""

from __future__ import annotations

import argparse
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy import stats

from landmark_survey import SIGMA_M, Site, generated_sites, spread
from vislam2tag.core.arrays import FloatArray
from vislam2tag.core.similarity import as_complex
from vislam2tag.landmark_survey.changed_map import apart
from vislam2tag.landmark_survey.comparison import Comparison
from vislam2tag.landmark_survey.device_metre import device_metres
from vislam2tag.landmark_survey.landmark_map import join
from vislam2tag.landmark_survey.local_map import LocalMap
from vislam2tag.landmark_survey.odd_one_out import Votes, vote
from vislam2tag.landmark_survey.seen_apart import seen_apart
from vislam2tag.smoother.landmark_priors import LandmarkPriors

SIZES_M = (1.0, 0.5)
DAYS = ("first", "second") * 4
"""On which each walk is taken to be made."""
DEVICES = ("first",) * 4 + ("second",) * 4
"""By which each walk was made."""
SHARES = (0.03, 0.015)
"""By which a device's metre is off."""
FEW, FEW_SHARE = ((4, 0.3), (2, 0.5)), 0.04
"""Landmarks that are surveyed, and how exactly (metres), where a device's metre is off by this share."""
EXACT_M = 0.001
"""Sigma of a place that is true."""
TRUE_SHARE = 0.5
"""A sight that is named is off in truth where the truth differs by less than this share of its size."""
FALSE_ALARMS = 0.02
"""Wanted of the best test: at most this share of floors with one."""


@dataclass(frozen=True)
class Floor:
    """A floor without a fault: local maps of its walks, survey, and what is odd all the same."""

    maps: list[LocalMap]
    priors: LandmarkPriors
    truth: LandmarkPriors
    clean: Votes

    @classmethod
    def of(cls, site: Site, seed: int, surveyed: int | None = None, sigma_m: float = SIGMA_M) -> Floor:
        """Survey so many landmarks, or all, and vote."""
        priors, truth = survey(site, seed, surveyed, sigma_m), exact(site)
        return cls(site.maps, priors, truth, vote(join(site.maps, priors), DAYS, DEVICES))

    @property
    def false(self) -> list[Comparison]:
        """Those named though nothing is off there."""
        return [one for one in self.clean.odd if one.walk is None or not self._off_in_truth(one)]

    def _off_in_truth(self, sight: Comparison) -> bool:
        """Compare a sight that was named with the true places and the rest of its walk, without others named."""
        maps = list(self.clean.joined.maps)
        assert sight.walk is not None
        own = self.maps[sight.walk]
        kept = np.isin(own.landmark, maps[sight.walk].landmark)
        maps[sight.walk] = own.select(kept | (own.landmark == sight.landmark))
        votes = vote(join(maps, self.truth))
        [true] = [one for one in (*votes.odd, *votes.fitting) if references_of([one]) == references_of([sight])]
        return bool(abs(true.offset - sight.offset) < TRUE_SHARE * sight.size_m)


def main() -> None:
    """Print false alarms, and for each kind and size of fault how often it is named."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seeds", type=int, nargs="+", default=[21, 22, 23, 24])
    parser.add_argument("--severity", default="default")
    parser.add_argument("--faults", type=int, default=10, help="of each kind and size, beside devices")
    options = parser.parse_args()
    sites = list(generated_sites(options.seeds, options.severity))
    floors = [Floor.of(site, seed) for site, seed in zip(sites, options.seeds, strict=True)]
    references = sum(len(floor.priors.position) + sum(len(one.landmark) for one in floor.maps) for floor in floors)
    named, false = (sum(map(len, found)) for found in zip(*((one.clean.odd, one.false) for one in floors), strict=True))
    bad = sum(bool(one.false) for one in floors)
    print(f"no fault: {named} of {references} references named on {sum(bool(one.clean.odd) for one in floors)} floors")
    devices = sum(len(one.clean.odd_devices) for one in floors)
    print(f"false: {false} on {bad} of {len(floors)} floors, and {devices} devices")
    for floor, seed in zip(floors, options.seeds, strict=True):
        if floor.clean.odd:
            print(f"seed {seed}: {described(floor.clean.odd)}; false: {described(floor.false) or 'none'}")
    print("| fault | injected | named | possible | others named too |")
    print("| --- " * 5 + "|")
    rng = np.random.default_rng(0)
    for size_m in SIZES_M if options.faults else ():
        for kind in KINDS:
            print(f"| {kind}, {size_m} m | {of_references(floors, kind, size_m, options.faults, rng)} |", flush=True)
    for what, share, of in device_faults(sites, options.seeds, floors):
        print(f"| metre of a device, {what} | {of_devices(of, share, rng)} |", flush=True)


def of_references(floors: Sequence[Floor], kind: str, size_m: float, faults: int, rng: np.random.Generator) -> str:
    """Move references of a kind: how many, how many are named, could be, and how much else is."""
    hits, extra, best = [], [], []
    for floor in floors:
        for _ in range(faults):
            maps, priors, culprit = KINDS[kind](floor, size_m, rng)
            odd = references_of(vote(join(maps, priors), DAYS, DEVICES).odd)
            hits.append(culprit in odd)
            extra.append(len(odd - {culprit} - references_of(floor.clean.odd)))
            best.append(possible(floor.clean, culprit, size_m))
    return f"{len(hits)} | {np.mean(hits):.0%} | {np.mean(best):.0%} | {np.mean(extra):.2f}"


def device_faults(
    sites: Sequence[Site], seeds: Sequence[int], floors: Sequence[Floor]
) -> Iterator[tuple[str, float, Sequence[Floor]]]:
    """By how much a device's metre is off, and on which floors: all landmarks surveyed, or few."""
    for share in SHARES:
        yield f"{100 * share} %", share, floors
    for count, sigma_m in FEW:
        less = [Floor.of(site, seed, count, sigma_m) for site, seed in zip(sites, seeds, strict=True)]
        yield f"{100 * FEW_SHARE} %, {count} landmarks surveyed to {sigma_m} m", FEW_SHARE, less


def of_devices(floors: Sequence[Floor], share: float, rng: np.random.Generator) -> str:
    """Put off the metre of each device: how many, how many are named, could be, and how much else is.

    Could be are those that the best test against the survey alone names. The others that are named are those of
    innocent devices and of single references.
    """
    hits, extra, best, innocent = [], [], [], 0
    for floor in floors:
        usual = {one.device: one.sigma for one in device_metres(floor.clean.joined, DEVICES)}
        for culprit in usual:
            times = 1 + share * rng.choice((-1, 1))
            maps = [
                replace(one, position=one.position * times) if device == culprit else one
                for one, device in zip(floor.maps, DEVICES, strict=True)
            ]
            votes = vote(join(maps, floor.priors), DAYS, DEVICES)
            named = [one.device for one in votes.odd_devices]
            hits.append(culprit in named)
            others = references_of(votes.odd) - references_of(floor.clean.odd)
            extra.append(len(others) + len(set(named) - {culprit}))
            innocent += len(set(named) - {culprit})
            away = share / usual[culprit]
            best.append(stats.ncx2.sf(stats.chi2.isf(FALSE_ALARMS / len(usual), 1), 1, away**2))
    shares = f"{np.mean(hits):.0%} | {np.mean(best):.0%} | {np.mean(extra):.2f}"
    return f"{len(hits)} | {shares}, {innocent} devices"


def references_of(odd: Sequence[Comparison]) -> set[Reference]:
    """Which references these are."""
    return {(one.landmark, one.walk, one.day) for one in odd}


def possible(clean: Votes, culprit: Reference, size_m: float) -> float:
    """Power of the most powerful test that is invariant to direction; 0 where nothing can be compared."""
    compared = [one for one in clean.fitting if np.isfinite(one.sigma_m)]
    landmark, _, day = culprit
    if day is None:
        sigma_m = [one.sigma_m for one in compared if references_of([one]) == {culprit}]
    else:
        seen = [number for number, one in enumerate(clean.joined.maps) if landmark in one.landmark]
        own = [number for number in seen if DAYS[number] == day]
        sigma_m = [seen_apart(apart(clean.joined, landmark, own), landmark).sigma_m] if len(own) < len(seen) else []
    return float(power(np.array(size_m / sigma_m[0]), len(compared))) if sigma_m else 0.0


def power(away_sigmas: FloatArray, compared: int) -> FloatArray:
    """Of that test of a fault so many standard deviations large, among so many references: a noncentral chi-squared."""
    return np.asarray(stats.ncx2.sf(stats.chi2.isf(FALSE_ALARMS / compared, 2), 2, away_sigmas**2))


def survey(site: Site, seed: int, surveyed: int | None = None, sigma_m: float = SIGMA_M) -> LandmarkPriors:
    """So many landmarks, well spread, or all of them surveyed with the errors stated."""
    priors = LandmarkPriors.nothing(len(site.landmarks.ids))
    rows = spread(site.landmarks, len(priors.position) if surveyed is None else surveyed)
    rng = np.random.default_rng(seed)
    off = sigma_m * (rng.standard_normal((len(priors.position), 2)) @ (1, 1j))
    priors.position[rows] = (as_complex(site.landmarks.position_bcs) + off)[rows]
    priors.covariance[rows] = np.eye(2) * sigma_m**2
    return priors


def exact(site: Site) -> LandmarkPriors:
    """All landmarks where they are."""
    truth = LandmarkPriors.nothing(len(site.landmarks.ids))
    truth.position[:] = as_complex(site.landmarks.position_bcs)
    truth.covariance[:] = np.eye(2) * EXACT_M**2
    return truth


Reference = tuple[int, int | None, str | None]
"""Landmark; walk or day where it is what these saw."""
Injected = tuple[list[LocalMap], LandmarkPriors, Reference]
"""Maps and survey with a fault, and whose it is."""


def moved_survey(floor: Floor, size_m: float, rng: np.random.Generator) -> Injected:
    """A landmark that some walk passed is surveyed elsewhere."""
    landmark = int(rng.choice(np.unique(np.concatenate([one.landmark for one in floor.maps]))))
    position = floor.priors.position.copy()
    position[landmark] += drawn(size_m, rng)
    return floor.maps, replace(floor.priors, position=position), (landmark, None, None)


def moved_sight(floor: Floor, size_m: float, rng: np.random.Generator) -> Injected:
    """A sheet hung elsewhere when one walk passed it."""
    walk = int(rng.integers(len(floor.maps)))
    landmark = int(rng.choice(floor.maps[walk].landmark))
    return seen_elsewhere(floor, landmark, [walk], drawn(size_m, rng)), floor.priors, (landmark, walk, None)


def moved_for_a_day(floor: Floor, size_m: float, rng: np.random.Generator) -> Injected:
    """A sheet hung elsewhere on a day when two walks or more passed it."""
    seen = {
        (landmark, day): [n for n, one in enumerate(floor.maps) if landmark in one.landmark and DAYS[n] == day]
        for landmark in range(len(floor.priors.position))
        for day in set(DAYS)
    }
    several = sorted(place for place, walks in seen.items() if len(walks) > 1)
    landmark, day = several[rng.integers(len(several))]
    moved = seen_elsewhere(floor, landmark, seen[landmark, day], drawn(size_m, rng))
    return moved, floor.priors, (landmark, None, day)


KINDS = {
    "survey of a landmark": moved_survey,
    "sheet elsewhere in one walk": moved_sight,
    "sheet elsewhere on one day": moved_for_a_day,
}


def drawn(size_m: float, rng: np.random.Generator) -> complex:
    """A shift in a direction drawn at random, BCS."""
    return complex(size_m * np.exp(1j * rng.uniform(0, 2 * np.pi)))


def seen_elsewhere(floor: Floor, landmark: int, walks: list[int], shift: complex) -> list[LocalMap]:
    """Maps of which some see a landmark shifted in the building."""
    maps = list(floor.maps)
    for walk in walks:
        own = maps[walk]
        moved = np.where(own.landmark == landmark, shift * np.exp(-1j * floor.clean.joined.turn_rad[walk]), 0)
        maps[walk] = replace(own, position=own.position + moved)
    return maps


def described(odd: Sequence[Comparison]) -> str:
    """In one line."""
    return ", ".join(f"{one.landmark}/{one.day or one.walk} {one.size_m:.2f} m ({one.sigmas:.1f})" for one in odd)


if __name__ == "__main__":
    main()
