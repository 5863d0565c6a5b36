"""Training with verl: an agent loop that plays VIGIL's episodes, and the rows of a data set that name them.

`VigilAgentLoop` is in the module `agent_loop`, which needs verl; the rows do not need it.
"""

from vigil.integrations.options import VerlOptions
from vigil.integrations.verl.rows import write_rows

__all__ = ["VerlOptions", "write_rows"]
