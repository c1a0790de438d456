"""The studio: a page in the browser on the functions of the command line (docs/architecture.md).

A request comes through ``guard`` (who may ask) and ``app`` to one of ``endpoints``, whose answers are the records of
``messages`` and ``work_messages``. They are made of the ``workspace``, what survey and labels hold now, by
``survey_view``, ``session_view``, ``tracks``, ``series``, ``diagnosis_view``, ``comparison`` and the ``layers``.
``jobs`` map sessions again, ``events`` tell all pages of it. ``page/`` is what the browser loads, built from
``studio/`` at the root of the repository.
"""
