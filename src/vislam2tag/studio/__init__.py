"""The studio: a page in the browser on the functions of the command line (docs/project/architecture.md).

A request comes through ``guard`` (who may ask) and ``app`` to one of ``endpoints``, whose answers are the domain's
records and those of ``messages`` and ``work_messages``. They are made of the ``workspace``, what survey and labels
(``outputs``) hold now, by ``survey_view``, ``session_view``, ``corrections_view``, ``radio`` and the ``layers``.
``preparing`` and ``planning`` prepare a survey, ``collecting`` takes sessions over from phones (``receiving``).
``jobs`` map sessions again, ``events`` tell all pages of it. ``export`` and ``fleet`` write pages of files. ``page/``
is what the browser loads, built from ``studio/`` at the root of the repository.
"""
