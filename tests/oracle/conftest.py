"""The modules of this folder import each other by name."""

import os
import sys
from pathlib import Path

# Matrices are small: threads of the linear algebra only wait for each other.
os.environ.setdefault("OMP_NUM_THREADS", "1")
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

sys.path.insert(0, str(Path(__file__).parent))
