"""What every long job needs.

``selection`` says which sessions, ``keys`` what a kept result follows from. ``workers`` runs jobs in processes of this
machine, ``dask`` on a cluster. ``output`` is the output folder, here or in a store, with each session's files,
``claims`` gives it to one run at a time; ``failures`` reports and logs what nobody expected.
"""
