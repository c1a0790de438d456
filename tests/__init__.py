"""All tests; linear algebra takes one thread, since several processes test at once and waiting threads keep cores busy.

Read when NumPy and PyTorch are first imported, so this must come before.
"""

import os

for _name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS"):
    os.environ.setdefault(_name, "1")
