"""The studio: a browser interface to the functions of the command line (docs/project/architecture.md).

A request passes ``guard`` (access control) and ``app`` to one of ``endpoints``. Answers are records of the domain and
of ``messages`` and ``work_messages``. ``survey_view``, ``session_view``, ``corrections_view``, ``radio`` and the
``layers`` create them from the ``workspace``, which is the current state of survey and labels (``outputs``).
``preparing`` and ``planning`` prepare a survey, and ``collecting`` receives sessions from phones (``receiving``).
``jobs`` process sessions again, and ``events`` notify all pages. ``export`` and ``fleet`` write static pages. ``page/``
contains the files for the browser, built from ``studio/`` at the root of the repository.
"""
