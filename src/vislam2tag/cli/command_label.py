"""``vislam2tag label``."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from vislam2tag.cli.next_steps import next_step
from vislam2tag.cli.options import AsJson
from vislam2tag.cli.terminal import say, say_json

if TYPE_CHECKING:
    import polars as pl


HELP = """
Give any time-stamped table the positions of the walks it was taken on: BLE, UWB, CO2, 5G, whatever was logged.

TABLE is CSV (; , or tab) or Parquet with a column of times: since the phone's boot (ns, us, ms, s), Unix times, or ISO
8601 with a zone; which one is found by name and magnitude, and printed. Its rows stay as they are and get x_m, y_m,
z_m, floor, sigma and status; rows outside a walk are counted and have no position.

Unix times, dates and the clocks of other devices need to know how far they are ahead of the phone's boot clock:
--survey takes it from what the phone app recorded; a table with a gyroscope or accelerometer (gyro_x, ...) is aligned
by the motion that both felt, one with bssid and rssi by the access points that both heard, with the sigma of that,
which the positions' sigma then holds; else --offset-s. What is not clear is refused with its figures.

Exit code: 0 all right, 1 no row has a position, 2 wrong usage, no labels, or a table or clock that is not understood.

\b
Examples:
  vislam2tag label ble.csv --labels labels
  vislam2tag label co2.parquet --labels labels --survey survey \\
      --out co2-labelled.parquet
  vislam2tag label headset.csv --labels labels --align motion --session LG
  vislam2tag label uwb.csv --labels labels --clock boot --unit ms \\
      --session LG
"""


def register(app: typer.Typer) -> None:
    """Add the command to the application."""
    app.command("label", help=HELP)(_label)


def _label(
    table: Annotated[Path, typer.Argument(help="CSV or Parquet with a column of times.")],
    labels: Annotated[Path, typer.Option(metavar="FOLDER", help="Output folder of process.")],
    out: Annotated[
        Path | None,
        typer.Option(metavar="FILE", help="Where to write, .csv or .parquet; else TABLE-labelled beside TABLE."),
    ] = None,
    time_column: Annotated[str | None, typer.Option(metavar="NAME", help="The column of times.")] = None,
    clock: Annotated[str | None, typer.Option(metavar="CLOCK", help="What times count from: boot or unix.")] = None,
    unit: Annotated[str | None, typer.Option(metavar="UNIT", help="Of times as numbers: s, ms, us or ns.")] = None,
    zone: Annotated[
        str | None, typer.Option(metavar="ZONE", help="Of dates that name none, such as Europe/Berlin.")
    ] = None,
    offset_s: Annotated[
        float | None,
        typer.Option(metavar="SECONDS", help="How far the table's clock is ahead of boot."),
    ] = None,
    align: Annotated[
        str | None,
        typer.Option(metavar="BY", help="Find the clock by motion or by levels (Wi-Fi), whatever its times look like."),
    ] = None,
    session: Annotated[
        str | None, typer.Option(metavar="NAME", help="Only walks whose name in labels/sessions holds this.")
    ] = None,
    survey: Annotated[
        Path | None, typer.Option(metavar="SURVEY", help="The raw survey: the phone app noted both its clocks.")
    ] = None,
    json: AsJson = False,
) -> None:
    from vislam2tag.common.errors import UsageError
    from vislam2tag.core.status import Status
    from vislam2tag.pipeline.labels.label_table import label

    for option, value, known in (("--clock", clock, ("boot", "unix")), ("--unit", unit, ("s", "ms", "us", "ns"))):
        if value is not None and value not in known:
            raise UsageError(f"{option} {value}: there are {', '.join(known)}")
    made = label(
        table,
        labels,
        time_name=time_column,
        clock=clock,
        unit=unit,
        zone=zone,
        offset_s=offset_s,
        align=align,
        session=session,
        survey=survey,
    )
    written = out or table.with_name(f"{table.stem}-labelled{table.suffix}")
    _write(made.table, written)
    labelled = made.table["x_m"].count()
    if json:
        say_json({"written": written, "rows": made.table.height, "notes": made.notes, "counts": made.counts})
    else:
        for sentence in made.notes:
            say(sentence)
        outside = made.counts.get(Status.OUTSIDE_FRAMES.label, 0)
        say(f"{made.table.height} rows: {labelled} have a position, {outside} lie outside every walk")
        for status, count in made.counts.items():
            say(f"  {status}: {count}")
        say(f"written: {written}")
        next_step("label" if labelled else "label, nothing", labels=labels)
    raise typer.Exit(0 if labelled else 1)


def _write(table: pl.DataFrame, path: Path) -> None:
    from vislam2tag.common.files.table_files import parquet_bytes
    from vislam2tag.common.files.whole_file import write_file

    write_file(path, parquet_bytes(table) if path.suffix.lower() == ".parquet" else table.write_csv())
