"""The command `vigil`: each verb parses its arguments and calls one function."""

import errno
import io
import os
import sys
from typing import Annotated

import typer

from vigil import __version__
from vigil.base.imports import import_modules_from_environment
from vigil.cli.verbs import Verbs
from vigil.errors import InfrastructureError, VigilError

BAD_INPUT = 2
FAILED = 1
INTERRUPTED = 130

app = typer.Typer(
    name="vigil",
    cls=Verbs,
    help="Evaluates embodied agents from egocentric RGB: did they finish, and do they know?",
    no_args_is_help=True,
    pretty_exceptions_enable=False,
    context_settings={"help_option_names": ["-h", "--help"]},
)


def _print_version(is_wanted: bool) -> None:
    if is_wanted:
        print(f"vigil {__version__}")
        raise typer.Exit


@app.callback()
def _before_a_verb(
    version: Annotated[
        bool, typer.Option("--version", callback=_print_version, is_eager=True, help="Show the version and exit.")
    ] = False,
) -> None:
    """Handle the options that stand before the verb, and import the modules that an environment variable names."""
    import_modules_from_environment()


def main() -> None:
    """Run the command line. Exits with 0, 1 (the command failed), 2 (bad input) or 130 (interrupted)."""
    if isinstance(sys.stdout, io.TextIOWrapper):
        sys.stdout.reconfigure(line_buffering=True)  # so that a file with both outputs has their lines in order
    try:
        app()
    except InfrastructureError as error:
        _die(error, FAILED)
    except VigilError as error:
        _die(error, BAD_INPUT)
    except BrokenPipeError:
        # The reader (head, less) has ended: print nothing more, not even when Python closes its streams.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        sys.exit(FAILED)
    except OSError as error:
        if error.filename is None and error.errno != errno.ENOSPC:
            raise  # the error is not about a file of the user
        where = "" if error.filename is None else f"{str(error.filename)!r}: "
        _die(f"{where}{error.strerror}. Give a place that exists, has space and is writable.", BAD_INPUT)
    except KeyboardInterrupt:
        _say_interrupted()
        sys.exit(INTERRUPTED)
    except SystemExit as end:
        if end.code == INTERRUPTED:  # Typer ends like this after Ctrl-C
            _say_interrupted()
        raise


def _say_interrupted() -> None:
    print("Interrupted. What a run has recorded is kept; the same command continues it.", file=sys.stderr)


def _die(message: VigilError | str, code: int) -> None:
    print(f"vigil: {message}", file=sys.stderr)
    sys.exit(code)
