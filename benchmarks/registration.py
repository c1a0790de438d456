"""How well landmarks are registered: stated sigmas against true errors, gross errors named, labels that follow.

Generated networks of total stations on a floor of 60 m x 30 m (3 mm a shot, 5 mm a known point), rooms measured by
tape (2 cm a distance, 3 cm a corner), and one simulated survey whose landmarks come from a total station.

    python benchmarks/registration.py                     all tables
    python benchmarks/registration.py --draws 1000        surer figures
    python benchmarks/registration.py --only labels       one table: regions, errors, tape or labels
"""

from __future__ import annotations

import argparse
import tempfile
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from data_sets import walks_of

from vislam2tag.common.errors import SurveyError
from vislam2tag.core.arrays import FloatArray
from vislam2tag.core.tracks import Landmarks
from vislam2tag.mapping.registry import strategy_named
from vislam2tag.mapping.settings import MappingSettings
from vislam2tag.registration.network import KnownPoint, Shot
from vislam2tag.registration.network_search import search_network
from vislam2tag.registration.settings import RegistrationSettings
from vislam2tag.registration.tape_file import TapeDistance, Target
from vislam2tag.registration.trilateration import trilaterate
from vislam2tag.simulation.scenario import regular_survey
from vislam2tag.simulation.survey import simulate

SETTINGS = RegistrationSettings()
SHOT_M, KNOWN_M, TAPE_M, CORNER_M = 0.003, 0.005, 0.02, 0.03
REGIONS = {68: 2.279, 95: 5.991}


@dataclass(frozen=True)
class Network:
    """Points, and what was measured of them."""

    truth: dict[str, complex]
    shots: list[Shot]
    known: list[KnownPoint]


def main() -> None:
    """Print the tables."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--draws", type=int, default=200, help="networks for each row")
    parser.add_argument("--only", choices=("regions", "errors", "tape", "labels"))
    options = parser.parse_args()
    tables: dict[str, Callable[[int], None]] = {
        "regions": print_regions,
        "errors": print_errors,
        "tape": print_tape,
        "labels": print_labels,
    }
    for name, table in tables.items():
        if options.only in (None, name):
            table(options.draws)
            print()


def network(rng: np.random.Generator, stations: int, known: int, *, landmarks: int = 15, seen: float = 0.7) -> Network:
    """Points anywhere on the floor; each station sees two known points at least, and a share of all others."""
    names = [f"K{i}" for i in range(known)] + [str(i) for i in range(landmarks)]
    truth = {name: complex(rng.uniform(0, 60), rng.uniform(0, 30)) for name in names}
    shots = []
    for number in range(stations):
        turn, shift = np.exp(1j * rng.uniform(-np.pi, np.pi)), complex(*rng.uniform(0, 1000, 2))
        for name in names:
            if rng.random() < seen or name in ("K0", "K1"):
                place = round_mm(complex(turn * truth[name] + shift + complex(*rng.normal(0, SHOT_M, 2))))
                shots.append(Shot(point=name, station=f"S{number + 1}", place=place, sigma_m=SHOT_M))
    given = [
        KnownPoint(point=name, place=round_mm(truth[name] + complex(*rng.normal(0, KNOWN_M, 2))), sigma_m=KNOWN_M)
        for name in names[:known]
    ]
    return Network(truth, shots, given)


def round_mm(place: complex) -> complex:
    """As a file has it."""
    return complex(round(place.real, 3), round(place.imag, 3))


def print_regions(draws: int) -> None:
    """Errors of landmarks beside what is stated of them."""
    print(
        "| stations | known points | landmarks | mean error, mm | mean sigma, mm | in 68 % | in 95 % | false alarms |"
    )
    print("| --- " * 8 + "|")
    for stations, known in ((1, 2), (1, 3), (1, 5), (2, 4), (3, 4), (3, 8)):
        error, sigma, square, alarms = [], [], [], 0
        for draw in range(draws):
            drawn = network(np.random.default_rng((stations, known, draw)), stations, known)
            found = search_network(drawn.shots, drawn.known, SETTINGS)
            alarms += bool(found.errors)
            for name in found.fit.places:
                if not name.startswith("K"):
                    off = found.fit.places[name] - drawn.truth[name]
                    covariance = found.fit.covariance(name)
                    error.append(abs(off))
                    sigma.append(float(np.sqrt(np.trace(covariance) / 2)))
                    square.append(distance2(off, covariance))
        print(
            f"| {stations} | {known} | {len(error)} | {1000 * np.mean(error):.1f} | {1000 * np.mean(sigma):.1f} | "
            f"{shares(square)} | {alarms} of {draws} |",
            flush=True,
        )


def shares(square: list[float]) -> str:
    """Shares inside the stated regions."""
    return " | ".join(f"{np.mean(np.array(square) < limit):.1%}" for limit in REGIONS.values())


def distance2(off: complex, covariance: FloatArray) -> float:
    """Squared Mahalanobis distance."""
    way = np.array((off.real, off.imag))
    return float(way @ np.linalg.solve(covariance, way))


def swap_known(drawn: Network, rng: np.random.Generator) -> tuple[Network, str]:
    """Interchange two known points that were shot."""
    shot = {one.point for one in drawn.shots}
    i, j = rng.choice([i for i, one in enumerate(drawn.known) if one.point in shot], 2, replace=False)
    known = list(drawn.known)
    known[i], known[j] = replace(known[i], place=known[j].place), replace(known[j], place=known[i].place)
    first, second = sorted((i, j))
    return replace(drawn, known=known), f"known points K{first} and K{second} look interchanged"


def swap_shots(drawn: Network, rng: np.random.Generator) -> tuple[Network, str]:
    """Interchange the names of two landmarks in one station."""
    seen = [i for i, one in enumerate(drawn.shots) if one.station == "S1" and not one.point.startswith("K")]
    i, j = rng.choice(seen, 2, replace=False)
    shots = list(drawn.shots)
    shots[i], shots[j] = replace(shots[i], place=shots[j].place), replace(shots[j], place=shots[i].place)
    one, other = sorted((shots[i].point, shots[j].point))
    return replace(drawn, shots=shots), f"{one} and {other} look interchanged in the shots from S1"


def mistype(drawn: Network, rng: np.random.Generator) -> tuple[Network, str]:
    """Exchange the metres of a known point's easting: 12.345 becomes 21.345."""
    shot = {one.point for one in drawn.shots}
    able = [
        i for i, one in enumerate(drawn.known) if one.point in shot and int(one.place.real) % 11 and one.place.real > 10
    ]
    if not able:
        return drawn, ""
    i = int(rng.choice(able))
    text = f"{drawn.known[i].place.real:.3f}"
    known = list(drawn.known)
    known[i] = replace(known[i], place=complex(float(text[1] + text[0] + text[2:]), known[i].place.imag))
    return replace(drawn, known=known), f"known point K{i} looks mistyped in E (digits exchanged)"


def shot_off(by_m: float) -> Callable[[Network, np.random.Generator], tuple[Network, str]]:
    """One shot of a known point is off in any direction."""

    def spoil(drawn: Network, rng: np.random.Generator) -> tuple[Network, str]:
        i = int(rng.choice([i for i, one in enumerate(drawn.shots) if one.point.startswith("K")]))
        shots = list(drawn.shots)
        way = complex(by_m * np.exp(2j * np.pi * rng.random()))
        shots[i] = replace(shots[i], place=shots[i].place + way)
        return replace(drawn, shots=shots), f"shot of {shots[i].point} from {shots[i].station}"

    return spoil


def named_errors(drawn: Network) -> list[str]:
    """What is said to be wrong, also where too little is left to go on."""
    try:
        return [error.text for error in search_network(drawn.shots, drawn.known, SETTINGS).errors]
    except SurveyError as error:
        return str(error).partition("left out as wrong: ")[2].split("; ")


def print_errors(draws: int) -> None:
    """How often a gross error is found, named for what it is, and alone."""
    print("| gross error | known points | found | named | named, and nothing else |")
    print("| --- " * 5 + "|")
    kinds: dict[str, Callable[[Network, np.random.Generator], tuple[Network, str]]] = {
        "two known points interchanged": swap_known,
        "two landmarks interchanged in one of three stations": swap_shots,
        "metres of a known point exchanged (12.3 as 21.3)": mistype,
        "a shot 2 cm off": shot_off(0.02),
        "a shot 3 cm off": shot_off(0.03),
        "a shot 10 cm off": shot_off(0.1),
    }
    for kind, spoil in kinds.items():
        for known in (4, 8):
            found = named = alone = tried = 0
            for draw in range(draws):
                rng = np.random.default_rng((known, draw))
                drawn, text = spoil(network(rng, 3, known), rng)
                if not text:
                    continue
                texts = named_errors(drawn)
                tried += 1
                found += bool(texts)
                named += any(text in one for one in texts)
                alone += len(texts) == 1 and texts[0].removeprefix("the ").startswith(text)
            print(f"| {kind} | {known} | {found / tried:.0%} | {named / tried:.0%} | {alone / tried:.0%} |", flush=True)


def print_tape(draws: int) -> None:
    """Landmarks in a room of 12 m x 8 m, from distances to its corners and walls."""
    corners = {"c1": 0j, "c2": 12 + 0j, "c3": 12 + 8j, "c4": 8j}
    print("| distances to | placed | mean error, cm | mean sigma, cm | in 68 % | in 95 % | false alarms |")
    print("| --- " * 7 + "|")
    for to in (("c1", "c2"), ("west", "south"), ("c1", "c2", "c3"), ("west", "south", "c3"), ("c1", "c2", "c3", "c4")):
        error, sigma, square, alarms = [], [], [], 0
        for draw in range(draws):
            rng = np.random.default_rng(draw)
            place = complex(rng.uniform(0.3, 11.7), rng.uniform(0.3, 7.7))
            x, y = rng.normal(0, CORNER_M, 2)
            targets = {
                name: Target(name, at + complex(*rng.normal(0, CORNER_M, 2)), None, CORNER_M)
                for name, at in corners.items()
            }
            targets["west"] = Target("west", complex(x, 0), complex(x, 8), CORNER_M)
            targets["south"] = Target("south", complex(0, y), complex(12, y), CORNER_M)
            exact = {name: abs(place - at) for name, at in corners.items()} | {"west": place.real, "south": place.imag}
            distances = [TapeDistance("7", name, max(exact[name] + rng.normal(0, TAPE_M), 0), TAPE_M) for name in to]
            found = trilaterate(distances, targets, SETTINGS, extent_m=(0, 12, 0, 8))
            alarms += bool(found.errors)
            if one := found.placed.get("7"):
                error.append(abs(one.place - place))
                sigma.append(float(np.sqrt(np.trace(one.covariance) / 2)))
                square.append(distance2(one.place - place, one.covariance))
        print(
            f"| {', '.join(to)} | {len(error) / draws:.0%} | {100 * np.mean(error):.1f} | {100 * np.mean(sigma):.1f} | "
            f"{shares(square)} | {alarms} of {draws} |",
            flush=True,
        )


def print_labels(draws: int) -> None:
    """Errors of the smoother's labels with exact landmarks, and with those that two stations gave."""
    del draws
    print("| landmarks | label mean, m | label p95, m |")
    print("| --- | --- | --- |")
    with tempfile.TemporaryDirectory() as folder:
        root = Path(folder) / "survey"
        simulate(regular_survey(5, "default", floors=(0,), sessions=2), root)
        walks = list(walks_of(root, truth_at_frames=True))
        exact = walks[0].landmarks
        rows = {"exact": exact, "registered": by_stations(exact), "clicked (10 cm)": moved(exact, 0.1)}
        for name, landmarks in rows.items():
            strategy = strategy_named("smoother", MappingSettings())
            errors = [walk.errors(strategy.map(walk.camera, walk.log, landmarks)) for walk in walks]
            error = np.concatenate([one[np.isfinite(one)] for one in errors])
            print(f"| {name} | {error.mean():.3f} | {np.quantile(error, 0.95):.3f} |", flush=True)


def by_stations(exact: Landmarks) -> Landmarks:
    """The landmarks as two stations and four known points give them."""
    rng = np.random.default_rng(1)
    truth = {name: complex(*place) for name, place in zip(exact.ids, exact.position_bcs, strict=True)}
    corners = {"K0": 1 + 1j, "K1": 59 + 1j, "K2": 59 + 31j, "K3": 1 + 31j}
    shots = []
    for number in range(2):
        turn, shift = np.exp(1j * rng.uniform(-np.pi, np.pi)), complex(*rng.uniform(0, 1000, 2))
        for name, place in (corners | truth).items():
            seen = complex(turn * place + shift) + complex(*rng.normal(0, SHOT_M, 2))
            shots.append(Shot(point=name, station=f"S{number}", place=seen, sigma_m=SHOT_M))
    known = [KnownPoint(point=name, place=place, sigma_m=KNOWN_M) for name, place in corners.items()]
    fit = search_network(shots, known, SETTINGS).fit
    return replace(
        exact,
        position_bcs=np.array([(fit.places[name].real, fit.places[name].imag) for name in exact.ids]),
        covariance_bcs=np.array([fit.covariance(name) for name in exact.ids]),
    )


def moved(exact: Landmarks, sigma_m: float) -> Landmarks:
    """The landmarks off by so much, and stated so."""
    rng = np.random.default_rng(2)
    return replace(
        exact,
        position_bcs=exact.position_bcs + rng.normal(0, sigma_m, exact.position_bcs.shape),
        covariance_bcs=np.tile(np.eye(2) * sigma_m**2, (len(exact.ids), 1, 1)),
    )


if __name__ == "__main__":
    main()
