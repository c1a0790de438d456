"""Common parts of all long jobs.

``selection`` chooses sessions, ``keys`` describes the inputs of kept results. ``workers`` runs jobs in processes of
this machine, ``dask`` on a cluster. ``output`` is the output folder, here or in a store, with each session's files.
``claims`` gives it to one run at a time; ``failures`` reports and logs unexpected errors.
"""
