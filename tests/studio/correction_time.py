"""From a saved correction to new labels: ``python -m tests.studio.correction_time``.

A survey of four walks of three minutes; a span of one is left out, and put back, ten times in all. Timed is from the
request that saves the text to the event that tells of the labels, with one worker, on whatever machine this is.
"""

from __future__ import annotations

import os
import statistics
import time
from pathlib import Path
from tempfile import TemporaryDirectory

from tests.studio.running import running_studio
from tests.surveys import make_survey
from vislam2tag.pipeline.labels.process import process

ROUNDS = 10


def main() -> None:
    """Print the times."""
    with TemporaryDirectory() as scratch:
        survey, labels = Path(scratch) / "survey", Path(scratch) / "labels"
        make_survey(survey, floors=2, seconds=180.0, severity="default")
        process(survey, labels)
        with running_studio(survey, "--labels", str(labels), "--jobs", "1") as page:
            page.enter()
            session = page.get("/api/sessions")["sessions"][0]
            values = {**session["folder"], "from_s": 60.0, "to_s": 70.0}
            changes = [{"action": "add", "table": "exclude_span", "values": values}]
            text = page.post("/api/corrections/preview", {"changes": changes})["text"]
            events, seconds, version = page.events(), list[float](), ""
            next(events)
            for number in range(ROUNDS):
                started = time.monotonic()
                version = page.save(text if number % 2 == 0 else "", version).json()["version"]
                page.post("/api/jobs", {"kind": "process", "sessions": [session["id"]]})
                next(content for name, content in events if name == "labels")
                seconds.append(time.monotonic() - started)
            events.close()  # type: ignore[attr-defined]
    print(f"median {statistics.median(seconds):.2f} s, greatest {max(seconds):.2f} s, of {ROUNDS}")
    print(f"load of the machine {os.getloadavg()[0]:.1f} on {os.cpu_count()} cores")


if __name__ == "__main__":
    main()
