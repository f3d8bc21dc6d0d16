"""python -m certificate_checker c.h5: what the file proves, or why it proves nothing."""

import sys

from . import check

try:
    print(check(sys.argv[1]))
except Exception as reason:  # whatever is wrong with a file, it proves nothing
    sys.exit(f"refused: {reason}")
