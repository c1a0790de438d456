"""Where simulated walks lead: buildings generated, or made of a site.

``ground_plan`` draws corridors and rooms, ``building`` furnishes them. From a site: ``site_survey`` reads it,
``site_paths`` leads its corridors past the landmarks, ``site_building`` makes the building. ``sight`` counts walls on a
line.
"""
