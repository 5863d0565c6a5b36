"""`python -m vigil.thor`: the engine; AI2-THOR's client starts it."""

import sys

from vigil.thor.serve import main

if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
