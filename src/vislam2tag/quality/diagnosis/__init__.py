"""What is wrong with a survey, found from the walks alone, with the lines that correct it (docs/how-to/diagnosis.md).

Each walk is laid onto the plan (``alignment``); all walks together are the ``evidence``. ``table_faults`` proposes
hypotheses, of which the ``search`` believes those that make the walks fit clearly better. ``turned_tables``,
``stream_faults``, ``wifi_clock`` and ``id_faults`` find what walks alone cannot show. ``record`` is what is kept.
"""
