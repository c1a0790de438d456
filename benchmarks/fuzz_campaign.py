"""A fuzz campaign: damaged files of every kind for every reader and command.

No traceback, no crash, no hang beyond 60 s of processor time, no more than 2 GB, exit codes as documented. It can be
ended at any time and goes on where it was: OUT/progress.json holds the number of runs of each target. What fails lies
in OUT/failures, with the damaged folder and what was said.

    python benchmarks/fuzz_campaign.py                            100,000 runs, spread over all targets
    python benchmarks/fuzz_campaign.py --runs 500 --target site --target "import uji"
    python benchmarks/fuzz_campaign.py --ci                       as CI: 500 runs a reader, 100 an importer
    python benchmarks/fuzz_campaign.py --again "site" 17          one run again, with its output
"""

from __future__ import annotations

import argparse
import importlib
import json
import pkgutil
import resource
import shutil
import sys
import tempfile
from collections.abc import Iterator, Sequence
from functools import partial
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
sys.path[:0] = [str(ROOT), str(ROOT / "benchmarks")]

import numpy as np  # noqa: E402
from fuzzing.bases import make_bases  # noqa: E402
from fuzzing.mutations import damage, remove  # noqa: E402
from fuzzing.runs import Outcome, run_apart  # noqa: E402
from fuzzing.targets import TARGETS, Target  # noqa: E402

import vislam2tag  # noqa: E402

RUNS = 100_000
RUNS_IN_CI = 500
"""Of each reader."""
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
        (outcome,) = attack(target, range(int(number), int(number) + 1), options.out)
        print(outcome.output, outcome, sep="\n")
        return bool(outcome.fault)
    chosen = [each for each in TARGETS if (not options.target or each.name in options.target)]
    plan = _in_ci(chosen) if options.ci else _plan(chosen, options.runs, _done(options.out))
    failed = 0
    for target, numbers in plan:
        failed += _run(target, numbers, options.out)
    seconds = resource.getrusage(resource.RUSAGE_CHILDREN)
    print(
        f"{sum(_done(options.out).values())} runs in all, {failed} failed now; "
        f"{seconds.ru_utime + seconds.ru_stime:.0f} s of processor time now"
    )
    return bool(failed)


def _import_everything() -> None:
    """So that no run has to: each is in a process forked from this one."""
    for module in pkgutil.walk_packages(vislam2tag.__path__, "vislam2tag."):
        if not module.name.endswith("__main__"):
            importlib.import_module(module.name)


def attack(target: Target, numbers: range, out: Path) -> Iterator[Outcome]:
    """Make runs: the same number damages in the same way. Where one fails, what it was made of goes to ``failures``."""
    with tempfile.TemporaryDirectory() as folder:
        scratch, notes = Path(folder, "run"), Path(folder, "notes")
        scratch.mkdir()
        notes.mkdir()
        works = [partial(_damage_and_work, target, number, out / "bases", scratch) for number in numbers]
        for number, outcome in zip(numbers, run_apart(works, target.codes, notes), strict=True):
            if outcome.fault:
                _keep(target, number, outcome, out)
            yield outcome


def _keep(target: Target, number: int, outcome: Outcome, out: Path) -> None:
    kept = out / "failures" / f"{target.name.replace(' ', '-')}-{number}"
    shutil.rmtree(kept, ignore_errors=True)
    kept.mkdir(parents=True)
    _damaged(target, number, out / "bases", kept)
    (kept / "what.txt").write_text(f"{outcome.fault}\n{outcome.output}")


def _damage_and_work(target: Target, number: int, bases: Path, scratch: Path) -> None:
    """In the child: Polars must not be used before it is forked."""
    out = scratch / "out"
    shutil.rmtree(out, ignore_errors=True)
    out.mkdir()
    folder, what = _damaged(target, number, bases, scratch)
    print(what, flush=True)
    target.work(folder, bases, out)


def _damaged(target: Target, number: int, bases: Path, scratch: Path) -> tuple[Path, str]:
    """Damage a copy of the target's base, below ``scratch``; one that an earlier run damaged is mended first.

    Returns the copy, and in which ways it was damaged.
    """
    folder, base = scratch / "damaged", bases / target.base
    changed = scratch / "changed.txt"
    if not folder.exists():
        shutil.copytree(base, folder)
    for name in changed.read_text().splitlines() if changed.exists() else ():
        remove(folder / name)
        shutil.copy(base / name, folder / name)
    rng = np.random.default_rng([number, *target.name.encode()])
    files = sorted({path for pattern in target.files for path in base.glob(pattern) if path.is_file()})
    count = min(len(files), int(rng.choice([1, 1, 1, 2, 3])))
    names = [files[index].relative_to(base) for index in rng.choice(len(files), size=count, replace=False)]
    changed.write_text("\n".join(map(str, names)))
    return folder, "\n".join(f"{name}: {damage(folder / name, rng)}" for name in names)


def _run(target: Target, numbers: range, out: Path) -> int:
    """Make runs, tell of failures, and note how far it got; returns how many failed."""
    failed = 0
    for number, outcome in zip(numbers, attack(target, numbers, out), strict=True):
        if outcome.fault:
            print(f"{target.name} {number}: {outcome.fault}", flush=True)
            failed += 1
    done = _done(out)
    done[target.name] = numbers.stop
    partial_file = out / "progress.json.part"
    partial_file.write_text(json.dumps(done, indent=1, sort_keys=True))
    partial_file.replace(out / "progress.json")
    return failed


def _done(out: Path) -> dict[str, int]:
    try:
        found: dict[str, int] = json.loads((out / "progress.json").read_text())
    except FileNotFoundError:
        return {}
    return found


def _plan(targets: Sequence[Target], runs: int, done: dict[str, int]) -> Iterator[tuple[Target, range]]:
    """Which runs are left, a few of each target in turn, so that an early end has tried all."""
    at_once = {each.name: READERS_MORE if each.reader else 1 for each in targets}
    rounds = round(runs / sum(at_once.values()))
    for turn in range(1, rounds + 1):
        for target in targets:
            first, last = done.get(target.name, 0), turn * at_once[target.name]
            for start in range(first, last, at_once[target.name]):
                yield target, range(start, min(start + at_once[target.name], last))
            done[target.name] = max(first, last)


def _in_ci(targets: Sequence[Target]) -> Iterator[tuple[Target, range]]:
    return ((target, range(RUNS_IN_CI)) for target in targets if target.reader)


def _options() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--out", type=Path, default=Path("fuzz-campaign"))
    parser.add_argument("--runs", type=int, default=RUNS, help="of all targets together, those of before among them")
    parser.add_argument("--target", action="append")
    parser.add_argument("--ci", action="store_true", help="readers only, from the first run on")
    parser.add_argument("--again", nargs=2, metavar=("TARGET", "NUMBER"))
    return parser.parse_args()


if __name__ == "__main__":
    sys.exit(main())
