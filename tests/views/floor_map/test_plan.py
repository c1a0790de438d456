from __future__ import annotations

import base64
import io
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from vislam2tag.survey.model import ControlPoints, Floor
from vislam2tag.views.floor_map import MAX_PIXELS, plan_data_uri


def floor_with(plan: Path) -> Floor:
    return Floor(1, "Floor 1", 20.0, 10.0, None, plan, ControlPoints((), np.empty((0, 2))))


def decoded(uri: str) -> Image.Image:
    head, data = uri.split(",", 1)
    assert head == "data:image/jpeg;base64"
    return Image.open(io.BytesIO(base64.b64decode(data)))


@pytest.mark.parametrize("name", ["plan.jpg", "plan.png", "plan.bmp"])
def test_large_plan_is_scaled_and_keeps_its_shape(tmp_path: Path, name: str) -> None:
    Image.new("RGB", (3000, 1500), "red").save(tmp_path / name)
    image = decoded(plan_data_uri(floor_with(tmp_path / name)))
    assert image.size == (MAX_PIXELS, MAX_PIXELS // 2)
    red, green, blue = image.convert("RGB").resize((1, 1)).tobytes()
    assert red > 240
    assert max(green, blue) < 20


def test_small_plan_keeps_its_size(tmp_path: Path) -> None:
    Image.new("L", (40, 20), 128).save(tmp_path / "plan.png")
    assert decoded(plan_data_uri(floor_with(tmp_path / "plan.png"))).size == (40, 20)


def test_transparent_plan_lies_on_white(tmp_path: Path) -> None:
    Image.new("RGBA", (40, 20), (0, 0, 0, 0)).save(tmp_path / "plan.png")
    assert decoded(plan_data_uri(floor_with(tmp_path / "plan.png"))).convert("L").tobytes() == b"\xff" * 800


@pytest.mark.parametrize("content", [b"", b"no image", b"\xff\xd8\xff\xe0half a JPEG"])
def test_unreadable_plan_is_an_error(tmp_path: Path, content: bytes) -> None:
    (tmp_path / "plan.jpg").write_bytes(content)
    for name, message in (("plan.jpg", "cannot be read as an image"), ("missing.jpg", "is not there")):
        with pytest.raises(OSError, match=message):
            plan_data_uri(floor_with(tmp_path / name))


def test_cut_off_plan_is_an_error(tmp_path: Path) -> None:
    whole = tmp_path / "whole.png"
    Image.effect_noise((300, 300), 60).save(whole)
    (tmp_path / "half.png").write_bytes(whole.read_bytes()[:20_000])
    with pytest.raises(OSError, match="cannot be read as an image"):
        plan_data_uri(floor_with(tmp_path / "half.png"))
