"""COMFORD's intermediate format (Ferrato et al., IPIN 2026): ``Samples.csv``, ``RSSI.csv``, ``APs.csv``.

Columns stand as the package's own loader takes them, by position; its documentation names some otherwise.
"""

from vislam2tag.dataset.format_registry import register
from vislam2tag.dataset.formats.comford.reading import READS
from vislam2tag.dataset.formats.comford.writing import WRITES

register(READS, WRITES)
