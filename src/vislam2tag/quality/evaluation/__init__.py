"""How good labels are, against truth.

A ``truth`` is of the whole walk (``trajectory_files``, ``dense``), presses at control points (``press_truth``) or a
total station's track (``station_frame``, ``station_clock``). ``metrics`` reduces errors to figures of a walk and of
many, and to tables; ``record`` is what is kept. ``odd_truth`` finds truths that walks contradict, ``reliability``
whether stated uncertainty is true; ``paper`` follows the paper's own rules.
"""
