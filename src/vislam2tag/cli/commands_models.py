"""Commands that train and use a positioning model: ``train`` and ``locate``."""

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
from vislam2tag.common.findings import counted
from vislam2tag.common.visible_text import visible
from vislam2tag.positioning.settings import SequenceMethod

if TYPE_CHECKING:
    from vislam2tag.pipeline.positioning.train import HeldOutResult


@dataclass(frozen=True, kw_only=True)
class TrainOptions:
    """Arguments and options of ``vislam2tag train``."""

    dataset: Path = argument("Data set (see vislam2tag dataset).", metavar="DS")
    out: Path = option(..., "Model file to write, such as building.v2t.", metavar="FILE")
    model: str | None = option(None, "Model to train.  [default: the best in cross-validation over walks]")
    budget_s: float = option(300.0, "Time limit for comparing models without --model, seconds.", least=0.0)
    set_: tuple[str, ...] = option((), "Parameter of the model; repeatable.", "--set", metavar="PARAMETER=VALUE")
    split: str | None = option(None, "Train on the training part of this split only.")
    fold: str | None = option(None, "Fold of the split, if it has several.")
    seed: int | None = option(None, "Seed of random numbers.", least=0)
    technology: Technology = None
    onnx: Path | None = option(None, "Also write the model as ONNX (networks and cell-density).", metavar="FILE")
    update: Path | None = option(None, "Model to update with DS, a later survey of the building.", metavar="MODEL")
    json: AsJson = False


@command
def train_command(given: TrainOptions) -> None:
    """Train a positioning model on a data set and save it as one file for `vislam2tag locate`.

    Uses all labelled fingerprints. With --split it uses the training part of a fold and reports the error on the test
    part. Without --model it compares several models by leaving walks out, and prints why it chose one. The file
    contains only numbers and text: parameters, access points, floors, error radii and a checksum.
    docs/explanation/positioning.md explains the models.

    With --update, a model that keeps its fingerprints (weighted-knn, local-kriging) also learns DS, a later survey of
    the building. Data of access points that are gone or moved since then are removed.

    Models: {models}.

    Exit code: 0 trained, 2 wrong usage, no data set, or no labelled fingerprints, 130 interrupted.

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
    """The result of training for JSON."""
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
        f"{len(model.access_points_)} access points, {floors} floor{'' if floors == 1 else 's'}, {origin.technology}, "
        f"in {seconds:.1f} s"
    )
    for storey in model.storeys_:
        if names := ", ".join(filter(None, (storey.building, origin.floor_name(storey)))):
            say(f"floor {storey.floor}: {names}")
    if trained.update is not None:
        changes = ", ".join(f"{what}: {count}" for what, count in _changes(trained.update).items())
        say(f"updated ({changes}; data of access points that are gone or moved were removed)")
    for finding in trained.findings:
        say(f"{finding.kind} {finding.count}: {finding.message}")
    for remark in model.remarks():
        say(remark)
    say("not tested; pass --split to test the model" if trained.tested is None else _tested(trained.tested))
    if origin.bssid_key is not None:
        say(f"access points are hashed with key {origin.bssid_key}; hash scans to locate with it too")
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
    heads = ("mean error", "right floor", "score", "worse by (95 %)")
    title = "Cross-validation over walks (score: mean error + 15 m for a wrong floor)"
    print_table(title, ("model", "result"), heads, rows)


def _tested(tested: HeldOutResult) -> str:
    result = tested.score
    if result.plane.mean_m is None or result.floor_hit is None:
        return f"tested on {result.scans} fingerprints: none contains a known access point"
    said = (
        f"tested on {result.scans} fingerprints: mean error {result.plane.mean_m:.2f} m, median "
        f"{result.plane.median_m:.2f} m, right floor {100 * result.floor_hit:.1f} %, unknown "
        f"{100 * (1 - result.answered):.1f} %"
    )
    if result.inside_68 is None or result.inside_95 is None:
        return said
    return (
        f"{said}\ncalibration: 68 % circles contain {100 * result.inside_68:.0f} % (median radius "
        f"{tested.radius_68_m:.1f} m), 95 % circles {100 * result.inside_95:.0f} % ({tested.radius_95_m:.1f} m)"
    )


LOOPBACK = "127.0.0.1"


@dataclass(frozen=True, kw_only=True)
class LocateOptions:
    """Arguments and options of ``vislam2tag locate``."""

    model: Path = argument("Model file (see vislam2tag train).")
    scans: Path | None = argument("Scans: CSV, JSON lines, a data set or a recording.", None, metavar="[SCANS]")
    out: Path | None = option(None, "Output file.  [default: standard output]", metavar="FILE")
    hash_bssid: Path | None = option(
        None, "Key to hash the BSSIDs of the scans, if the data set of the model was hashed.", metavar="KEYFILE"
    )
    sequence: SequenceMethod | None = option(
        None, "Use the scans of a walk together.  [default with --track: smoother]"
    )
    track: Path | None = option(None, "Motion of the phone: CSV, or the output of process.", metavar="TRACK")
    serve: bool = option(False, "Answer over HTTP on this computer until Ctrl-C, without SCANS.")
    port: int = option(8780, "With --serve: port to listen on; 0 for any free port.", least=0, most=65535)
    plans: Path | None = option(None, "With --serve: data set with the plans for the page.", metavar="DS")
    json: AsJson = False


@command
def locate_command(given: LocateOptions) -> None:
    """Estimate where scans were taken, with a model from `vislam2tag train`.

    SCANS is a CSV file (scan_id, bssid, rssi_dbm; one reading per line, the readings of a scan together), JSON lines
    with the same names (.jsonl, .ndjson, .json), or a data set. It can also be a recording: a session folder, or a
    Wi-Fi table of an app with times, addresses and levels. The poses of a session are used as with --track.

    Each scan gets a line with scan_id, status, building, floor, floor_name, room, x, y, z, the radii that contain 68 %
    and 95 % of the errors, and the probability of the floor. The suffix of FILE (or of SCANS, without --out) decides
    between CSV and JSON lines. A scan without any known access point is `unknown`. A scan that is `unlike` all training
    data has a position, but its radii are not reliable. Unusable lines are counted and skipped.

    Scans of a walk can be used together. `smoother` uses the whole walk, `filter` only the past, as during a walk. Both
    need the columns session and time_ns. With --track the motion of the phone is used too: a CSV (session, time_ns, x,
    y in metres, any origin and heading) or the output of `process`. Scans without a known access point then get a
    position.

    With --serve it answers over HTTP on this computer, with a page that shows your position on the plans of --plans.
    See docs/how-to/locate.md for all formats.

    Exit code: 0 at least one scan has a position, 2 wrong usage, no model, or unreadable scans, 3 none has, 130
    interrupted.

    \b
    Examples:
      vislam2tag locate building.v2t scans.csv --out positions.csv
      vislam2tag locate building.v2t scans.jsonl
      vislam2tag locate building.v2t fingerprints --out positions.jsonl
      vislam2tag locate building.v2t survey/floor_0/Pixel/2022-03-01T10:00:00
      vislam2tag locate building.v2t wifi.csv --out positions.csv
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
    if given.scans is None:
        raise UsageError("pass SCANS, or --serve")
    if given.plans is not None:
        raise UsageError("--plans only works with --serve; remove it")
    from vislam2tag.positioning.scan_file import JSON_SUFFIXES

    key, out = key_of(given.hash_bssid), given.out
    if out is not None and out.resolve() in (given.model.resolve(), given.scans.resolve()):
        raise UsageError(f"--out {out}: would overwrite an input; choose another name")
    if out is not None and out.suffix.lower() in (".xlsx", ".parquet", ".pq"):
        raise UsageError(f"--out {out}: positions are written as CSV or JSON lines; use a name such as positions.csv")
    if given.json and out is None:
        raise UsageError("--json prints a summary, so also pass --out for the positions")
    as_json = (given.scans if out is None else out).suffix.lower() in JSON_SUFFIXES
    on_interrupt = outputs_of_interrupted(out) if out else interrupted_with("some scans were not located")
    with on_interrupt, _written(out) as write, visible_console(stderr=True).status("locating"):
        found = api.locate(given.model, given.scans, write, as_json=as_json, key=key, walks=_walks(given))
    result = asdict(found) | {"located": found.located, "judgement": found.judgement}
    answer(result, given.json, lambda: _print_locate(found, given), nothing=not found.located)


def _walks(given: LocateOptions) -> api.WalkPlan | None:
    """How scans of a walk are used together, or None."""
    if given.sequence is None and given.track is None:
        return None
    track = None if given.track is None else api.Tracks(given.track)
    return api.WalkPlan(given.sequence or SequenceMethod.SMOOTHER, track)


def _serve(given: LocateOptions) -> None:
    """Answer until Ctrl-C."""
    if any(one is not None for one in (given.scans, given.out, given.hash_bssid, given.sequence, given.track)):
        raise UsageError("--serve: only combine it with --port, --plans and --json, because scans arrive over HTTP")
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
            say(f"{url}\nPOST scans to {url}locate; {url}api describes the format. Press Ctrl-C to stop.")
        serve(locate_app(answers), opened)


@contextmanager
def _written(out: Path | None) -> Iterator[Callable[[str], object]]:
    """Yield a function that writes text to standard output, or to a file that appears when complete."""
    from vislam2tag.common.files.whole_output import file_to_write

    if out is None:
        write = sys.stdout.write
        yield (lambda text: write(visible(text))) if sys.stdout.isatty() else write
        return
    with file_to_write(out) as file:
        yield lambda text: file.write(text.encode())


def _print_locate(found: api.LocatedScans, given: LocateOptions) -> None:
    """Print a summary, on standard error if the positions are on standard output."""
    err = given.out is None
    unknown = f"{found.unknown} unknown"
    if found.located and found.unknown:
        unknown += f" (without any of the model's {found.access_points} access points)"
    say(f"{counted(found.scans, 'scan')}: {found.located} located, {unknown}", err=err)
    if not found.located:
        say(f"nothing could be located: {found.judgement.why}", err=err)
    if found.unlike:
        say(f"{found.unlike} of them are unlike all training data, so their radii are not reliable", err=err)
    _print_missing(found, err=err)
    if found.in_walks:
        say(
            f"scans used together with others of their walk: {found.in_walks}, {found.tracked} of them with a track",
            err=err,
        )
    _print_findings(found, err=err)
    if found.advice is not None:
        say(found.advice, err=err)
    if given.out is not None:
        say(f"positions: {given.out}")
    if found.located:
        next_step("locate", err=err)
    elif found.usable:
        say(f"use a model of the building of the scans; {given.model} knows other access points", err=err)
    else:
        say("correct the lines above; expected columns: scan_id, bssid, rssi_dbm (negative dBm)", err=err)


def _print_missing(found: api.LocatedScans, *, err: bool) -> None:
    from vislam2tag.pipeline.positioning.locate import missing_notes

    for note in missing_notes(found.without_wifi, found.without_ble):
        say(note, err=err)


def _print_findings(found: api.LocatedScans, *, err: bool) -> None:
    for finding in found.findings:
        lines = ", ".join(map(str, finding.lines)) + (", ..." if finding.count > len(finding.lines) else "")
        where = f" (lines {lines})" if finding.lines else ""
        say(f"{finding.kind}: {finding.count}{where}: {finding.message}", err=err)
