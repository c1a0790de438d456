"""Pages and figures of what was computed, from results alone.

``page`` writes an HTML page from a template; ``layers`` makes what its maps and charts draw, ``floor_map`` the map of a
floor. ``run_summary`` reduces a run to a few numbers, which ``run_report`` shows with ``uncertainty``; the modules
called ``*_page`` or ``*_pages`` are the pages of other commands. ``panels`` is the style of figures in print, which the
modules called ``*_figures`` draw; ``notebook`` draws single values.
"""
