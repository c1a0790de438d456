"""``vislam2tag train`` as its users run it."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest

from tests.cli.command import the_error, vislam2tag
from tests.datasets.factory import small_dataset
from vislam2tag.cli.options import parameters_of
from vislam2tag.common.errors import UsageError
from vislam2tag.datasets.folder import write_dataset
from vislam2tag.datasets.privacy import Privacy, key_name, with_privacy
from vislam2tag.datasets.splits import standard_splits

KEY = b"0123456789abcdef"


def test_a_model_is_trained_tested_and_the_same_again(tmp_path: Path) -> None:
    small = small_dataset()
    hashed = with_privacy(replace(small, splits=standard_splits(small)), Privacy(hash_key=KEY))
    write_dataset(hashed, tmp_path / "set")
    arguments = ("train", tmp_path / "set", "--model", "local-kriging", "--set", "k=4", "--seed", "3")
    for out in ("a.v2t", "b.v2t"):
        done = vislam2tag(*arguments, "--split", "device", "--fold", "Pixel", "--out", tmp_path / out)
        assert done.returncode == 0, done.stderr
    for text in (
        "local-kriging: learned 22 fingerprints of small (split device, fold Pixel), 10 access points, 2 floors",
        "calibration: circles of 68 % hold",
        "tested on 22 fingerprints: mean error",
        f"access points are hashed with key {key_name(KEY)}",
        f"model: {tmp_path / 'b.v2t'}",
    ):
        assert text in done.stdout
    assert (tmp_path / "a.v2t").read_bytes() == (tmp_path / "b.v2t").read_bytes()


def test_without_a_model_a_table_says_which_is_taken(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("COLUMNS", "200")
    write_dataset(small_dataset(), tmp_path / "set")
    done = vislam2tag("train", tmp_path / "set", "--budget-s", "0", "--out", tmp_path / "a.v2t")
    assert done.returncode == 0, done.stderr
    for text in ("Cross-validation over walks", "chosen", "local-kriging", "right floor", "learned 44 fingerprints"):
        assert text in done.stdout


def test_wrong_usage_is_one_line_and_exit_code_2(tmp_path: Path) -> None:
    arguments = ("train", tmp_path, "--out", tmp_path / "a.v2t")
    assert "is called 'psychic'; there are: " in the_error(vislam2tag(*arguments, "--model", "psychic"))
    assert "the model combined was removed; train without --model" in the_error(
        vislam2tag(*arguments, "--model", "combined")
    )
    assert "is no data set" in the_error(vislam2tag(*arguments, "--model", "weighted-knn"))


def test_values_are_read_as_json_or_text() -> None:
    texts = ["k=5", "exponent=2.5", "distance=cosine", "on=true", "heads=[1, 2]", "a=b=c", "none="]
    assert parameters_of(texts) == {
        "k": 5,
        "exponent": 2.5,
        "distance": "cosine",
        "on": True,
        "heads": (1, 2),
        "a": "b=c",
        "none": "",
    }
    for wrong in ("k", "=5"):
        with pytest.raises(UsageError, match="give PARAMETER=VALUE"):
            parameters_of([wrong])
