"""Printable landmarks: images that a tracker recognises, on sheets of true size.

``settings`` has the sizes of paper, ``sheet_requests`` says which landmarks get a sheet, ``images`` makes or reads
their images, ``features`` measures how well they are recognised in simulated views. ``page`` puts them on paper;
``sheet_folder`` takes all these steps.
"""
