"""HTML pages and figures of results.

``page`` writes an HTML page from a template. ``layers`` creates the traces of maps and charts, ``floor_map`` a floor's
map. ``run_summary`` reduces a run to a few numbers, which ``run_report`` shows with ``uncertainty``. Modules called
``*_page`` or ``*_pages`` write the pages of other commands. ``panels`` defines the style of print figures, which the
``*_figures`` modules draw, and ``notebook`` draws single values.
"""
