from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from tests.mutations import mutate
from tests.site.site import plan_bytes
from vislam2tag.site.plans.images import load_plan


def test_a_jpeg_is_decoded_small_but_no_smaller_than_wanted(tmp_path: Path) -> None:
    Image.new("RGB", (1600, 800), "red").save(tmp_path / "plan.jpg")
    assert load_plan(tmp_path / "plan.jpg", 1).size == (200, 100)
    assert load_plan(tmp_path / "plan.jpg", 400).size == (800, 400)
    assert load_plan(tmp_path / "plan.jpg", 3000).size == (1600, 800)


@pytest.mark.parametrize("content", [b"", b"no image", b"%!PS-Adobe-3.0 EPSF-3.0\n", plan_bytes("JPEG")[:-60]])
def test_what_is_no_image_is_one_kind_of_error(tmp_path: Path, content: bytes) -> None:
    (tmp_path / "plan.jpg").write_bytes(content)
    with pytest.raises(OSError, match=r"^cannot be read as an image$"):
        load_plan(tmp_path / "plan.jpg", 1)


def test_large_plans_are_loaded_and_absurd_ones_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    Image.new("1", (300, 200)).save(tmp_path / "plan.png")
    monkeypatch.setattr(Image, "MAX_IMAGE_PIXELS", 40_000)
    assert load_plan(tmp_path / "plan.png", 1).size == (300, 200)
    monkeypatch.setattr(Image, "MAX_IMAGE_PIXELS", 20_000)
    with pytest.raises(OSError, match=r"^has more than 100 million pixels"):
        load_plan(tmp_path / "plan.png", 1)


@pytest.mark.parametrize("kind", ["JPEG", "PNG", "TIFF"])
def test_damaged_images_raise_nothing_else(tmp_path: Path, kind: str) -> None:
    clean, rng = plan_bytes(kind), np.random.default_rng(5)
    outcomes = set()
    for _ in range(500):
        (tmp_path / "plan.jpg").write_bytes(mutate(clean, rng))
        try:
            load_plan(tmp_path / "plan.jpg", 1)
            outcomes.add("loaded")
        except OSError as error:
            outcomes.add(str(error))
    assert "cannot be read as an image" in outcomes
