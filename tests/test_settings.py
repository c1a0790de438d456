"""The tree of settings, its file, and limits of single settings."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from pydantic import ValidationError

from vislam2tag.common.errors import UsageError
from vislam2tag.common.records import SettingsRecord
from vislam2tag.labeling.settings import LabelSettings
from vislam2tag.sessions.settings import FindingSettings
from vislam2tag.settings import Settings, part_of, read_settings, setting_fields


@pytest.mark.parametrize("name", sorted(FindingSettings.model_fields))
@pytest.mark.parametrize("value", [0.0, -1.0, float("nan")])
def test_limits_of_findings_are_positive(name: str, value: float) -> None:
    with pytest.raises(ValidationError):
        FindingSettings.model_validate({name: value})


@pytest.mark.parametrize("limit_m", [0.3, float("inf")])
def test_the_limit_of_uncertainty_survives_strict_json(limit_m: float) -> None:
    settings = Settings(labels=LabelSettings(max_sigma_m=limit_m))
    text = json.dumps(settings.model_dump(mode="json"), allow_nan=False)
    assert Settings.model_validate_json(text) == settings
    assert Settings.model_validate_json(settings.model_dump_json()) == settings


@pytest.mark.parametrize("limit_m", [0.0, -1.0, float("nan")])
def test_the_limit_of_uncertainty_is_positive(limit_m: float) -> None:
    with pytest.raises(ValidationError):
        LabelSettings(max_sigma_m=limit_m)


def test_a_file_gives_some_settings_and_the_others_keep_their_defaults(tmp_path: Path) -> None:
    file = tmp_path / "own.toml"
    file.write_text("strategy = 'local'\n[labels]\nmax_sigma_m = inf\nrule = 'next-frame'\n")
    settings = read_settings(file)
    assert settings == Settings.model_validate(
        {"strategy": "local", "labels": {"max_sigma_m": float("inf"), "rule": "next-frame"}}
    )


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("[labels]\nmax_sgima_m = 1", "labels.max_sgima_m: no such setting; the closest name is labels.max_sigma_m"),
        ("[lables]\nmax_sigma_m = 1", "lables: no such setting; the closest name is labels"),
        ("visit_radius_m = 1", "visit_radius_m: no such setting; the closest name is mapping.visit_radius_m"),
        ("[mapping]\nvisit_radius_m = -1", "mapping.visit_radius_m: -1: Input should be greater than 0"),
        ("[labels]\nrule = 'best'", "labels.rule: best: Input should be 'interpolate' or 'next-frame'"),
        ("[mapping.heights]\ncarried_m = 3.0", "mapping.heights: carried_m must be within carried_range_m"),
        ("[labels", "not a valid TOML file"),
    ],
)
def test_what_a_file_may_not_say(tmp_path: Path, text: str, said: str) -> None:
    file = tmp_path / "own.toml"
    file.write_text(text)
    with pytest.raises(UsageError) as raised:
        read_settings(file)
    assert str(raised.value).startswith(f"--config {file}: {said}")


def test_a_file_that_is_not_there(tmp_path: Path) -> None:
    with pytest.raises(UsageError, match=r"own\.toml: the file cannot be read: No such file"):
        read_settings(tmp_path / "own.toml")


def test_labels_do_not_follow_from_the_settings_of_other_commands() -> None:
    tree = Settings().of_labels()
    assert set(tree) == {"strategy", "survey", "findings", "mapping", "labels", "truth", "together"}
    assert Settings.model_validate(tree) == Settings()


REMOVED = """
[mapping.dead_reckoning]
step_noise = 0.2
plan_prior = false
[walkable]
cell_m = 0.2
[walkable.graph]
door_m = 2.0
"""


def test_a_setting_that_is_a_constant_now_is_accepted_and_named(tmp_path: Path) -> None:
    (tmp_path / "own.toml").write_text(REMOVED)
    notes = list[str]()
    settings = read_settings(tmp_path / "own.toml", notes.append)
    assert not settings.mapping.dead_reckoning.plan_prior
    assert settings.walkable.cell_m == 0.2
    (note,) = notes
    assert note.startswith(f"{tmp_path / 'own.toml'}: mapping.dead_reckoning.step_noise, walkable.graph: ")


def test_what_was_removed_is_no_field_and_part_of_no_result() -> None:
    parts = [part for _, field in setting_fields() if (part := part_of(field)) is not None]
    removed = [(part, name) for part in parts if issubclass(part, SettingsRecord) for name in part.removed]
    assert removed
    assert not [name for part, name in removed if name in part.model_fields]
    for part, name in removed:
        assert part.model_validate({name: 0.0}) == part()
