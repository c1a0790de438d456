"""What every long job needs.

``selection`` says which sessions, ``keys`` what a kept result follows from. ``workers`` runs jobs in processes of this
machine, ``dask`` on a cluster. ``output`` is the output folder, here or in a store, ``claims`` gives it to one run at a
time, ``session_files`` writes a session's files into it; ``failures`` reports and logs what nobody expected.
"""
