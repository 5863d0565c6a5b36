"""VIGIL as an OpenEnv environment: `vigil serve` in the form in which OpenEnv starts a server."""

import sys

from vigil.cli import main as vigil

ARGUMENTS = ["serve", "starter", "--name", "openenv", "--training", "--epochs", "10000", "--max-sessions", "32"]


def main() -> None:
    """Serve the starter pack for training. Options that follow the command are added to those above."""
    sys.argv = ["vigil", *ARGUMENTS, *sys.argv[1:]]
    vigil()


if __name__ == "__main__":
    main()
