"""`python -m vigil.thor`: runs the engine. AI2-THOR's client starts this command."""

import sys

from vigil.thor.serve import main

if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
