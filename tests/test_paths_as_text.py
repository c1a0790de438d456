"""Wherever the public interface takes a folder or file, text will do: for the type checker, and when it runs.

Each function and option class is called with text: type checkers read the calls, and the tests make them. Where
nothing lies at the path, the answer is a message and no TypeError or AttributeError.
"""

from __future__ import annotations

import dataclasses
import inspect
import typing
from collections.abc import Callable, Iterator
from os import PathLike
from pathlib import Path

import pytest

from vislam2tag import api
from vislam2tag.core.transforms import Similarity2
from vislam2tag.site.frame_change import FrameChange
from vislam2tag.site.site_file import FloorPart

UNCHANGED = api.FrameChanges(floors=(FrameChange.of(0, Similarity2.identity()),))


def of_dataset(name: str, data: str) -> api.Dataset:
    with api.public_dataset(name, data) as dataset:
        return dataset


def registered(files: api.FloorFiles) -> object:
    site = api.open_survey("survey").site
    return api.register(site, site.floors[0], files, api.RegistrationSettings())


MISSING: dict[str, list[Callable[[], object]]] = {
    "BuildOptions": [
        lambda: api.dataset("labels", "out", options=api.BuildOptions(surveys="gone")),
        lambda: api.dataset("labels", "out", options=api.BuildOptions(labels="kept")),
    ],
    "ExportOptions": [lambda: api.export("labels", "out", "geojson", api.ExportOptions(survey="gone"))],
    "FloorFiles": [
        lambda: registered(api.FloorFiles(stations="gone.csv", control="gone.csv")),
        lambda: registered(api.FloorFiles(tape="gone.csv")),
        lambda: registered(api.FloorFiles(clicks="gone.csv", targets="gone.csv")),
    ],
    "ImportOptions": [lambda: api.import_format("scans.csv", "out", api.ImportOptions(columns="gone.toml"))],
    "NewFloor": [lambda: api.site_init("new", api.NewFloor(plan="gone.png", part=FloorPart(number=1)))],
    "PlanRequest": [
        lambda: api.plan("survey", "out", api.PlanSettings(), api.PlanRequest(forbidden="gone.csv")),
        lambda: api.plan("survey", "out", api.PlanSettings(), api.PlanRequest(floors=(0,), mask="gone.png")),
    ],
    "SheetOptions": [
        lambda: api.sheets(api.SheetOptions(source="gone"), "out"),
        lambda: api.sheets(api.SheetOptions(images="gone"), "out"),
    ],
    "Tracks": [lambda: api.Tracks("gone")],
    "TrainPlan": [
        lambda: api.train("set", api.TrainPlan("weighted-knn", {}, onnx="gone/m.onnx"), "m.v2t"),
        lambda: api.train("set", api.TrainPlan(None, {}, update="gone.v2t"), "m.v2t"),
    ],
    "add_split": [
        lambda: api.add_split("gone", api.split(api.open_dataset("set"), api.SplitKind.RANDOM, api.SplitSettings()))
    ],
    "attach": [lambda: api.attach("gone", "gone.zip")],
    "benchmark": [lambda: api.benchmark(api.open_dataset("set"), "survey", api.BenchmarkPlan([]))],
    "check": [lambda: api.check("gone", out="out"), lambda: api.check("survey", landmarks="gone.csv")],
    "dataset": [lambda: api.dataset("gone", "out"), lambda: api.build_dataset(["labels"], "survey")],
    "demo": [lambda: api.demo("labels")],
    "diagnose": [lambda: api.diagnose("gone"), lambda: api.diagnose("survey", landmarks="gone.csv")],
    "evaluate": [
        lambda: api.evaluate("gone", "out"),
        lambda: api.evaluate("survey", "out", landmarks="gone.csv"),
        lambda: api.evaluate("survey", "out", truth="gone"),
    ],
    "export": [lambda: api.export("gone", "out", "geojson")],
    "figures": [lambda: api.figures("gone", "out"), lambda: api.figures("set", "survey")],
    "fleet_add": [lambda: api.fleet_add("fleet", "gone"), lambda: api.fleet_add("fleet", ["gone"])],
    "fleet_list": [lambda: api.fleet_list("gone")],
    "fleet_process": [lambda: api.fleet_process("gone")],
    "fleet_report": [lambda: api.fleet_report("gone")],
    "fleet_status": [lambda: api.fleet_status("gone")],
    "import_": [lambda: api.import_("gone", "out"), lambda: api.import_format("gone", "out")],
    "inspect": [lambda: api.inspect("gone")],
    "join": [lambda: api.join("gone", "gone", "out"), lambda: api.join("set", "gone", "out")],
    "label": [
        lambda: api.label("gone.csv", "labels"),
        lambda: api.label("scans.csv", "gone"),
        lambda: api.label("scans.csv", "labels", align="motion", survey="gone"),
    ],
    "load_model": [lambda: api.load_model("gone.v2t")],
    "locate": [lambda: api.locate("gone.v2t", "gone.csv", print, as_json=False)],
    "open_dataset": [lambda: api.open_dataset("gone")],
    "open_survey": [lambda: api.open_survey("gone"), lambda: api.open_survey("survey", landmark_file="gone.csv")],
    "paper": [lambda: api.paper("gone", "out")],
    "plan": [lambda: api.plan("gone", "out", api.PlanSettings(), api.PlanRequest())],
    "process": [
        lambda: api.process("gone", "out"),
        lambda: api.process("survey", "survey"),
        lambda: api.process("survey", "out", landmarks="gone.csv"),
    ],
    "public_dataset": [lambda: of_dataset("tampere", "gone")],
    "radio_maps": [lambda: api.radio_maps("gone", "out", api.RadioMapSettings())],
    "read_settings": [lambda: api.read_settings("gone.toml")],
    "run": [lambda: api.run("gone", "out"), lambda: api.run_survey("survey", "out", landmarks="gone.csv")],
    "save_model": [lambda: api.save_model(trained(), "gone/m.v2t")],
    "sheets": [lambda: api.sheets(api.SheetOptions(ids="1"), "survey")],
    "sightings": [
        lambda: api.sightings("gone", tags="apriltag-36h11", tag_side_m=0.1),
        lambda: api.sightings("survey", images="gone"),
    ],
    "simulate": [lambda: api.simulate(api.regular_survey(2, sessions=0), "survey")],
    "site_align": [lambda: api.site_align("gone", 1, 0, [])],
    "site_remove": [lambda: api.site_remove("gone", 1)],
    "site_renumber": [lambda: api.site_renumber("gone", 1, 2)],
    "site_set": [lambda: api.site_set("gone", 1, api.FloorChanges(name="A"))],
    "site_init": [lambda: api.site_init("new", api.NewFloor("gone.png", FloorPart(number=1)))],
    "site_rebase": [
        lambda: api.site_rebase("gone", "out", UNCHANGED),
        lambda: api.site_rebase("labels", "out", UNCHANGED, new_site="gone"),
    ],
    "site_show": [lambda: api.site_show("gone")],
    "site_walkable": [
        lambda: api.site_walkable("gone", "out", (), api.WalkableSettings(), None),
        lambda: api.site_walkable("survey", "out", (0,), api.WalkableSettings(), "gone.png"),
    ],
    "site_write": [lambda: api.site_write("gone", "out")],
    "survey_landmarks": [lambda: api.survey_landmarks("gone")],
    "train": [lambda: api.train("gone", api.TrainPlan("weighted-knn", {}), "m.v2t")],
    "verify": [lambda: api.verify("gone", "gone", 0.0)],
    "write_dataset": [lambda: api.write_dataset(api.open_dataset("set"), "survey")],
}
"""Calls by what takes the path, each of which ends with a message."""
FOUND: dict[str, Callable[[], object]] = {
    "Dataset": lambda: api.write_dataset(with_files(api.open_dataset("set")), "copy"),
    "Scenario": lambda: api.simulate(dataclasses.replace(api.regular_survey(2, sessions=0), site="survey"), "new"),
}
"""Calls that find what they need."""


def with_files(dataset: api.Dataset) -> api.Dataset:
    return dataclasses.replace(dataset, files={"scans.csv": "scans.csv"})


def trained() -> api.SavedModel:
    return api.train("set", api.TrainPlan("weighted-knn", {}), "m.v2t").saved


@pytest.fixture(scope="module")
def world(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A survey, its labels and its data set, all made with text."""
    world = tmp_path_factory.mktemp("world")
    api.simulate(api.regular_survey(2, floors=(0,), devices=("LG",), sessions=1, duration_s=30.0), f"{world}/survey")
    summary = api.process(f"{world}/survey", f"{world}/labels")
    assert summary.sessions == 1
    api.dataset(f"{world}/labels", f"{world}/set", options=api.BuildOptions(surveys=f"{world}/survey"))
    (world / "scans.csv").write_text("time_ns,gyro_x,gyro_y,gyro_z\n1,0,0,0\n")
    return world


@pytest.mark.parametrize("call", [pytest.param(call, id=name) for name, calls in MISSING.items() for call in calls])
def test_text_is_taken_for_a_path(call: Callable[[], object], world: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(world)
    with pytest.raises((api.Vislam2tagError, FileNotFoundError), match=r"gone|survey|labels|kept"):
        call()


@pytest.mark.parametrize("call", FOUND.values(), ids=FOUND)
def test_text_leads_to_files(call: Callable[[], object], world: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(world)
    call()
    assert (world / "copy" / "scans.csv").is_file() or (world / "new" / "simulation.json").is_file()


def paths_in(annotation: object) -> Iterator[object]:
    """Path and PathLike, wherever they stand in a type but in what a function is called with or returns."""
    if annotation is Path or annotation == PathLike[str]:
        yield annotation
    elif typing.get_origin(annotation) is not None and not isinstance(typing.get_args(annotation)[0], list):
        for part in typing.get_args(annotation):
            yield from paths_in(part)


def taken(thing: object) -> dict[str, object]:
    """What a call takes, by name."""
    made = thing.__init__ if isinstance(thing, type) else thing  # type: ignore[misc]
    if not inspect.isfunction(made):
        return {}
    return {name: hint for name, hint in typing.get_type_hints(made).items() if name != "return"}


RESULTS = {"Attached", "Floor", "SessionRef", "Survey"}
"""What functions return; what it holds is read, so that it is a Path."""


def test_whatever_takes_a_path_takes_text() -> None:
    kinds = {
        name: {kind for hint in taken(getattr(api, name)).values() for kind in paths_in(hint)}
        for name in api.__all__
        if name not in RESULTS
    }
    assert {name for name, found in kinds.items() if Path in found} == set()
    named = {getattr(api, name) for name in (*MISSING, *FOUND)}
    assert {name for name, found in kinds.items() if found and getattr(api, name) not in named} == set()
