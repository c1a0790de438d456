"""Rules about input values, which apply to every file, format and network.

A rule names the value, its unit, its range, and the finding (with cause and cure) for values outside the range. Readers
apply these rules and have no ranges of their own, except where the specification of their format differs.

- ``readings``: addresses, signal strengths, and the level that means "not heard" in a table.
- ``level_scales``: levels in another form than dBm.
- ``cells``: numbers in text cells, decimal marks, separators, and cells that cannot be read.
- ``table_form`` and ``foreign_table``: tables of other programs as columns of text.
- ``columns``: roles of columns by name and content, or as ``columns.toml`` names them.
- ``time_units``: the unit of times, rounded times, and clocks that were changed by an hour.
- ``sensor_units``: units of accelerations, turn rates, magnetic fields and pressures.
- ``clock_ties``: which ties between the clocks of two recordings are refused, and motion that contradicts one clock.
- ``extents``: how far coordinates may be from their origin, and what floors, landmarks and fingerprints may span.
- ``pose_conventions``: whether poses are those of a walking person, and if not, which other convention explains them;
  ``pose_evidence`` contains the measures for this.
- ``ids``: comparison of two sets of ids that should name the same things, and the closest name for one that is unknown.
"""
