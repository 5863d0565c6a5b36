"""The web application: pages of runs, trajectories, play, review and houses, served on loopback.

Pages are rendered on the server; they need neither the internet nor a build step. A model's text is shown as text,
never as HTML. A person who plays uses a separate server, which does not have pages with hidden state.
"""
