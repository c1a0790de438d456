"""The studio as static files that only show: what the server would answer is written ahead (docs/how-to/share.md).

``export`` writes the whole folder: page, ``answers`` as JSON and ``tables`` as Parquet, which the page reads by byte
ranges, ``private`` of what nobody else should read; ``fleet`` writes a list of surveys, and each that has labels so.
"""
