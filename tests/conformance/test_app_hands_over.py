"""The app's own upload client against ``vislam2tag receive``, over loopback."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.cli.collect.test_command_receive import large_session, receiving
from tests.conformance.java import upload
from tests.receiving.zips import SESSION, digest, session_zip

pytestmark = pytest.mark.slow

PLACE = f"floor_4/LG/{SESSION}"


def test_the_app_hands_a_session_over_and_goes_on_where_it_broke_off(core: Path, tmp_path: Path) -> None:
    path = tmp_path / "session.zip"
    path.write_bytes(large_session())
    survey = tmp_path / "survey"
    survey.mkdir()
    with receiving(survey) as computer:
        half = path.stat().st_size // 2
        assert computer.bring(path.read_bytes(), 0, half).json()["received"] == half
        done = upload(core, f"vislam2tag://{computer.host}/#{computer.token}", path)
        assert (done.returncode, done.stdout.strip()) == (0, PLACE), done.stderr
        assert computer.state(digest(path.read_bytes()))["state"] == "filed"
        again = upload(core, f"vislam2tag://{computer.host}/#{computer.token}", path)
        assert (again.returncode, again.stdout.strip()) == (0, PLACE), again.stderr
    assert (survey / PLACE / "Sensors.csv").is_file()


def test_the_app_tells_why_a_session_is_refused(core: Path, tmp_path: Path) -> None:
    path = tmp_path / "session.zip"
    path.write_bytes(session_zip(CameraPose_csv=b"other"))
    survey = tmp_path / "survey"
    survey.mkdir()
    with receiving(survey) as computer:
        wrong = upload(core, f"vislam2tag://{computer.host}/#{'A' * 16}", path)
        assert wrong.returncode == 1
        assert "WRONG_TOKEN" in wrong.stderr
        refused = upload(core, f"vislam2tag://{computer.host}/#{computer.token}", path)
        assert refused.returncode == 1
        assert "REFUSED" in refused.stderr
        assert "checksum of CameraPose.csv" in refused.stderr
    assert not (survey / "floor_4").exists()
