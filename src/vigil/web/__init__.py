"""The web application: runs, trajectories, play, review and houses as pages on loopback.

Pages are rendered on the server and work without internet and without a build step. What a model wrote is shown as
text, never as HTML. Whoever plays gets a server of its own that knows no page with hidden state.
"""
