"""`amontons` and `python -m amontons` are the command line."""

import sys

from .interrupts import watch


def run() -> None:
    """The command line; Ctrl-C is watched before the first large import."""
    try:
        watch()
        from .cli import main

        main()
    except KeyboardInterrupt:
        sys.exit(130)


if __name__ == "__main__":
    run()
