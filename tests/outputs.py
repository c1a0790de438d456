"""Every command that writes an output folder or file, as the tests of interrupted and repeated runs call it."""

from __future__ import annotations

import inspect
import shutil
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
import polars as pl
import typer
from PIL import Image, ImageDraw

from tests.cli.command import vislam2tag
from tests.surveys import make_survey
from vislam2tag.cli.app import app

TABLE_ROWS = 50


class Inputs:
    """What the commands read; each part is made when a command first asks for it, and never changed."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder

    def _made(self, name: str, *arguments: str | Path) -> Path:
        path = self.folder / name
        done = vislam2tag(*arguments, "--out", path)
        assert done.returncode == 0, (done.stdout, done.stderr)
        return path

    @cached_property
    def survey(self) -> Path:
        """Four sessions on two floors."""
        return make_survey(self.folder / "survey", floors=2, seconds=70.0)

    @cached_property
    def one_floor(self) -> Path:
        """Two sessions on one floor."""
        return make_survey(self.folder / "one_floor", seconds=40.0)

    @cached_property
    def labels(self) -> Path:
        """What ``process`` makes of one floor."""
        return self._made("labels", "process", self.one_floor, "--jobs", "1", *QUICK)

    @cached_property
    def dataset(self) -> Path:
        """A data set of one floor."""
        return self._made("set", "dataset", self.labels, "--jobs", "1")

    @cached_property
    def later(self) -> Path:
        """A data set of the same floor that was recorded later."""
        done = vislam2tag("simulate", self.folder / "later", *SMALL, "--seed", "3", "--later", "2022-06-01")
        assert done.returncode == 0, done.stderr
        return self._made("later_set", "dataset", self.folder / "later", "--jobs", "1")

    @cached_property
    def exported(self) -> Path:
        """That data set in a format of others."""
        return self._made("exported", "export", self.dataset, "--format", "uji", "--jobs", "1")

    @cached_property
    def model(self) -> Path:
        """A positioning model."""
        return self._made("model.v2t", "train", self.dataset, "--model", "weighted-knn")

    @cached_property
    def table(self) -> Path:
        """A table of readings by their times."""
        times = pl.read_parquet(self.labels / "wifi" / "*.parquet")["time_ns"][:TABLE_ROWS]
        path = self.folder / "co2.csv"
        pl.DataFrame({"time_ns": times, "co2": np.arange(len(times))}).write_csv(path)
        return path

    @cached_property
    def fleet(self) -> Path:
        """A fleet of one survey."""
        path = self.folder / "fleet"
        done = vislam2tag("fleet", "add", path, self.one_floor)
        assert done.returncode == 0, done.stderr
        return path

    @cached_property
    def plan(self) -> Path:
        """A picture of a plan."""
        path = self.folder / "plan.png"
        picture = Image.new("RGB", (200, 100), "white")
        ImageDraw.Draw(picture).rectangle((10, 10, 190, 90), outline="black", width=3)
        picture.save(path)
        return path

    @cached_property
    def tape(self) -> tuple[Path, Path]:
        """Distances from walls to landmarks, and where the walls are."""
        tape, targets = self.folder / "tape.csv", self.folder / "walls.csv"
        corners = {"W1": (0.0, 0.0), "W2": (20.0, 0.0), "W3": (20.0, 10.0), "W4": (0.0, 10.0)}
        targets.write_text("name,x,y\n" + "".join(f"{name},{x},{y}\n" for name, (x, y) in corners.items()))
        rows = [f"L1,{name},{np.hypot(x - 5.0, y - 4.0):.3f}\n" for name, (x, y) in corners.items()]
        tape.write_text("from,to,distance_m\n" + "".join(rows))
        return tape, targets


QUICK = ("--strategy", "local")
SMALL = ("--floors", "1", "--devices", "1", "--sessions", "1", "--minutes", "1", "--severity", "none")
Arguments = Sequence[str | Path]


@dataclass(frozen=True)
class Case:
    """A command, and how it is called with an output."""

    command: str
    arguments: Callable[[Inputs, Path], Arguments]
    """Given the output, all that follows the command's name."""
    output: str = "out"
    """The output's name: with a suffix it is a file."""
    writes: tuple[str, ...] = ("out",)
    """Parameters of the command that name what it writes."""
    selections: tuple[Arguments, Arguments] | None = None
    """Options that select parts of the input, which together are all of it."""
    refused: bool = False
    """Whether the second of them is refused, and what the first wrote stays."""
    again: int = 0
    """Exit code of a second run into the same output; with another than 0 it changes nothing."""
    code: int = 0
    """Exit code of a run."""
    stored: bool = False
    """Whether the output may be in an object store."""
    copied: str = ""
    """The part of the inputs that is copied to the output first, because the command writes into it."""
    killed: bool = True
    """Whether a second run leaves the same after a killed one: not if it refuses a folder with anything in it, nor if a
    catalogue counts the runs."""
    slow: bool = False
    """Whether only the campaign runs it."""
    counted: tuple[str, ...] = ()
    """How the paths begin of files that are others after each run, or follow from what the user adds."""

    def __str__(self) -> str:
        return self.command.replace(" ", "-") + ("" if self.output == "out" else f"-{self.output}")

    def line(self, inputs: Inputs, out: Path, *options: str | Path) -> list[str | Path]:
        """The command line without the program's name."""
        return [*self.command.split(), *self.arguments(inputs, out), *options]

    def prepare(self, inputs: Inputs, out: Path) -> None:
        """Make what must be there before the command runs."""
        if self.copied:
            shutil.copytree(getattr(inputs, self.copied), out)
        elif "." in self.output:
            out.parent.mkdir(parents=True, exist_ok=True)


FLOORS = (("--floor", "0"), ("--floor", "1"))
ONE = ("--jobs", "1")

CASES = (
    Case(
        "process",
        lambda inputs, out: (inputs.survey, "--out", out, *ONE, *QUICK),
        selections=FLOORS,
        stored=True,
    ),
    Case(
        "evaluate",
        lambda inputs, out: (inputs.survey, "--out", out, *ONE, *QUICK),
        selections=FLOORS,
        refused=True,
        stored=True,
    ),
    Case(
        "check",
        lambda inputs, out: (inputs.survey, "--out", out, *ONE),
        selections=FLOORS,
        refused=True,
        stored=True,
        slow=True,
    ),
    Case("run", lambda inputs, out: (inputs.one_floor, "--out", out, *ONE), stored=True, slow=True),
    Case(
        "diagnose",
        lambda inputs, out: (inputs.one_floor, "--conflicts", out, *ONE),
        output="conflicts.html",
        writes=("conflicts",),
    ),
    Case(
        "dataset",
        lambda inputs, out: (inputs.one_floor, "--out", out, "--labels", out.parent / "labels", *ONE),
        writes=("out", "labels"),
        slow=True,
    ),
    Case("dataset", lambda inputs, out: (inputs.labels, "--out", out, *ONE), output="set", stored=True),
    Case("split", lambda _, out: (out, "--by", "trajectory"), copied="dataset", writes=("dataset",)),
    Case("import", lambda inputs, out: (inputs.exported, "--out", out)),
    Case(
        "export",
        lambda inputs, out: (inputs.dataset, "--format", "uji", "--out", out, *ONE),
        stored=True,
    ),
    Case(
        "join",
        lambda inputs, out: (inputs.dataset, inputs.later, "--out", out),
        stored=True,
        slow=True,
    ),
    Case("figures", lambda inputs, out: (inputs.dataset, "--out", out), stored=True, slow=True),
    Case(
        "radio-maps",
        lambda inputs, out: (inputs.dataset, "--out", out, "--cell", "5m", "--most", "1"),
        stored=True,
        slow=True,
    ),
    Case("train", lambda inputs, out: (inputs.dataset, "--model", "weighted-knn", "--out", out), output="model.v2t"),
    Case("locate", lambda inputs, out: (inputs.model, inputs.dataset, "--out", out), output="places.csv"),
    Case("benchmark", lambda inputs, out: (inputs.dataset, "--model", "weighted-knn", "--out", out), slow=True),
    Case("label", lambda inputs, out: (inputs.table, "--labels", inputs.labels, "--out", out), output="co2.parquet"),
    Case(
        "survey-landmarks",
        lambda inputs, out: (inputs.one_floor, "--out", out, "--report", out.with_suffix(".json"), *ONE),
        output="completed.csv",
        writes=("out", "report"),
    ),
    Case(
        "studio",
        lambda inputs, out: (inputs.one_floor, "--labels", inputs.labels, "--export", out, *ONE),
        writes=("export",),
        slow=True,
    ),
    Case("site show", lambda inputs, out: (inputs.one_floor, "--out", out), output="site.svg"),
    Case("site write", lambda inputs, out: (inputs.one_floor, "--out", out)),
    Case(
        "site rebase",
        lambda inputs, out: (inputs.labels, "--from", inputs.one_floor, "--to", inputs.one_floor, "--out", out),
    ),
    Case("site walkable", lambda inputs, out: (inputs.one_floor, "--out", out), slow=True),
    Case(
        "site init",
        lambda inputs, out: (out, "--plan", inputs.plan, "--floor", "0", "--width-m", "20"),
        writes=("site",),
        again=2,
    ),
    Case("plan", lambda inputs, out: (inputs.one_floor, "--out", out), slow=True),
    Case("sheets", lambda _, out: ("--ids", "1-2", "--seed", "7", "--out", out)),
    Case(
        "register",
        lambda inputs, out: (
            *(inputs.one_floor, "--tape", inputs.tape[0], "--targets", inputs.tape[1], "--floor", "0"),
            *("--out", out),
        ),
    ),
    Case("simulate", lambda _, out: (out, *SMALL), writes=("out",), again=2, killed=False),
    Case("demo", lambda _, out: (out,), writes=("out",), slow=True),
    Case(
        "fleet process",
        lambda _, out: (out, *ONE),
        copied="fleet",
        writes=("store",),
        killed=False,
        counted=("fleet.json", "catalogue/", "reduced/", ".lock"),
    ),
)
EXEMPT = {
    "receive": "files sessions in the survey; tests/studio/receiving kills and repeats it",
    "inspect": "writes nothing",
    "attach": "adds a folder to the survey",
    "sightings": "adds a file to each session of the survey",
    "fleet add": "copies surveys; tests/pipeline/fleet",
    "fleet list": "writes nothing",
    "fleet status": "writes nothing",
    "fleet report": "writes pages of the catalogue; tests/pipeline/fleet",
    "verify": "writes nothing",
    **dict.fromkeys(
        ("site set", "site renumber", "site remove", "site align"), "changes the site; test_site_changes.py"
    ),
    "docs": "writes nothing",
    "paper": "needs the paper's data; claims its folder as `figures` does",
}
READ = {
    *("a", "b", "base", "by", "clicks", "cluster", "compare", "config", "control", "data", "dataset", "describe"),
    *("folder", "forbid", "from_", "hash_bssid", "image", "images", "labels", "landmark_file", "landmarks", "later"),
    *(
        "mask",
        "model",
        "old",
        "path",
        "plan",
        "plans",
        "scans",
        "site",
        "source",
        "sources",
        "station",
        "survey",
        "table",
    ),
    *("tape", "targets", "to", "track", "truth", "update"),
}
"""Parameters that name what is read."""
UNCOVERED = {
    ("train", "onnx"): "needs PyTorch; written as the model is",
    ("site init", "measure"): "a page that is written alone, as `site show` writes its picture",
    ("register", "click"): "a page that is written alone, as `site show` writes its picture",
}
"""Parameters that name what is written and that no case gives."""


def commands() -> Iterator[tuple[str, Any]]:
    """Every command of the program, and of its groups, by its name."""

    def below(name: str, command: Any) -> Iterator[tuple[str, Any]]:
        single = [(name, command)]
        groups = getattr(command, "commands", {})
        yield from [one for sub, each in groups.items() for one in below(f"{name} {sub}", each)] or single

    group: Any = typer.main.get_group(app)
    for name in group.list_commands(None):
        yield from below(name, group.get_command(None, name))


def path_parameters(command: Any) -> set[str]:
    """Names of a command's parameters that are paths."""
    function = inspect.unwrap(command.callback)
    hints = inspect.get_annotations(function, eval_str=False)
    aliases = {name for name, value in function.__globals__.items() if "pathlib" in str(value)}
    return {name for name, hint in hints.items() if "Path" in str(hint) or str(hint) in aliases} - {"return"}
