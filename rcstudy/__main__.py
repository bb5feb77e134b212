"""``python -m rcstudy``."""

import os
import sys

from rcstudy.cli import EXIT_INTERRUPTED, main

if __name__ == "__main__":
    try:
        main()
    except SystemExit as leaving:
        if leaving.code == EXIT_INTERRUPTED:
            # Ctrl-C inside exec() of text (any dataclass being made) stays "unhandled" to CPython even when it was
            # caught, and `python -m` would then end by SIGINT in place of this code; all is cleaned up by now
            sys.stdout.flush()
            sys.stderr.flush()
            os._exit(EXIT_INTERRUPTED)
        raise
