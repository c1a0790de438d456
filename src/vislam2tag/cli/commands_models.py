"""Commands that make and use a positioning model: ``train`` and ``locate``."""

from __future__ import annotations

import math
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from vislam2tag import api
from vislam2tag.cli.next_steps import next_step
from vislam2tag.cli.options import AsJson, Technology, key_of, parameters_of
from vislam2tag.cli.progress import interrupted_with, outputs_of_interrupted, session_bar
from vislam2tag.cli.records import argument, command, option
from vislam2tag.cli.tables import print_table
from vislam2tag.cli.terminal import answer, say, say_json, visible_console
from vislam2tag.common.errors import UsageError
from vislam2tag.common.visible_text import visible
from vislam2tag.positioning.settings import SequenceMethod

if TYPE_CHECKING:
    from vislam2tag.pipeline.positioning.train import HeldOutResult


@dataclass(frozen=True, kw_only=True)
class TrainOptions:
    """Arguments and options of ``vislam2tag train``."""

    dataset: Path = argument("Data set (see vislam2tag dataset).", metavar="DS")
    out: Path = option(..., "The model's file, such as building.v2t.", metavar="FILE")
    model: str | None = option(None, "Model to train; without it the best in cross-validation over walks.")
    budget_s: float = option(300.0, "How long trying models may take, where none is named, seconds.", least=0.0)
    set_: tuple[str, ...] = option((), "A model's parameter; repeatable.", "--set", metavar="PARAMETER=VALUE")
    split: str | None = option(None, "Train on the training part of this split only.")
    fold: str | None = option(None, "Which fold of the split, where it has several.")
    seed: int | None = option(None, "Another seed, another draw.", least=0)
    technology: Technology = "wifi"
    onnx: Path | None = option(None, "Write the model as ONNX, too (networks and cell-density).", metavar="FILE")
    update: Path | None = option(None, "Update this model by DS, a later survey of the building.", metavar="MODEL")
    json: AsJson = False


@command
def train_command(given: TrainOptions) -> None:
    """Train a positioning model on a data set, and save it as one file for `vislam2tag locate`.

    Learns from all labelled fingerprints, or with --split from the training part of a fold, and then says how well it
    does on the test part (`vislam2tag benchmark` compares models). Without --model several are tried by leaving walks
    out; a table says which is taken, and why. The file contains numbers and text only, a checksum, and what the model
    needs to know: access points, floors, how sure it is. docs/explanation/positioning.md explains each model.

    With --update a model that keeps its fingerprints (neighbours, local-kriging) learns DS, a later survey of a part or
    all of the building, besides: what it holds of access points that are gone or were moved, as `vislam2tag join` tells
    them, is left out.

    Models: {models}.

    Exit code: 0 trained, 2 wrong usage, no data set, nothing to learn from, or the model cannot be written, 130
    interrupted.

    \b
    Examples:
      vislam2tag train fingerprints --out building.v2t
      vislam2tag train fingerprints --model weighted-knn --out building.v2t
      vislam2tag train fingerprints --model weighted-knn --set k=3 \\
          --set distance=cosine --out building.v2t
      vislam2tag train fingerprints --model local-kriging --seed 1 \\
          --split device --fold Pixel --out no-pixel.v2t
      vislam2tag train fingerprints --model multi-cel --out building.v2t \\
          --onnx building.onnx
      vislam2tag train later --update building.v2t --out building-2.v2t
    """
    plan = api.TrainPlan(
        given.model,
        parameters_of(given.set_),
        given.split,
        given.fold,
        given.seed,
        given.technology,
        given.onnx,
        given.budget_s,
        given.update,
    )
    begun = time.monotonic()
    with outputs_of_interrupted(given.out, given.onnx), session_bar("training", share=True) as bar:
        trained = api.train(given.dataset, plan, given.out, bar.reach)
    seconds = time.monotonic() - begun
    answer(_record(trained, given.out), given.json, lambda: _print_train(trained, given.out, seconds))


def _record(trained: api.TrainedModel, out: Path) -> dict[str, Any]:
    """What was trained, as JSON has it."""
    return {
        "model": out,
        "name": trained.saved.name,
        "origin": trained.saved.origin,
        "access_points": len(trained.saved.model.access_points_),
        "storeys": trained.saved.model.storeys_,
        "findings": trained.findings,
        "remarks": trained.saved.model.remarks(),
        "tested": trained.tested,
        "tried": trained.trial.tried if trained.trial else (),
        "updated": None if trained.update is None else _changes(trained.update),
    }


def _print_train(trained: api.TrainedModel, out: Path, seconds: float) -> None:
    if trained.trial is not None:
        _print_trial(trained.trial)
    model, origin = trained.saved.model, trained.saved.origin
    floors = len(model.storeys_)
    say(
        f"{trained.saved.name}: learned {origin.scans} fingerprints of {origin.dataset} ({origin.part}), "
        f"{len(model.access_points_)} access points, {floors} floor{'' if floors == 1 else 's'}, in {seconds:.1f} s"
    )
    if trained.update is not None:
        changes = ", ".join(f"{what}: {count}" for what, count in _changes(trained.update).items())
        say(f"updated ({changes}; what was known of access points gone or moved is left out)")
    for finding in trained.findings:
        say(f"{finding.kind} {finding.count}: {finding.message}")
    for remark in model.remarks():
        say(remark)
    say("not tested: give --split" if trained.tested is None else _tested(trained.tested))
    if origin.bssid_key is not None:
        say(f"access points are hashed with key {origin.bssid_key}: scans to locate must be, too")
    say(f"model: {out}")
    next_step("train", model=out)


def _changes(update: api.ModelUpdate) -> dict[str, int]:
    """How many fingerprints joined, and how many access points changed."""
    return {"joined": update.added, "gone": len(update.gone), "moved": len(update.moved), "new": len(update.new)}


def _print_trial(trial: api.ModelTrial) -> None:
    rows = []
    for one in trial.tried:
        numbers = ("-", "-", "-")
        if math.isfinite(one.score_m):
            numbers = (f"{one.mean_m:.2f} m", f"{100 * one.floor_hit:.1f} %", f"{one.score_m:.2f} m")
        behind = "" if one.behind_m is None else f"{one.behind_m[0]:.2f} to {one.behind_m[1]:.2f} m"
        rows.append((one.name, one.why, *numbers, behind))
    heads = ("mean error", "right floor", "score", "95 %: behind by")
    title = "Cross-validation over walks (score: mean error + 15 m a wrong floor)"
    print_table(title, ("model", "why"), heads, rows)


def _tested(tested: HeldOutResult) -> str:
    result = tested.score
    if result.plane.mean_m is None or result.floor_hit is None:
        return f"tested on {result.scans} fingerprints: none hears an access point that was learned"
    said = (
        f"tested on {result.scans} fingerprints: mean error {result.plane.mean_m:.2f} m, median "
        f"{result.plane.median_m:.2f} m, right floor {100 * result.floor_hit:.1f} %, unknown "
        f"{100 * (1 - result.answered):.1f} %"
    )
    if result.inside_68 is None or result.inside_95 is None:
        return said
    return (
        f"{said}\ncalibration: circles of 68 % hold {100 * result.inside_68:.0f} % (median radius "
        f"{tested.radius_68_m:.1f} m), those of 95 % {100 * result.inside_95:.0f} % ({tested.radius_95_m:.1f} m)"
    )


LOOPBACK = "127.0.0.1"


@dataclass(frozen=True, kw_only=True)
class LocateOptions:
    """Arguments and options of ``vislam2tag locate``."""

    model: Path = argument("Model's file (see vislam2tag train).")
    scans: Path | None = argument("Scans: CSV, JSON lines, or a data set's folder.", None, metavar="[SCANS]")
    out: Path | None = option(None, "Where to write; standard output without it.", metavar="FILE")
    hash_bssid: Path | None = option(
        None, "Hash the scans' BSSIDs with this key, as the model's data set was.", metavar="KEYFILE"
    )
    sequence: SequenceMethod | None = option(None, "Let the scans of a walk help each other; with --track: smoother.")
    track: Path | None = option(None, "How the phone moved: CSV, or a folder that process wrote.", metavar="TRACK")
    serve: bool = option(False, "Answer over HTTP, on this computer alone, until Ctrl-C; without SCANS.")
    port: int = option(8780, "With --serve: port to listen on; 0: any.", least=0, most=65535)
    plans: Path | None = option(None, "With --serve: data set whose plans the page shows.", metavar="DS")
    json: AsJson = False


@command
def locate_command(given: LocateOptions) -> None:
    """Say where scans were taken, by a model that `vislam2tag train` saved.

    SCANS is CSV (scan_id, bssid, rssi_dbm; one reading a line, the readings of a scan together), JSON lines with the
    same names (.jsonl, .ndjson, .json), or a data set. The answer has a line for each scan: scan_id, status, building,
    floor, x, y, z, the radii that hold 68 % and 95 % of errors, and how probable the floor is; as JSON lines where FILE
    (or, without --out, SCANS) is named so, else CSV. A scan that hears none of the model's access points is `unknown`,
    never guessed; one that is `unlike` all that was learned has a place, but its radii cannot be relied on (neighbours,
    local-kriging and cell-density tell).

    Scans of one walk can help each other: `smoother` looks at the whole walk, `filter` back only, as a phone that walks
    must. Both need the columns session and time_ns (data sets have them). With --track the phone's own motion joins
    them: CSV (session, time_ns, x, y; metres, level, any origin and heading) or what `vislam2tag process` wrote. Scans
    that hear nothing known then get their place from their neighbours.

    With --serve it answers over HTTP on this computer alone, with a page that shows where you are on the plans of
    --plans; docs/how-to/locate.md tells the form.

    Lines that cannot be used are counted and left out. docs/how-to/locate.md describes both formats.

    Exit code: 0 at least one scan has a position, 1 none has, 2 wrong usage, no model, scans that cannot be read, or
    FILE cannot be written, 130 interrupted.

    \b
    Examples:
      vislam2tag locate building.v2t scans.csv --out positions.csv
      vislam2tag locate building.v2t scans.jsonl
      vislam2tag locate building.v2t fingerprints --out positions.jsonl
      vislam2tag locate building.v2t walks.csv --sequence filter \\
          --out positions.csv
      vislam2tag locate building.v2t walks.csv --track tracker.csv \\
          --out positions.csv
      vislam2tag locate building.v2t --serve --plans fingerprints
      vislam2tag locate hashed.v2t scans.csv --hash-bssid key.txt \\
          --out positions.csv
    """
    if given.serve:
        _serve(given)
        return
    if given.scans is None or given.plans is not None:
        raise UsageError("give SCANS, or --serve (with --plans)")
    from vislam2tag.positioning.scan_file import JSON_SUFFIXES

    key, out = key_of(given.hash_bssid), given.out
    if out is not None and out.resolve() in (given.model.resolve(), given.scans.resolve()):
        raise UsageError(f"--out {out}: would overwrite what it is made of; choose another name")
    if given.json and out is None:
        raise UsageError("--json: sums up; give --out, too: without it standard output holds the positions")
    as_json = (given.scans if out is None else out).suffix.lower() in JSON_SUFFIXES
    on_interrupt = outputs_of_interrupted(out) if out else interrupted_with("not all scans are located")
    with on_interrupt, _written(out) as write, visible_console(stderr=True).status("locating"):
        found = api.locate(given.model, given.scans, write, as_json=as_json, key=key, walks=_walks(given))
    result = asdict(found) | {"located": found.located, "judgement": found.judgement}
    answer(result, given.json, lambda: _print_locate(found, given), failed=not found.located)


def _walks(given: LocateOptions) -> api.WalkPlan | None:
    """How the scans of a walk help each other, if they do."""
    if given.sequence is None and given.track is None:
        return None
    track = None if given.track is None else api.Tracks(given.track)
    return api.WalkPlan(given.sequence or SequenceMethod.SMOOTHER, track)


def _after(found: api.LocatedScans) -> str:
    """Name what to go on with."""
    if found.located:
        return "locate"
    return "locate, other access points" if found.usable else "locate, nothing usable"


def _serve(given: LocateOptions) -> None:
    """Answer until Ctrl-C."""
    if any(one is not None for one in (given.scans, given.out, given.hash_bssid, given.sequence, given.track)):
        raise UsageError("--serve: goes with --port, --plans and --json alone; scans come over HTTP")
    # Only a server needs these; starting quickly matters to all other commands.
    from vislam2tag.common.addresses import listen
    from vislam2tag.common.serving import serve
    from vislam2tag.pipeline.positioning.serve import ServedAnswers, locate_app

    answers = ServedAnswers(api.load_model(given.model), given.plans)
    with listen(LOOPBACK, given.port) as opened:
        url = f"http://{LOOPBACK}:{opened.getsockname()[1]}/"
        if given.json:
            say_json({"url": url, "model": answers.model})
        else:
            say(f"{url}\nPOST {url}locate takes scans, {url}api tells how. Ctrl-C ends it.")
        serve(locate_app(answers), opened)


@contextmanager
def _written(out: Path | None) -> Iterator[Callable[[str], object]]:
    """Yield what takes text: standard output, or a file that is there when it is whole."""
    from vislam2tag.common.files.whole_output import file_to_write

    if out is None:
        write = sys.stdout.write
        yield (lambda text: write(visible(text))) if sys.stdout.isatty() else write
        return
    with file_to_write(out) as file:
        yield lambda text: file.write(text.encode())


def _print_locate(found: api.LocatedScans, given: LocateOptions) -> None:
    """Sum up: on standard error where standard output holds the positions."""
    err = given.out is None
    unknown = f"{found.unknown} unknown"
    if found.located:
        unknown += f" (they hear none of the model's {found.access_points} access points)"
    say(f"{found.scans} scans: {found.located} located, {unknown}", err=err)
    if not found.located:
        say(f"nothing could be located: {found.judgement.why}", err=err)
    if found.unlike:
        say(f"{found.unlike} of them are unlike all that was learned: their radii cannot be relied on", err=err)
    if found.in_walks:
        say(f"scans of walks that helped each other: {found.in_walks}, {found.tracked} of them on a track", err=err)
    for finding in found.findings:
        lines = ", ".join(map(str, finding.lines)) + (", ..." if finding.count > len(finding.lines) else "")
        say(f"{finding.kind}: {finding.count} (lines {lines}): {finding.message}", err=err)
    if found.advice is not None:
        say(found.advice, err=err)
    if given.out is not None:
        say(f"positions: {given.out}")
    next_step(_after(found), err=err, model=given.model)
