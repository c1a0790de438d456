"""Logs of GetSensorData (CSIC), as the IPIN competitions publish them: log file -> taps and tables -> walks."""

from vislam2tag.dataset.format_registry import register
from vislam2tag.dataset.formats.getsensordata.reading import READS

register(READS)
