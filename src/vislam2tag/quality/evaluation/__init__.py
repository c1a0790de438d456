"""How good labels are, against truth.

A ``truth`` is dense (``trajectory_files``, ``dense``), presses at control points (``control_points``) or a total
station's track (``total_station``); each becomes ``point_errors``. ``metrics`` reduces them to a walk's ``record``,
``pooling`` sums walks up to rows, ``text`` writes them. ``reliability`` tells whether stated uncertainty is true;
``paper`` follows the paper's own rules.
"""
