"""What cell-density is made of.

Scans are compared by ``scan_kernels``; ``mislabelled_storeys`` leaves out those whose storey the others contradict;
``kernel_regression`` solves for densities over ``density_cells`` and for storeys. ``path_loss`` and ``level_field`` say
what is heard where nobody was, ``novelty`` how unlike a scan is to all that was learned. ``density_model`` puts them
together; ``torch_module`` says it in PyTorch. ``local-kriging`` uses the kernels and the regression onto storeys, too.
"""
