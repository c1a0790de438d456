"""Every result of the public interface is short at a prompt and gives its tables to Polars and pandas."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from pathlib import Path

import pandas as pd
import polars as pl
import pytest
from PIL import Image

from tests.test_api import FUNCTIONS, classes_in, hints
from vislam2tag import api
from vislam2tag.common.tabular import Tabular
from vislam2tag.core.transforms import Similarity2
from vislam2tag.site.frame_change import FrameChange
from vislam2tag.site.plans.source import Extent, PlanSource
from vislam2tag.site.site_file import FloorPart

NO_TABLES = {
    "Finding": "each owner has a table of its findings",
    "MappingStrategy": "a protocol",
    "Positioner": "a protocol",
    "Scenario": "what to simulate",
    "Settings": "what a user writes",
    "Trajectory": "arrays; label_readings and MappedWalk.frames are its tables",
}
MOST = 500
UNMOVED = api.FrameChanges(floors=(FrameChange.of(0, Similarity2.identity()),))


def survey() -> api.Survey:
    return api.open_survey("survey")


def mapped() -> api.MappedWalk:
    session = api.read_session(survey().sessions[0])
    tables = session.to_pandas("poses"), session.to_pandas("sightings"), survey().to_pandas("landmarks")
    return api.map_walk(*tables, floor=session.key.floor)


def part(number: int) -> FloorPart:
    return FloorPart(number=number, plan=PlanSource(file="plan.png", extent=Extent(width_m=20.0, height_m=10.0)))


def attached() -> api.Attached:
    session = api.read_session(survey().sessions[0])
    turns = session.to_frame("sensors").filter(pl.col("sensor") == "GYRO").select("time_ns", "v1", "v2", "v3")
    turns.rename({"v1": "gyro_x", "v2": "gyro_y", "v3": "gyro_z"}).write_csv("band.csv")
    return api.attach(survey().sessions[0].folder, "band.csv")


def trained() -> api.TrainedModel:
    return api.train("set", api.TrainPlan("weighted-knn", {}), "m.v2t")


def split() -> api.Split:
    return api.split(api.open_dataset("set"), api.SplitKind.RANDOM, api.SplitSettings())


CALLS: Mapping[str, Callable[[], object]] = {
    "add_split": lambda: api.add_split("copy", split()),
    "attach": attached,
    "benchmark": lambda: api.benchmark(api.open_dataset("set"), "benchmark", api.BenchmarkPlan([])),
    "build_dataset": lambda: api.build_dataset("labels", "built"),
    "check": lambda: api.check("survey"),
    "diagnose": lambda: api.diagnose("survey"),
    "evaluate": lambda: api.evaluate("survey", "evaluated", strategies=["local"]),
    "export": lambda: api.export("labels", "exported", "geojson"),
    "figures": lambda: api.figures("set", "figures"),
    "fleet_add": lambda: api.fleet_add("fleet", "survey"),
    "fleet_process": lambda: api.fleet_process("fleet"),
    "fleet_status": lambda: api.fleet_status("fleet"),
    "import_format": lambda: api.import_("fingerprints.csv", "imported"),
    "inspect": lambda: api.inspect("survey"),
    "join": lambda: api.join("set", "copy", "joined"),
    "label": lambda: api.label(pd.read_csv("scans.csv"), "labels"),
    "learning_data": lambda: api.learning_data(api.open_dataset("set")),
    "load_model": lambda: api.load_model("m.v2t"),
    "locate": lambda: api.locate("m.v2t", "set"),
    "map_walk": mapped,
    "mark_uncertain": lambda: api.mark_uncertain(mapped().walk.trajectory, 0.1),
    "open_dataset": lambda: api.open_dataset("set"),
    "open_survey": survey,
    "plan": lambda: api.plan("survey", "plans", api.PlanSettings(), api.PlanRequest(ignore_existing=True)),
    "process": lambda: api.process("survey", "processed"),
    "radio_maps": lambda: api.radio_maps("set", "maps", api.RadioMapSettings()),
    "read_session": lambda: api.read_session(survey().sessions[0]),
    "run": lambda: api.run("survey", "run"),
    "sheets": lambda: api.sheets(api.SheetOptions(ids="1-3"), "sheets"),
    "site_align": lambda: api.site_align("site", 1, 0, [((0, 0), (0, 0)), ((1, 0), (1, 0))]),
    "site_init": lambda: api.site_init("new", api.NewFloor("plan.png", part(0))),
    "site_set": lambda: api.site_set("site", 0, api.FloorChanges(name="ground")),
    "site_show": lambda: api.site_show("survey"),
    "site_walkable": lambda: api.site_walkable("survey", "walkable", (), api.WalkableSettings(), None),
    "site_write": lambda: api.site_write("survey", "published"),
    "split": split,
    "survey_landmarks": lambda: api.survey_landmarks("survey"),
    "train": trained,
    "verify": lambda: api.verify("set", "copy", 0.0),
    "write_dataset": lambda: api.write_dataset(api.open_dataset("set"), "written"),
}


NOT_CALLED = {
    "demo": "simulates whole campaigns",
    "model_named": "a protocol",
    "paper": "needs the surveys of the paper",
    "paper_evaluation": "what to simulate",
    "public_dataset": "a context of a Dataset",
    "read_settings": "what a user writes",
    "register": "needs measurements",
    "regular_survey": "what to simulate",
    "sightings": "needs pictures",
    "site_rebase": "returns a text",
    "site_remove": "returns what site_set does",
    "site_renumber": "returns what site_set does",
    "strategy_named": "a protocol",
}


def results(function: object) -> set[type]:
    """The classes of ours that a function returns, alone, or in a list or a mapping."""
    return set(classes_in(hints(function)["return"]))


RETURNING = {each.__name__: each for each in FUNCTIONS if results(each)}


def each_of(value: object) -> Iterable[object]:
    if isinstance(value, list | tuple) and not hasattr(value, "_fields"):
        return [part for one in value for part in each_of(one)]
    return [part for one in value.values() for part in each_of(one)] if isinstance(value, dict) else [value]


@pytest.fixture(scope="module")
def world(tmp_path_factory: pytest.TempPathFactory) -> Path:
    world = tmp_path_factory.mktemp("world")
    scenario = api.regular_survey(2, floors=(0, 1), devices=("LG", "OnePlus"), sessions=1, duration_s=60.0)
    assert len(repr(scenario)) < MOST
    api.simulate(scenario, world / "survey")
    api.process(world / "survey", world / "labels")
    for name in ("set", "copy"):
        api.dataset(world / "labels", world / name)
    api.fleet_add(world / "fleet", world / "survey")
    api.train(world / "set", api.TrainPlan("weighted-knn", {}), world / "m.v2t")
    pl.read_parquet(world / "labels" / "wifi").head(50).select("device", "session", "time_ns").write_csv(
        world / "scans.csv"
    )
    rows = [f"{x},{y},0,-60,-70" for x in range(10) for y in range(5)]
    (world / "fingerprints.csv").write_text("\n".join(("x,y,floor,02:00:00:00:00:01,02:00:00:00:00:02", *rows)))
    plan = Image.new("L", (200, 100), 255)
    plan.paste(0, (0, 0, 200, 5))
    plan.save(world / "plan.png")
    for number in (0, 1):
        api.site_init(world / "site", api.NewFloor(world / "plan.png", part(number)))
    return world


def test_every_class_that_a_function_returns_has_tables() -> None:
    classes = {kind for function in FUNCTIONS for kind in results(function)}
    assert {kind.__name__ for kind in classes if not issubclass(kind, Tabular)} <= NO_TABLES.keys()


def test_every_function_that_returns_one_is_called_below() -> None:
    functions = {getattr(api, name) for name in (*CALLS, *NOT_CALLED)}
    assert sorted(name for name, function in RETURNING.items() if function not in functions) == []


@pytest.mark.parametrize("call", CALLS.values(), ids=CALLS)
def test_it_is_short_and_gives_tables(call: Callable[[], object], world: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(world)
    found = list(each_of(call()))
    assert found
    for result in found:
        assert len(repr(result)) < MOST
        assert len(str(result)) < MOST
        if isinstance(result, Tabular):
            assert result.to_frame().equals(result.to_frame(result.table_names()[0]))
            for name in result.table_names():
                frame, table = result.to_frame(name), result.to_pandas(name)
                assert isinstance(table, pd.DataFrame)
                assert list(table.columns) == frame.columns
                assert len(table) == frame.height
                assert pl.Object not in frame.dtypes


KINDS: Mapping[str, Callable[[pd.DataFrame], pd.DataFrame]] = {
    "nullable": lambda table: table.convert_dtypes(),
    "arrow": lambda table: table.convert_dtypes(dtype_backend="pyarrow"),
    "objects": lambda table: table.astype(object),
    "categories": lambda table: table.astype({"session": "category", "device": "category"}),
    "indexed": lambda table: table.set_index("time_ns"),
}


@pytest.mark.parametrize("kind", KINDS.values(), ids=KINDS)
def test_tables_of_every_kind_are_labelled_alike(
    kind: Callable[[pd.DataFrame], pd.DataFrame], world: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(world)
    scans = pd.read_csv("scans.csv")
    columns = ["x_m", "y_m", "sigma", "status"]
    expected = api.label("scans.csv", "labels").to_frame().select(columns)
    assert api.label(kind(scans), "labels").to_frame().select(columns).equals(expected)
    trajectory = mapped().walk.trajectory
    labelled = api.label_readings(pl.from_pandas(scans[["time_ns"]]), trajectory, api.LabelSettings())
    own = [name for name in labelled.columns if name != "time_ns"]
    again = api.label_readings(kind(scans), trajectory, api.LabelSettings())
    assert again.select(own).equals(labelled.select(own))


def test_pandas_reads_our_parquet_files(world: Path) -> None:
    files = [*(world / "labels").rglob("*.parquet"), *(world / "set").rglob("*.parquet")]
    assert len(files) > 10
    for file in files:
        assert len(pd.read_parquet(file)) == pl.read_parquet(file).height
    assert len(pd.read_parquet(world / "labels" / "wifi")) == pl.read_parquet(world / "labels" / "wifi").height
