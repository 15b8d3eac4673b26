"""`python -m hystgen.cli`: the command line."""

import sys

from hystgen.cli import main

if __name__ == "__main__":
    sys.exit(main())
