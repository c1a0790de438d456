from __future__ import annotations

import json
from pathlib import Path

from vislam2tag.studio.openapi import openapi

FILE = Path(__file__).parents[2] / "studio" / "openapi.json"


def test_the_file_that_the_page_is_built_with_is_that_of_the_server() -> None:
    """``python -m vislam2tag.studio.openapi studio/openapi.json`` writes it anew; then ``npm run types`` in studio/."""
    assert json.loads(FILE.read_text(encoding="utf-8")) == openapi()


def test_every_reference_leads_somewhere() -> None:
    described = openapi()
    text = json.dumps(described)
    names = {part.partition('"')[0] for part in text.split('"#/components/schemas/')[1:]}
    assert names == names & described["components"]["schemas"].keys()
    assert len(described["paths"]) > 15
