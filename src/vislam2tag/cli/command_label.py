"""``vislam2tag label``."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from vislam2tag.cli.next_steps import next_step
from vislam2tag.cli.options import AsJson, one_of
from vislam2tag.cli.records import argument, command, option
from vislam2tag.cli.terminal import answer, say

if TYPE_CHECKING:
    import polars as pl

    from vislam2tag.pipeline.labels.label_table import TableLabels


@dataclass(frozen=True, kw_only=True)
class LabelOptions:
    """Arguments and options of ``vislam2tag label``."""

    table: Path = argument("CSV or Parquet with a column of times.")
    labels: Path = option(..., "Output folder of process.", metavar="FOLDER")
    out: Path | None = option(
        None, "Where to write, .csv or .parquet; else TABLE-labelled beside TABLE.", metavar="FILE"
    )
    time_column: str | None = option(None, "The column of times.", metavar="NAME")
    clock: str | None = option(
        None, "What times count from: boot or unix.", metavar="CLOCK", parse=one_of("boot", "unix")
    )
    unit: str | None = option(
        None, "Of times as numbers: s, ms, us or ns.", metavar="UNIT", parse=one_of("s", "ms", "us", "ns")
    )
    zone: str | None = option(None, "Of dates that name none, such as Europe/Berlin.", metavar="ZONE")
    offset_s: float | None = option(None, "How far the table's clock is ahead of boot.", metavar="SECONDS")
    align: str | None = option(
        None, "Find the clock by motion or by levels (Wi-Fi), whatever its times look like.", metavar="BY"
    )
    session: str | None = option(None, "Only walks whose name in labels/sessions holds this.", metavar="NAME")
    survey: Path | None = option(None, "The raw survey: the phone app noted both its clocks.", metavar="SURVEY")
    json: AsJson = False


@command
def label_command(given: LabelOptions) -> None:
    """Give any time-stamped table the positions of the walks it was taken on: BLE, UWB, CO2, 5G, whatever was logged.

    TABLE is CSV (; , or tab) or Parquet with a column of times: since the phone's boot (ns, us, ms, s), Unix times, or
    ISO 8601 with a zone; which one is found by name and magnitude, and printed. Its rows stay as they are and get x_m,
    y_m, z_m, floor, sigma and status; rows outside a walk are counted and have no position.

    Unix times, dates and the clocks of other devices need to know how far they are ahead of the phone's boot clock:
    --survey takes it from what the phone app recorded; a table with a gyroscope or accelerometer (gyro_x, ...) is
    aligned by the motion that both felt, one with bssid and rssi by the access points that both heard, with the sigma
    of that, which the positions' sigma then holds; else --offset-s. What is not clear is refused with its figures.

    Exit code: 0 all right, 1 no row has a position, 2 wrong usage, no labels, or a table or clock that is not
    understood.

    \b
    Examples:
      vislam2tag label ble.csv --labels labels
      vislam2tag label co2.parquet --labels labels --survey survey \\
          --out co2-labelled.parquet
      vislam2tag label headset.csv --labels labels --align motion --session LG
      vislam2tag label uwb.csv --labels labels --clock boot --unit ms \\
          --session LG
    """
    from vislam2tag.pipeline.labels.label_table import label

    made = label(
        given.table,
        given.labels,
        time_name=given.time_column,
        clock=given.clock,
        unit=given.unit,
        zone=given.zone,
        offset_s=given.offset_s,
        align=given.align,
        session=given.session,
        survey=given.survey,
    )
    written = given.out or given.table.with_name(f"{given.table.stem}-labelled{given.table.suffix}")
    _write(made.table, written)
    found = {"written": written, "rows": made.table.height, "notes": made.notes, "counts": made.counts}
    labelled = made.table["x_m"].count()
    answer(found, given.json, lambda: _print(made, labelled, written, given.labels), failed=not labelled)


def _print(made: TableLabels, labelled: int, written: Path, labels: Path) -> None:
    from vislam2tag.core.status import Status

    for sentence in made.notes:
        say(sentence)
    outside = made.counts.get(Status.OUTSIDE_FRAMES.label, 0)
    say(f"{made.table.height} rows: {labelled} have a position, {outside} lie outside every walk")
    for status, count in made.counts.items():
        say(f"  {status}: {count}")
    say(f"written: {written}")
    next_step("label" if labelled else "label, nothing", labels=labels)


def _write(table: pl.DataFrame, path: Path) -> None:
    from vislam2tag.common.files.table_files import parquet_bytes
    from vislam2tag.common.files.whole_file import write_file

    write_file(path, parquet_bytes(table) if path.suffix.lower() == ".parquet" else table.write_csv())
