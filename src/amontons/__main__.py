"""`amontons` and `python -m amontons` are the command line."""

import gc
import os
import signal
import sys

from .core.interrupts import watch


def run() -> None:
    """The command line; Ctrl-C is watched before the first large import."""
    try:
        watch()
        from .app.cli import main

        main()
    except KeyboardInterrupt:
        sys.exit(130)
    finally:  # all is done: what Python still clears away is nothing to interrupt
        signal.signal(signal.SIGINT, signal.SIG_IGN)
        gc.freeze()  # nor to search for cycles, which takes as long as a small solve


if __name__ == "__main__":
    if not sys.flags.safe_path and os.path.abspath(sys.path[0]) == os.getcwd():
        del sys.path[0]  # `python -m` adds the current folder: cases may name modules
    run()
