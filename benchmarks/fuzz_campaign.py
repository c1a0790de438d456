"""A fuzz campaign: damaged files of every kind for every reader and command.

No traceback, no crash, no hang beyond 60 s of processor time, no more than 2 GB, exit codes as documented. It can be
ended at any time and goes on where it was: OUT/progress.json holds the number of runs of each target. What fails lies
in OUT/failures, with the damaged folder and what was said.

    python benchmarks/fuzz_campaign.py                            100,000 runs, spread over all targets
    python benchmarks/fuzz_campaign.py --runs 500 --target site --target "import uji"
    python benchmarks/fuzz_campaign.py --readers --runs 5000      the functions only, not the commands
    python benchmarks/fuzz_campaign.py --again "site" 17          one run again, with its output
"""

from __future__ import annotations

import argparse
import importlib
import json
import pkgutil
import shutil
import sys
import tempfile
from collections.abc import Sequence
from functools import partial
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
sys.path[:0] = [str(ROOT), str(ROOT / "benchmarks")]

import numpy as np  # noqa: E402
from fuzzing.bases import make_bases  # noqa: E402
from fuzzing.mutations import damage  # noqa: E402
from fuzzing.runs import Outcome, run_apart  # noqa: E402
from fuzzing.targets import TARGETS, Target  # noqa: E402

import vislam2tag  # noqa: E402

RUNS = 100_000
READERS_MORE = 20
"""A reader has so many times the runs of a command: it takes so much less time."""


def main() -> int:
    """Run the campaign; returns 1 where anything failed."""
    options = _options()
    _import_everything()
    make_bases(options.out / "bases")
    if options.again:
        name, number = options.again
        target = next(each for each in TARGETS if each.name == name)
        outcome = attack(target, int(number), options.out / "bases", keep=options.out / "again")
        print(outcome.output, outcome, sep="\n")
        return bool(outcome.fault)
    chosen = [each for each in TARGETS if (not options.target or each.name in options.target)]
    chosen = [each for each in chosen if each.reader or not options.readers]
    failed = 0
    for target, number in _plan(chosen, options.runs, _done(options.out)):
        failed += _run(target, number, options.out)
    print(f"{sum(_done(options.out).values())} runs in all, {failed} failed now")
    return bool(failed)


def _import_everything() -> None:
    """So that no run has to: each is a process forked from this one."""
    for module in pkgutil.walk_packages(vislam2tag.__path__, "vislam2tag."):
        if not module.name.endswith("__main__"):
            importlib.import_module(module.name)


def attack(target: Target, number: int, bases: Path, keep: Path | None = None) -> Outcome:
    """Make one run: the same number damages in the same way. Where it fails, what it was made of goes to ``keep``."""
    with tempfile.TemporaryDirectory() as scratch:
        work = partial(_damage_and_work, target, number, bases, Path(scratch))
        outcome = run_apart(work, target.codes, Path(scratch, "output.txt"))
        if keep and outcome.fault:
            shutil.rmtree(keep, ignore_errors=True)
            shutil.copytree(Path(scratch, "damaged"), keep / "damaged", symlinks=True, ignore=_no_plain_file)
            (keep / "what.txt").write_text(f"{outcome.fault}\n{outcome.output}")
    return outcome


def _damage_and_work(target: Target, number: int, bases: Path, scratch: Path) -> None:
    """In the child: Polars must not be used before it is forked."""
    rng = np.random.default_rng([number, *target.name.encode()])
    folder, out = scratch / "damaged", scratch / "out"
    shutil.copytree(bases / target.base, folder)
    out.mkdir()
    files = sorted({path for pattern in target.files for path in folder.glob(pattern) if path.is_file()})
    count = min(len(files), int(rng.choice([1, 1, 1, 2, 3])))
    for index in rng.choice(len(files), size=count, replace=False):
        print(f"{files[index].relative_to(folder)}: {damage(files[index], rng)}", flush=True)
    target.work(folder, bases, out)


def _no_plain_file(folder: str, names: Sequence[str]) -> list[str]:
    return [name for name in names if not (Path(folder, name).is_file() or Path(folder, name).is_dir())]


def _run(target: Target, number: int, out: Path) -> int:
    """Make one run, tell of a failure, and note that it was made."""
    slug = target.name.replace(" ", "-")
    outcome = attack(target, number, out / "bases", keep=out / "failures" / f"{slug}-{number}")
    if outcome.fault:
        print(f"{target.name} {number}: {outcome.fault}", flush=True)
    done = _done(out)
    done[target.name] = number + 1
    partial_file = out / "progress.json.part"
    partial_file.write_text(json.dumps(done, indent=1, sort_keys=True))
    partial_file.replace(out / "progress.json")
    return bool(outcome.fault)


def _done(out: Path) -> dict[str, int]:
    try:
        found: dict[str, int] = json.loads((out / "progress.json").read_text())
    except FileNotFoundError:
        return {}
    return found


def _plan(targets: Sequence[Target], runs: int, done: dict[str, int]) -> list[tuple[Target, int]]:
    """Which runs are left, the targets in turn, so that an early end has tried all."""
    weights = {each.name: READERS_MORE if each.reader else 1 for each in targets}
    share = runs / sum(weights.values())
    left = [
        (number / weights[target.name], target.name, target, number)
        for target in targets
        for number in range(done.get(target.name, 0), round(share * weights[target.name]))
    ]
    return [(target, number) for _, _, target, number in sorted(left, key=lambda each: each[:2])]


def _options() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--out", type=Path, default=Path("fuzz-campaign"))
    parser.add_argument("--runs", type=int, default=RUNS, help="of all targets together, those of before among them")
    parser.add_argument("--target", action="append")
    parser.add_argument("--readers", action="store_true")
    parser.add_argument("--again", nargs=2, metavar=("TARGET", "NUMBER"))
    return parser.parse_args()


if __name__ == "__main__":
    sys.exit(main())
