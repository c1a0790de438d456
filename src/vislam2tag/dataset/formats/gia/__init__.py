"""giaIndoorLoc's labelled layout: annotated tables by floor, phone and session, written from labels and read."""

from vislam2tag.dataset.format_registry import register
from vislam2tag.dataset.formats.gia.reading import READS
from vislam2tag.dataset.formats.gia.writing import WRITES

register(READS, WRITES)
