"""``vislam2tag train``."""

from __future__ import annotations

import math
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from vislam2tag.cli.next_steps import next_step
from vislam2tag.cli.options import AsJson, parameters_of
from vislam2tag.cli.progress import outputs_of_interrupted
from vislam2tag.cli.tables import table, table_console
from vislam2tag.cli.terminal import say, say_json, visible_console
from vislam2tag.common.plugins import MODELS

if TYPE_CHECKING:
    from vislam2tag.common.progress import Progress
    from vislam2tag.pipeline.positioning.train import HeldOutResult, TrainedModel
    from vislam2tag.positioning.model_choice import ModelTrial
    from vislam2tag.positioning.model_update import ModelUpdate


HELP = f"""
Train a positioning model on a data set, and save it as one file for `vislam2tag locate`.

Learns from all labelled fingerprints, or with --split from the training part of a fold, and then says how well it does
on the test part (`vislam2tag benchmark` compares models). Without --model several are tried by leaving walks out;
a table says which is taken, and why. The file contains numbers and text only, a checksum, and what the model needs to
know: access points, floors, how sure it is. docs/explanation/positioning.md explains each model.

With --update a model that keeps its fingerprints (neighbours, local-kriging) learns DS, a later survey of a part or all
of the building, besides: what it holds of access points that are gone or were moved, as `vislam2tag join` tells them,
is left out.

Models: {", ".join(MODELS.names())}.

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


def register(app: typer.Typer) -> None:
    """Add the command to the application."""
    app.command("train", help=HELP)(_train)


def _train(
    dataset: Annotated[Path, typer.Argument(metavar="DS", help="Data set (see vislam2tag dataset).")],
    *,
    out: Annotated[Path, typer.Option(metavar="FILE", help="The model's file, such as building.v2t.")],
    model: Annotated[
        str | None, typer.Option(help="Model to train; without it the best in cross-validation over walks.")
    ] = None,
    budget_s: Annotated[
        float, typer.Option(min=0.0, help="How long trying models may take, where none is named, seconds.")
    ] = 300.0,
    set_: Annotated[
        list[str] | None, typer.Option("--set", metavar="PARAMETER=VALUE", help="A model's parameter; repeatable.")
    ] = None,
    split: Annotated[str | None, typer.Option(help="Train on the training part of this split only.")] = None,
    fold: Annotated[str | None, typer.Option(help="Which fold of the split, where it has several.")] = None,
    seed: Annotated[int | None, typer.Option(min=0, help="Another seed, another draw.")] = None,
    technology: Annotated[str, typer.Option(help="Fingerprints of which radio.")] = "wifi",
    onnx: Annotated[
        Path | None, typer.Option(metavar="FILE", help="Write the model as ONNX, too (networks and cell-density).")
    ] = None,
    update: Annotated[
        Path | None, typer.Option(metavar="MODEL", help="Update this model by DS, a later survey of the building.")
    ] = None,
    json: AsJson = False,
) -> None:
    from vislam2tag.pipeline.positioning.train import TrainPlan, train

    plan = TrainPlan(model, parameters_of(set_ or ()), split, fold, seed, technology, onnx, budget_s, update)
    begun = time.monotonic()
    with outputs_of_interrupted(out, onnx), _bar() as progress:
        trained = train(dataset, plan, out, progress)
    if json:
        say_json(
            {
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
        )
        return
    _print(trained, time.monotonic() - begun)
    say(f"model: {out}")
    next_step("train", model=out)


@contextmanager
def _bar() -> Iterator[Progress[float]]:
    from rich.progress import BarColumn, Progress, TaskProgressColumn, TextColumn, TimeElapsedColumn

    console = visible_console(stderr=True)
    columns = (TextColumn("training"), BarColumn(), TaskProgressColumn(), TimeElapsedColumn())
    with Progress(*columns, console=console, transient=True, disable=not console.is_terminal) as bar:
        task = bar.add_task("", total=None)
        yield lambda done, total: bar.update(task, total=total, completed=done)


def _print(trained: TrainedModel, seconds: float) -> None:
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


def _changes(update: ModelUpdate) -> dict[str, int]:
    """How many fingerprints joined, and how many access points changed."""
    return {"joined": update.added, "gone": len(update.gone), "moved": len(update.moved), "new": len(update.new)}


def _print_trial(trial: ModelTrial) -> None:
    heads = ("mean error", "right floor", "score", "95 %: behind by")
    shown = table("Cross-validation over walks (score: mean error + 15 m a wrong floor)", ("model", "why"), heads)
    for one in trial.tried:
        numbers = ("-", "-", "-")
        if math.isfinite(one.score_m):
            numbers = (f"{one.mean_m:.2f} m", f"{100 * one.floor_hit:.1f} %", f"{one.score_m:.2f} m")
        behind = "" if one.behind_m is None else f"{one.behind_m[0]:.2f} to {one.behind_m[1]:.2f} m"
        shown.add_row(one.name, one.why, *numbers, behind)
    table_console().print(shown)


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
