"""What every test stands on."""

from __future__ import annotations

import signal

if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:  # started in the background: children would inherit deafness for Ctrl-C
    signal.signal(signal.SIGINT, signal.default_int_handler)
