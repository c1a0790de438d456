"""The survey: a site with floors, landmarks and control points, and where its sessions lie."""
