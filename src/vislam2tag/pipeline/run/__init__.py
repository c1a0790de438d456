"""What every long job needs.

``selection`` says which sessions, ``keys`` what a kept result follows from, ``workers`` runs processes, ``store`` is
the output folder, claimed by one run at a time; ``failures`` reports and logs what nobody expected.
"""
