"""A fuzz campaign: damaged files of every kind for every reader and command.

No traceback, no crash, no hang beyond 60 s of processor time, no more than 2 GB, exit codes as documented, nothing left
over or changed that is not the command's to write. Everything is imported once; each run of a command is a process
forked from that, one in a hundred a process of its own. It can be ended at any time and goes on where it was:
OUT/progress.json holds, by commit and target, how many runs there were and how many failed. What fails lies in
OUT/failures, with the damaged folder and what was said.

    python benchmarks/fuzz_campaign.py                            100,000 runs, spread over all targets
    python benchmarks/fuzz_campaign.py --commands --runs 10000    commands only
    python benchmarks/fuzz_campaign.py --runs 500 --target site --target "import uji"
    python benchmarks/fuzz_campaign.py --ci                       as CI: 40 runs a reader
    python benchmarks/fuzz_campaign.py --again "site" 17          one run again, with its output
"""

from __future__ import annotations

import argparse
import gc
import importlib
import io
import json
import os
import pkgutil
import resource
import shutil
import signal
import subprocess
import sys
import tempfile
import time
import traceback
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import partial
from importlib import resources
from pathlib import Path
from typing import NoReturn

ROOT = Path(__file__).resolve().parents[1]
sys.path[:0] = [str(ROOT), str(ROOT / "benchmarks")]

import numpy as np  # noqa: E402
from fuzz_bases import HANG_S, READERS_ATTACKED, Run, Target, apart, make_bases  # noqa: E402
from fuzz_commands import commands  # noqa: E402
from fuzz_mutations import damage, remove  # noqa: E402

import vislam2tag  # noqa: E402
from vislam2tag.common.errors import Vislam2tagError  # noqa: E402
from vislam2tag.common.files.own_files import OWN_FILES  # noqa: E402
from vislam2tag.datasets.table_columns import DRAFT_BELOW  # noqa: E402
from vislam2tag.labeling.settings import ProcessSettings  # noqa: E402
from vislam2tag.pipeline.labels.session import code_of  # noqa: E402
from vislam2tag.studio.receiving.uploads import WORK_FOLDER  # noqa: E402
from vislam2tag.views import page  # noqa: E402

TARGETS = (*READERS_ATTACKED, *commands())
RUNS = 100_000
RUNS_IN_CI = 40
"""Of each reader."""
MOST_MB = 2000
_LIMIT_BYTES = 8 << 30
"""Of a run's own memory, so that one that takes too much fails, not the machine."""
_FAULT = 4
_WORDS = ("Traceback (most recent", "unexpected ", "please report", "panicked at", "Segmentation fault")
"""What no output holds, whatever the input."""
READERS_MORE = 20
"""A reader has so many times the runs of a command: it takes so much less time."""


@dataclass(frozen=True)
class Outcome:
    """How a run ended: nothing wrong, or what."""

    fault: str
    output: str
    seconds: float
    megabytes: float


def main() -> int:
    """Run the campaign; returns 1 where anything failed."""
    options = _options()
    options.out = options.out.absolute()
    options.out.mkdir(parents=True, exist_ok=True)
    _import_everything()
    make_bases(options.out / "bases", for_commands=not options.ci)
    if options.again:
        name, number = options.again
        target = next(each for each in TARGETS if each.name == name)
        (outcome,) = attack(target, range(int(number), int(number) + 1), options.out)
        print(outcome.output, outcome, sep="\n")
        return bool(outcome.fault)
    chosen = [each for each in TARGETS if (not options.target or each.name in options.target)]
    chosen = [each for each in chosen if not (options.commands and each.reader)]
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
    """So that no run has to: each is in a process forked from this one. What the program keeps once made is made."""
    for module in pkgutil.walk_packages(vislam2tag.__path__, "vislam2tag."):
        if not module.name.endswith("__main__"):
            importlib.import_module(module.name)
    for format_name in ("published", "phone", "ilc20"):
        code_of(format_name, ProcessSettings())
    page._packed_plotly()
    for template in (resources.files("vislam2tag.views") / "templates").iterdir():
        if template.name.endswith(".j2"):
            page._environment().get_template(template.name)
    gc.collect()
    gc.freeze()  # else each run's first collections copy all of it


def attack(target: Target, numbers: range, out: Path) -> Iterator[Outcome]:
    """Make runs: the same number damages in the same way. Where one fails, what it was made of goes to ``failures``."""
    with tempfile.TemporaryDirectory() as folder:
        scratch, notes = Path(folder, "run"), Path(folder, "notes")
        scratch.mkdir()
        notes.mkdir()
        works = [partial(_damage_and_work, target, number, (out / "bases").resolve(), scratch) for number in numbers]
        for number, outcome in zip(numbers, run_apart(works, target.codes, notes), strict=True):
            if outcome.fault:
                apart(partial(_keep, target, number, outcome, out))
            yield outcome


def _keep(target: Target, number: int, outcome: Outcome, out: Path) -> None:
    kept = out / "failures" / f"{target.name.replace(' ', '-')}-{number}"
    shutil.rmtree(kept, ignore_errors=True)
    kept.mkdir(parents=True)
    _damaged(target, _rng(target, number), out / "bases", kept)
    (kept / "what.txt").write_text(f"{outcome.fault}\n{outcome.output}")


def _rng(target: Target, number: int) -> np.random.Generator:
    return np.random.default_rng([number, *target.name.encode()])


def _damage_and_work(target: Target, number: int, bases: Path, scratch: Path) -> None:
    """In the child: Polars must not be used before it is forked."""
    rng = _rng(target, number)
    out, temporary, elsewhere = (scratch / name for name in ("out", "temporary", "elsewhere"))
    for folder in (out, temporary, elsewhere):
        shutil.rmtree(folder, ignore_errors=True)
        folder.mkdir()
    os.chdir(elsewhere)  # where an odd option that names a file may write it
    tempfile.tempdir = str(temporary)
    folder, what = _damaged(target, rng, bases, scratch)
    print(what, flush=True)
    before = _state(folder)
    try:
        target.work(Run(folder, bases, out, rng))
    finally:
        if target in COMMANDS:
            _judge(target, folder, before, out, temporary)


COMMANDS = frozenset(each for each in TARGETS if not each.reader)


def _judge(target: Target, folder: Path, before: dict[str, tuple[int, int]], out: Path, temporary: Path) -> None:
    """Say what a command left over, or changed of what it was given."""
    after = _state(folder)
    new = (*out.rglob(".*"), *temporary.iterdir(), *map(Path, after.keys() - before.keys()))
    hidden = {path.name for path in new if path.parent == temporary or path.name.startswith(".")}
    hidden -= {WORK_FOLDER, OWN_FILES}
    if hidden:
        print("unexpected left-over:", *map(ascii, sorted(hidden)))
    if after != before and not target.writes_base:
        print("unexpected change of what it was given:", *map(ascii, sorted(after.items() ^ before.items())))
    if not Path(os.devnull).is_char_device():
        print("unexpected change of a device of the system")


def _state(folder: Path) -> dict[str, tuple[int, int]]:
    """Size and time of change of everything below a folder."""
    return {str(path): (path.lstat().st_size, path.lstat().st_mtime_ns) for path in folder.rglob("*")}


def _damaged(target: Target, rng: np.random.Generator, bases: Path, scratch: Path) -> tuple[Path, str]:
    """Damage a copy of the target's base, below ``scratch``; one that an earlier run damaged is mended first.

    Returns the copy, and in which ways it was damaged.
    """
    folder, base = scratch / "damaged", bases / target.base
    changed = scratch / "changed.txt"
    if target.writes_base:
        shutil.rmtree(folder, ignore_errors=True)
    if not folder.exists():
        shutil.copytree(base, folder)
    for name in changed.read_text().splitlines() if changed.exists() else ():
        remove(folder / name)
        shutil.copy(base / name, folder / name)
    files = sorted({path for pattern in target.files for path in base.glob(pattern) if path.is_file()})
    count = min(len(files), int(rng.choice([1, 1, 1, 2, 3])))
    names = [files[index].relative_to(base) for index in rng.choice(len(files), size=count, replace=False)]
    changed.write_text("\n".join(map(str, names)))
    return folder, "\n".join(f"{name}: {damage(folder / name, rng)}" for name in names)


def _run(target: Target, numbers: range, out: Path) -> int:
    """Make runs, report failures, and note how far it got; returns how many failed."""
    failed = 0
    for number, outcome in zip(numbers, attack(target, numbers, out), strict=True):
        if outcome.fault:
            print(f"{target.name} {number}: {outcome.fault}", flush=True)
            failed += 1
    tally = _tally(out)
    runs, faults = tally.setdefault(COMMIT, {}).get(target.name, (0, 0))
    tally[COMMIT][target.name] = (runs + len(numbers), faults + failed)
    partial_file = out / "progress.json.part"
    partial_file.write_text(json.dumps(tally, indent=1, sort_keys=True))
    partial_file.replace(out / "progress.json")
    return failed


COMMIT = subprocess.run(
    ["git", "-C", str(ROOT), "describe", "--always", "--dirty"], capture_output=True, text=True, check=False
).stdout.strip()


def _tally(out: Path) -> dict[str, dict[str, tuple[int, int]]]:
    """Runs and failures by commit and target."""
    try:
        found: dict[str, dict[str, tuple[int, int]]] = json.loads((out / "progress.json").read_text())
    except FileNotFoundError:
        return {}
    return found


def _done(out: Path) -> dict[str, int]:
    """Runs by target."""
    done: dict[str, int] = {}
    for by_target in _tally(out).values():
        for name, (runs, _) in by_target.items():
            done[name] = done.get(name, 0) + runs
    return done


def _plan(targets: Sequence[Target], runs: int, done: dict[str, int]) -> Iterator[tuple[Target, range]]:
    """Which runs are left, a few of each target in turn, so that an early end has tried all."""
    at_once = {each.name: READERS_MORE if each.reader else 1 for each in targets}
    rounds = round(runs / sum(at_once[each.name] / each.every for each in targets))
    for turn in range(1, rounds + 1):
        for target in targets:
            first, last = done.get(target.name, 0), turn // target.every * at_once[target.name]
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
    parser.add_argument("--commands", action="store_true", help="no readers")
    parser.add_argument("--ci", action="store_true", help="readers only, from the first run on")
    parser.add_argument("--again", nargs=2, metavar=("TARGET", "NUMBER"))
    return parser.parse_args()


def run_apart(works: Sequence[Callable[[], object]], codes: Sequence[int], scratch: Path) -> Iterator[Outcome]:
    """Run one after the other in a forked process, in a further one after each that ends it or takes too much memory.

    ``codes`` are the exit codes that a run may end with by itself; ``scratch`` is an empty folder. The calling process
    must not use Polars, whose threads a fork does not take along.
    """
    notes = scratch / "ended.jsonl"
    done = 0
    while done < len(works):
        child = os.fork()
        if not child:
            _run_all(works, done, scratch)
        status = os.waitpid(child, 0)[1]
        lines = notes.read_text().splitlines() if notes.exists() else []
        for number in range(done, len(lines)):
            code, seconds, megabytes = json.loads(lines[number])
            said = _said(scratch, number)
            yield Outcome(_fault(code, codes, said, megabytes), said, seconds, megabytes)
        done = len(lines)
        if os.WIFSIGNALED(status):
            number = signal.Signals(os.WTERMSIG(status))
            hangs = number in (signal.SIGPROF, signal.SIGKILL, signal.SIGALRM)
            yield Outcome("hangs" if hangs else f"ends by {number.name}", _said(scratch, done), 0.0, 0.0)
            with notes.open("a") as file:
                file.write("[0, 0, 0]\n")
            done += 1


def _run_all(works: Sequence[Callable[[], object]], first: int, scratch: Path) -> NoReturn:
    """In the child: run what is left, and note how each ended."""
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    resource.setrlimit(resource.RLIMIT_DATA, (_LIMIT_BYTES, _LIMIT_BYTES))
    for stream in (1, 2):
        os.dup2(os.open(os.devnull, os.O_WRONLY), stream)
    for number in range(first, len(works)):
        begun = time.process_time()
        signal.setitimer(signal.ITIMER_PROF, HANG_S)
        signal.alarm(10 * HANG_S)
        code = _code_of(works[number], scratch / f"{number}.txt")
        used = (
            resource.getrusage(resource.RUSAGE_SELF).ru_maxrss,
            resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss,
        )
        megabytes = max(used) / 1000
        with (scratch / "ended.jsonl").open("a") as file:
            file.write(json.dumps([code, time.process_time() - begun, megabytes]) + "\n")
        if megabytes > MOST_MB:
            break
    os._exit(0)


def _code_of(work: Callable[[], object], output: Path) -> int:
    """Do the work with all that it prints in a file, and return the code that a command would end with."""
    handle = os.open(output, os.O_WRONLY | os.O_CREAT | os.O_TRUNC)
    for stream in (1, 2):
        os.dup2(handle, stream)
    os.close(handle)
    sys.stdout, sys.stderr = (io.TextIOWrapper(os.fdopen(stream, "wb", closefd=False)) for stream in (1, 2))
    try:
        work()
        code = 0
    except SystemExit as ended:
        code = ended.code if isinstance(ended.code, int) else 0
    except Vislam2tagError as error:
        message, *_ = str(error).split(DRAFT_BELOW)
        code = _FAULT if "\n" in message else 0
        print(error)
    except OSError:
        code = 0
    except BaseException:
        traceback.print_exc()
        code = _FAULT
    sys.stdout.flush()
    sys.stderr.flush()
    return code


def _said(scratch: Path, number: int) -> str:
    output = scratch / f"{number}.txt"
    return output.read_text(encoding="utf-8", errors="replace") if output.exists() else ""


def _fault(code: int, codes: Sequence[int], text: str, megabytes: float) -> str:
    if found := next((words for words in _WORDS if words in text), None):
        return f"says '{found.strip()}'"
    if code not in codes:
        return f"ends with {code}"
    if code == 2 and "rror" not in text:
        return "ends with 2 without a message"
    if megabytes > MOST_MB:
        return f"takes {megabytes:.0f} MB"
    return ""


if __name__ == "__main__":
    sys.exit(main())
