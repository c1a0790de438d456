"""Landmarks found in a session's pictures, for walks whose app logged poses only.

``pictures`` hands out a session's pictures in grey, ``detectors`` find printed sheets or tags in one of them,
``placing`` tells from the corners where the camera saw them and how surely, and ``search`` does so for a whole session,
looking closely only where a first, quick look found something.
"""
