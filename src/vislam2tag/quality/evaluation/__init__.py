"""How good labels are, against truth.

A ``truth`` is of the whole walk (``trajectory_files``, ``dense``), presses at control points (``press_identity``,
``press_truth``) or a total station's track (``station_frame``, ``station_clock``, ``station_errors``). ``metrics``
reduces errors to figures of a walk and of many, ``record`` and ``text`` are what is kept. ``odd_truth`` finds truths
that walks contradict, ``reliability`` whether stated uncertainty is true; ``paper`` follows the paper's own rules.
"""
