"""What every test stands on."""

from __future__ import annotations

import os
import signal

for _name in ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS"):  # as commands and nodes set it: bit for bit, and quicker
    os.environ.setdefault(_name, "1")

if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:  # started in the background: children would inherit deafness for Ctrl-C
    signal.signal(signal.SIGINT, signal.default_int_handler)
