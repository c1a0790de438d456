"""What is wrong with a survey, told from the walks alone, with the lines that correct it (docs/how-to/diagnosis.md).

Each walk is reduced to its ``passes`` of landmarks and laid onto the plan (``alignment``); all walks together are the
``evidence``. Each kind of fault in ``faults/`` proposes hypotheses, of which the ``search`` believes those that make
the walks fit clearly better. ``record`` is what is kept of it.
"""
