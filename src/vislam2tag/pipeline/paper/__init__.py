"""The paper's tables and figures from its data.

``data`` finds its surveys, evaluates walks (Tables I and II), and labels and counts fingerprints (Table III).
``figures`` draws, and ``reproduce`` runs all steps and trains models (Table IV).
"""
