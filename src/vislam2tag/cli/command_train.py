"""``vislam2tag train``."""

from __future__ import annotations

import math
import time
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from vislam2tag.cli.next_steps import next_step
from vislam2tag.cli.options import AsJson, Technology, parameters_of
from vislam2tag.cli.progress import outputs_of_interrupted, session_bar
from vislam2tag.cli.records import argument, command, option
from vislam2tag.cli.tables import print_table
from vislam2tag.cli.terminal import answer, say

if TYPE_CHECKING:
    from vislam2tag.pipeline.positioning.train import HeldOutResult, TrainedModel
    from vislam2tag.positioning.model_choice import ModelTrial
    from vislam2tag.positioning.model_update import ModelUpdate


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
    from vislam2tag.pipeline.positioning.train import TrainPlan, train

    plan = TrainPlan(
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
        trained = train(given.dataset, plan, given.out, bar.reach)
    seconds = time.monotonic() - begun
    answer(_record(trained, given.out), given.json, lambda: _print(trained, given.out, seconds))


def _record(trained: TrainedModel, out: Path) -> dict[str, Any]:
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


def _print(trained: TrainedModel, out: Path, seconds: float) -> None:
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


def _changes(update: ModelUpdate) -> dict[str, int]:
    """How many fingerprints joined, and how many access points changed."""
    return {"joined": update.added, "gone": len(update.gone), "moved": len(update.moved), "new": len(update.new)}


def _print_trial(trial: ModelTrial) -> None:
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
