"""The web application: pages of runs, trajectories, play, review and houses, served on loopback.

Pages are rendered on the server and need neither internet nor a build step. A model's text is shown as text, never as
HTML. A person who plays gets a separate server, which has no page with hidden state.
"""
