"""Raw formats of sessions.

A module registers the format that it is called like, or several that share a reader; ``common/plugins.py`` lists the
names of these. ``phone`` and ``published`` are folders of tables with poses, ``sensor_logger``, ``getsensordata`` and
``ilc20`` have none; ``scanner_apps`` and ``any_tracker`` have poses of other trackers.
"""
