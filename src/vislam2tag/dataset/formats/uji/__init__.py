"""UJIIndoorLoc's wide tables (Torres-Sospedra et al., IPIN 2014): a column an access point, 100 where not heard.

``trainingData.csv`` and ``validationData.csv``; numbers stand for buildings, users and phones, which tables beside
ours tell by name.
"""

from vislam2tag.dataset.format_registry import register
from vislam2tag.dataset.formats.uji.reading import READS
from vislam2tag.dataset.formats.uji.writing import WRITES

register(READS, WRITES)
