"""Parts of the model cell-density.

``scan_kernels`` compares scans, solves for densities over cells and for storeys, and removes scans with a contradicted
storey. ``level_field`` predicts levels at places without scans, and ``novelty`` measures how unlike the training set a
scan is. ``density_model`` combines them, and ``torch_module`` does the same in PyTorch. ``local-kriging`` also uses the
kernels and the regression onto storeys.
"""
