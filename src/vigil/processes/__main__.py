"""`python -m vigil.processes FD`: a worker process; `vigil.processes.worker` starts it."""

import faulthandler
import sys
from multiprocessing.connection import Connection

from vigil.base.imports import import_modules_from_environment
from vigil.processes.child import serve

if __name__ == "__main__":
    faulthandler.enable()
    with Connection(int(sys.argv[1])) as connection:
        sys.path += [folder for folder in connection.recv() if folder not in sys.path]
        import_modules_from_environment()
        serve(connection, connection.recv_bytes())
