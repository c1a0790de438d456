"""Indoor Location Competition 2.0: folders of sites -> trace files -> walks."""

from vislam2tag.dataset.format_registry import register
from vislam2tag.dataset.formats.ilc20.reading import READS

register(READS)
