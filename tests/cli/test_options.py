"""Options made from the settings' tree, and the page about all settings."""

from __future__ import annotations

import math
import re
from dataclasses import fields
from pathlib import Path
from typing import get_type_hints

import pytest
from hypothesis import given
from hypothesis import strategies as st
from typer.testing import CliRunner

from tests.cli.test_app import command_of
from tests.docs.settings_page import settings_page
from vislam2tag.cli.app import OLD_NAMES, app
from vislam2tag.cli.commands_process import ProcessOptions
from vislam2tag.cli.options import option_of, settings_of
from vislam2tag.common.errors import UsageError
from vislam2tag.settings import part_of, setting_fields


def test_each_setting_is_described() -> None:
    rows = [line for line in settings_page().splitlines() if line.startswith("| `")]
    assert len(rows) == sum(part_of(field) is None for _, field in setting_fields())
    assert not [row for row in rows if row.endswith("|  |")]


def test_options_win_over_the_file(tmp_path: Path) -> None:
    file = tmp_path / "own.toml"
    file.write_text("[labels]\nmax_sigma_m = 0.3\nmax_gap_s = 2.0\n[mapping.smoother]\nsighting_range_m = 4\n")
    settings = settings_of(file, {"labels.max_sigma_m": 0.4, "mapping.visit_radius_m": None})
    assert (settings.labels.max_sigma_m, settings.labels.max_gap_s) == (0.4, 2.0)
    assert (settings.mapping.visit_radius_m, settings.mapping.smoother.sighting_range_m) == (1.0, 4.0)


@pytest.mark.parametrize("value", [1e308, -1e10, 1e-7, -1e-320])
def test_numbers_beyond_all_sizes_are_refused_where_they_were_given(tmp_path: Path, value: float) -> None:
    file = tmp_path / "own.toml"
    file.write_text(f"[simulation.building]\nstorey_m = {value!r}\n")
    told = "{}: " + f"{value:g} is out of range; expected a number between 1e-6 and 1e9"
    with pytest.raises(UsageError, match=re.escape(told.format(f"--config {file}: simulation.building.storey_m"))):
        settings_of(file, {})
    with pytest.raises(UsageError, match=re.escape(told.format("--storey-m"))):
        settings_of(None, {"simulation.building.storey_m": value})
    assert settings_of(None, {"labels.max_sigma_m": math.inf}).labels.max_sigma_m == math.inf


def test_a_wrong_value_names_its_option_as_it_was_typed() -> None:
    for name, value in (("mapping.visit_radius_m", float("inf")), ("labels.max_gap_s", -1.0), ("split.folds", 1)):
        with pytest.raises(UsageError) as raised:
            settings_of(None, {name: value})
        assert str(raised.value).startswith(f"{option_of(name)} {value}: Input should be ")


NUMBERS = st.floats(max_value=0.0, allow_infinity=False) | st.just(math.nan)
PROCESS = ("labels.max_gap_s", "mapping.visit_radius_m", "labels.max_sigma_m", "mapping.max_step_m")


@given(name=st.sampled_from(PROCESS), value=NUMBERS)
def test_process_blames_the_option_that_was_typed(name: str, value: float) -> None:
    typed = name.rpartition(".")[2].replace("_", "-")
    done = CliRunner().invoke(app, ["process", "nowhere", "--out", "nowhere", f"--{typed}={value}"])
    assert isinstance(done.exception, UsageError)
    assert str(done.exception).startswith(f"--{typed} {value}: Input should be ")


def test_every_number_of_process_is_tried() -> None:
    hints = get_type_hints(ProcessOptions)
    numbers = [each for each in fields(ProcessOptions) if hints[each.name] == float | None]
    assert {name for each in numbers for name in each.metadata["sets"]} == set(PROCESS)


@pytest.mark.parametrize(
    ("command", "old", "new"),
    [
        ("process", "--max-sigma", "--max-sigma-m"),
        ("split", "--block-size", "--block-m"),
        ("split", "--guard", "--guard-m"),
        ("figures", "--cell", "--cell-m"),
        ("plan", "--spacing", "--spacing-m"),
        ("plan", "--time-limit", "--time-limit-s"),
        ("plan", "--speed", "--speed-m-s"),
        ("plan", "--view", "--view-deg"),
        ("register", "--shot-sigma", "--shot-sigma-m"),
        ("sheets", "--width", "--width-m"),
        ("receive", "--max-size", "--max-size-mb"),
    ],
)
def test_the_spelling_of_before_is_refused_with_the_new_one(command: str, old: str, new: str) -> None:
    done = CliRunner().invoke(app, [command, "somewhere", old, "1"])
    assert done.exit_code == 2
    assert f"No such option: {old}" in done.output
    assert new in done.output


def test_settings_beside_the_survey_are_taken_and_told(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "vislam2tag.toml").write_text("[labels]\nmax_sigma_m = 0.25\n")
    assert settings_of(None, {}, tmp_path).labels.max_sigma_m == 0.25
    assert capsys.readouterr().err == f"settings of {tmp_path / 'vislam2tag.toml'}\n"
    (tmp_path / "other.toml").write_text("[labels]\nmax_sigma_m = 0.5\n")
    assert settings_of(tmp_path / "other.toml", {}, tmp_path).labels.max_sigma_m == 0.5
    assert settings_of(None, {"labels.max_sigma_m": 0.75}, tmp_path).labels.max_sigma_m == 0.75
    assert capsys.readouterr().err.count("settings of") == 1


HIDDEN = {
    "site init": {"--elevation-m", "--level", "--others", "--epsg", "--stretch"},
    "site walkable": {"--wall-contrast"},
    "plan": {"--rooms", "--view-deg", "--nearest-m", "--speed-m-s", "--further", "--time-limit-s"},
    "radio-maps": {"--cell", "--reach", "--most"},
    "dataset": {"--window", "--ble-window", "--magnetic-window", "--imu-window"},
    "split": {"--share", "--folds", "--block-m", "--guard-m"},
    "figures": {"--cell-m", "--radius-m"},
    "process": {"--max-gap-s", "--max-step-m", "--label-rule", "--visit-radius-m", "--allow-for-pose-lag"},
    "evaluate": {"--max-step-m", "--clock-drift"},
}
"""Options that the help leaves out: a file of settings or of the site has them, or a refusal names them."""


@pytest.mark.parametrize("name", HIDDEN)
def test_options_that_help_leaves_out_are_taken(name: str) -> None:
    command = command_of(tuple(name.split()))
    assert {each.opts[-1] for each in command.params if getattr(each, "hidden", False)} == HIDDEN[name]


@pytest.mark.parametrize(
    ("words", "old", "new"),
    [
        (
            ["site", "init", "site", "--plan", "plan.png"],
            ["--measure", "page.html", "--layer", "W"],
            ["--click", "page.html", "--walls", "W"],
        ),
        (["plan", "site", "--out", "plan"], ["--sheet=A4", "--anew"], ["--paper=A4", "--restart"]),
        (["sightings", "survey"], ["--again"], ["--replace"]),
        (["simulate", "survey"], ["--landmark-file", "own.csv"], ["--landmarks", "own.csv"]),
        (["label", "table.csv", "--labels", "labels"], ["--align", "motion"], ["--by", "motion"]),
    ],
)
def test_old_names_of_options_mean_the_new_ones(words: list[str], old: list[str], new: list[str]) -> None:
    name = " ".join(words[:2]) if words[0] == "site" else words[0]
    renamed = {was.partition("=")[0]: now.partition("=")[0] for was, now in zip(old, new, strict=True) if was != now}
    assert OLD_NAMES[name] == renamed
    command = command_of(tuple(name.split()))
    own = words[len(name.split()) :]
    parsed = [command.make_context(name, [*own, *spelling]).params for spelling in ((), old, new)]
    assert parsed[0] != parsed[1] == parsed[2]
