"""Simulated sessions as files: a ``session`` is spoilt by ``table_traps``, written (``writer``: the published layout;
``phone_log``, ``phone_script``: the phone app's) and spoilt again by ``text_traps``; ``traps`` names them all.
``site_files`` writes the site's own files.
"""
