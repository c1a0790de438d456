"""What cell-density is made of.

Scans are compared by ``scan_kernels``, which also solve for densities over cells and for storeys, and leave out scans
whose storey the others contradict. ``level_field`` says what is heard where no one was, ``novelty`` how unlike a scan
is to all that was learned. ``density_model`` puts them together; ``torch_module`` says it in PyTorch. ``local-kriging``
uses the kernels and the regression onto storeys, too.
"""
