"""Models: how the server of a model is reached, and how its answers are read.

Inspect brings the providers' clients. The following parts change what Inspect does by itself; each is still needed:

- `response_capture` notes the bytes of answers, because Inspect removes reasoning from texts and joins parts.
- `network.disable_redirects` changes Inspect's clients. Otherwise they would follow a redirect and send the key to its
  target.
- `access.hiding_other_keys` hides keys in the environment, because clients read them even when given another key.
- `inspect_model`: a sink drops Inspect's events, which would keep every frame in memory, and the log gets a copy of the
  model without secrets.
- `vigil.runner.inspect_task`: the last episode closes the connections, because Inspect leaves them open when it ends
  the event loop. Garbage is collected rarely, because collecting it took a quarter of the time. An interrupted run
  raises KeyboardInterrupt again. A warning of pydantic about unusual answers is hidden.
"""
