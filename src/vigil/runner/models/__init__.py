"""Models: how the server of a model is reached, and how its answers are read.

Inspect brings the providers' clients. These parts work around what it does by itself, and each is still needed:

- `response_capture` notes the bytes of answers, because Inspect removes reasoning from texts and joins parts.
- `network.disable_redirects` changes clients, because those that Inspect makes follow redirects and take a key along.
- `access.hiding_other_keys` empties the environment, because clients read keys from it even when given another.
- `inspect_model`: a sink drops Inspect's events, which would keep every frame in memory, and the log gets a copy of the
  model without secrets.
- `vigil.runner.inspect_task`: connections are closed by the last episode, because Inspect leaves them open and ends the
  event loop; garbage is collected rarely, because that took a quarter of the time; a run that was interrupted raises
  KeyboardInterrupt again; a warning of pydantic about unusual answers is hidden.
"""
