"""The work of each command, from folder to folder; ``run`` contains what all long jobs need.

``site`` prepares a survey, ``labels`` labels its sessions, ``datasets`` builds data sets from labels, and
``positioning`` trains models on data sets. ``paper`` and ``demo`` run all steps.
"""
