"""HDF5 matrices for training: columns of a table, filled piece by piece, and windows beside."""

from vislam2tag.dataset.format_registry import register
from vislam2tag.dataset.formats.hdf5.writing import WRITES

register(writes=WRITES)
