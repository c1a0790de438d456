"""Label errors before a total station: its files (``station_file``), its frame by common points (``frame``) or presses
(``frame_from_presses``), its clock (``fit``, ``alignment``), then ``station_errors``.
"""
