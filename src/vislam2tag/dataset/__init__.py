"""Data sets of fingerprints: what they are, made of labels or of others' files, described, compared and given away.

In the order in which data meet the packages: ``schema`` and ``model`` say what a data set is, ``folder`` how it lies on
disk, and ``by_session`` reads it walk by walk. ``fingerprinting`` and ``inertial`` make its rows of labels,
``transmitters`` its table of access points (and their privacy), ``splitting`` its training and test parts.
``device_offsets``, ``statistics``, ``coverage`` and ``radio_mapping`` say what it amounts to, ``description`` and
``card`` tell others. ``formats`` read and write those of the field, with what several share in ``reading`` and
``writing``; ``comparing`` tells two sets apart and joins them.
"""
