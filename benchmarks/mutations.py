"""How many changes of meaning in surveys and tables are reported: the campaign of docs/results/input-mutations.md.

    python benchmarks/mutations.py --list              the kinds, as rows of the page
    python benchmarks/mutations.py                     all kinds, three runs each, and 120 clean inputs
    python benchmarks/mutations.py --kinds "landmarks: cm" --runs 1

Each run changes the meaning of a clean input, but not its form, and runs the command that reads it. A run is
``reported`` if the expected finding or word is printed that the clean input does not print, ``harmless`` if the
result is that of the clean input, and ``missed`` otherwise. Runs can be interrupted and continue where they were:
``--work`` contains all inputs and, in ``results.jsonl``, the outcome of each run by commit of the program's code.
"""

from __future__ import annotations

import argparse
import hashlib
import json
import multiprocessing
import re
import shutil
import sys
import tempfile
from collections import Counter
from collections.abc import Callable, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import asdict, dataclass
from functools import partial
from itertools import groupby
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
sys.path[:0] = [str(ROOT), str(ROOT / "benchmarks")]

import numpy as np  # noqa: E402
import polars as pl  # noqa: E402
from mutation_changes import Case  # noqa: E402
from mutation_inputs import INPUTS, made, run  # noqa: E402
from mutation_kinds import KINDS, Kind  # noqa: E402
from tests.docs.figures import digest  # noqa: E402
from threadpoolctl import threadpool_limits  # noqa: E402

NAMED = {kind.name: kind for kind in KINDS}
CLEAN, PAGE = "clean", "input-mutations"
PARTS = ("_kinds", "_changes", "_inputs", "_results", "_tables")
CODE = (
    "src/vislam2tag",
    *(f"benchmarks/mutation{part}.py" for part in ("s", *PARTS)),
)
OUTCOMES = ("reported", "harmless", "missed")
FAULTS_OF_PHONES = frozenset({"stale_wifi_rows", "scan_throttling"})
"""Findings that are true in clean inputs, because simulated phones have these faults, too."""
CLEAN_PARTS = {
    "survey": 40,
    "storeys": 15,
    "phone": 15,
    "uji": 8,
    "comford": 6,
    "label": 8,
    "dates": 4,
    "attach": 8,
} | {
    "attach-wifi": 6,
    "scans": 6,
    "tape": 4,
    "station": 4,
}
"""Clean inputs of each kind."""
_FIRST_CLEAN = 500
"""Added to the first seed."""


@dataclass(frozen=True)
class Outcome:
    """How a run ended: one of :data:`OUTCOMES`; findings and errors that only the changed input has."""

    kind: str
    input: str
    seed: int
    code: str
    outcome: str
    said: tuple[str, ...]
    changed: str


def main() -> None:
    """Make the runs that are missing, and print the tables."""
    options = _options()
    if options.list:
        print_kinds()
        return
    code = hashlib.sha256("".join(digest(ROOT / part) for part in CODE).encode()).hexdigest()[:12]
    work = options.work.absolute()
    (work / "inputs").mkdir(parents=True, exist_ok=True)
    file = work / "results.jsonl"
    runs = [(NAMED[name].input, options.seeds + n, name) for name in options.kinds for n in range(options.runs)]
    if options.clean:
        first = options.seeds + _FIRST_CLEAN
        runs += [(name, first + n, CLEAN) for name, count in CLEAN_PARTS.items() for n in range(count)]
    done = {(each.input, each.seed, each.kind) for each in read(file, code)}
    left = [list(group) for _, group in groupby(sorted(set(runs) - done), key=lambda each: each[:2])]
    spawn = multiprocessing.get_context("spawn")
    pool = ProcessPoolExecutor(options.jobs, spawn)
    with pool, file.open("a", encoding="utf-8") as lines:
        for number, outcomes in enumerate(pool.map(partial(outcomes_of, work, code), left), 1):
            lines.writelines(json.dumps(asdict(one)) + "\n" for one in outcomes)
            lines.flush()
            print(f"{number} of {len(left)} inputs", file=sys.stderr, flush=True)
    print_tables([each for each in read(file, code) if (each.input, each.seed, each.kind) in set(runs)])


def read(file: Path, code: str) -> list[Outcome]:
    """Outcomes with this code; a last line that was cut off does not count."""
    lines = file.read_text(encoding="utf-8").splitlines(keepends=True) if file.is_file() else []
    found = [Outcome(**json.loads(line)) for line in lines if line.endswith("}\n")]
    return [each for each in found if each.code == code]


def outcomes_of(work: Path, code: str, runs: Sequence[tuple[str, int, str]]) -> list[Outcome]:
    """Make runs with the same input: once unchanged, then with each of the kinds."""
    name, seed, _ = runs[0]
    with tempfile.TemporaryDirectory() as folder, threadpool_limits(limits=1):
        base = made(work, name, seed)
        clean = answer(base, name, Path(folder) / CLEAN)
        found = []
        for _, _, kind in runs:
            if kind == CLEAN:
                found.append(Outcome(CLEAN, name, seed, code, *judged_clean(clean), ""))
                continue
            answered = answer(base, name, Path(folder) / "changed", partial(changed_by, NAMED[kind], seed))
            found.append(Outcome(kind, name, seed, code, *judged(NAMED[kind], clean, answered)))
        if all(kind == CLEAN for _, _, kind in runs):
            shutil.rmtree(base)
        return found


@dataclass(frozen=True)
class Answer:
    """What commands answered: the last exit code, findings and other lines, and the tables of the result."""

    code: int
    said: Counter[str]
    tables: tuple[pl.DataFrame | None, ...]


def answer(base: Path, name: str, folder: Path, change: Callable[[Path], None] = lambda _: None) -> Answer:
    """Copy an input to a new ``folder``, change it, and run the commands that read it."""
    shutil.rmtree(folder, ignore_errors=True)
    shutil.copytree(base, folder / "in")
    (folder / "out").mkdir()
    change(folder / "in")
    text = ""
    for command in INPUTS[name].commands:
        code, printed = run(command, base=folder / "in", out=folder / "out")
        text += printed.replace(str(folder), "")
        if code:
            break
    return Answer(code, items(text), tuple(table.read(folder / "out") for table in INPUTS[name].tables))


def changed_by(kind: Kind, seed: int, folder: Path) -> None:
    """Apply a change of a kind."""
    kind.change(Case(folder, np.random.default_rng([seed, *kind.name.encode()])))


_STATEMENT = re.compile(r"(its clock is|next:|report:|written:|The expected mean|\w+: \d+ rows)")


def items(text: str) -> Counter[str]:
    """Findings and other lines of an output, without those that only state results."""
    found: Counter[str] = Counter()
    for line in text.splitlines():
        if line.startswith("findings: "):
            for part in line.removeprefix("findings: ").split(", "):
                kind, _, count = part.rpartition(" ")
                found[kind] += int(count)
        elif line.strip() and not _STATEMENT.match(line.strip()):
            found[" ".join(line.split())] += 1
    return found


def judged(kind: Kind, clean: Answer, changed: Answer) -> tuple[str, tuple[str, ...], str]:
    """Outcome of a run; new findings and lines; and what changed."""
    new = tuple(sorted(changed.said - clean.said))
    pairs = zip(INPUTS[kind.input].tables, clean.tables, changed.tables, strict=True)
    differences = "; ".join(filter(None, (table.difference(*pair) for table, *pair in pairs)))
    if any(re.search(word, line) for word in kind.expected for line in new):
        return "reported", new, differences
    same = not differences and changed.code == clean.code
    return "harmless" if same else "missed", new, differences or ("" if same else f"exit code {changed.code}")


def judged_clean(clean: Answer) -> tuple[str, tuple[str, ...]]:
    """Whether a clean input raises a finding of any kind: ``reported``, and these findings."""
    kinds = {word for kind in KINDS for word in kind.expected if word.isidentifier() and "_" in word} - FAULTS_OF_PHONES
    raised = tuple(sorted(line for line in clean.said if any(re.match(rf"{kind}\b", line) for kind in kinds)))
    raised += tuple(f"exit code {clean.code}: {line}" for line in clean.said if clean.code)
    return "reported" if raised else "harmless", raised


def print_kinds() -> None:
    """Print the rows of the page's table of kinds."""
    for kind in KINDS:
        names = [word for word in kind.expected if word.isidentifier() and "_" in word]
        found = ", ".join(f"`{name}`" for name in names) or ("its message" if kind.expected else "harmless")
        place = f"{{{PAGE}: kinds / {kind.name} / "
        figures = " | ".join(f"{place}{column}}}" for column in ("runs", *OUTCOMES))
        print(f"| {kind.name} | {kind.what} | {kind.undetectable or found} | {figures} |")


def print_tables(outcomes: Sequence[Outcome]) -> None:
    """Print runs by kind, sums, all misses, and the share of clean inputs that raise a finding."""
    by_kind = {kind: [each for each in outcomes if each.kind == kind.name] for kind in KINDS}
    detectable = [each for kind, runs in by_kind.items() if not kind.undetectable for each in runs]
    hidden = [each for kind, runs in by_kind.items() if kind.undetectable for each in runs]
    clean = [each for each in outcomes if each.kind == CLEAN]
    print("# kinds\n\n| kind | runs | reported | harmless | missed |\n| --- | --- | --- | --- | --- |")
    for kind, runs in by_kind.items():
        if runs:
            print(f"| {kind.name} | {_row(runs)} |")
    print("\n# all\n\n| runs | all | reported | harmless | missed | not missed, % |\n" + "| --- " * 6 + "|")
    for name, runs in (("detectable", detectable), ("undetectable", hidden)):
        share = 100 * sum(each.outcome != "missed" for each in runs) / max(len(runs), 1)
        print(f"| {name} | {_row(runs)} | {share:.1f} |")
    raised = sum(each.outcome == "reported" for each in clean)
    print(f"\n# clean\n\n| inputs | all | raised | share, % |\n{'| --- ' * 4}|")
    print(f"| clean | {len(clean)} | {raised} | {100 * raised / max(len(clean), 1):.1f} |")
    for each in outcomes:
        if each.outcome == ("reported" if each.kind == CLEAN else "missed"):
            said = "; ".join(each.said) or "nothing was printed"
            print(f"{each.kind} ({each.input}-{each.seed}): {each.changed}. {said}", file=sys.stderr)


def _row(runs: Sequence[Outcome]) -> str:
    return " | ".join(str(n) for n in (len(runs), *(sum(each.outcome == o for each in runs) for o in OUTCOMES)))


def _options() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--work", type=Path, default=Path("mutations-work"), help="folder of inputs and results")
    parser.add_argument("--list", action="store_true", help="print the rows of the page, and end")
    parser.add_argument("--kinds", nargs="+", choices=NAMED, default=list(NAMED), metavar="NAME", help="default: all")
    parser.add_argument("--runs", type=int, default=3, help="of each kind, each with another input")
    parser.add_argument("--seeds", type=int, default=100, help="the first")
    parser.add_argument("--clean", action=argparse.BooleanOptionalAction, default=True, help="also run clean inputs")
    parser.add_argument("--jobs", type=int, default=2)
    return parser.parse_args()


if __name__ == "__main__":
    main()
