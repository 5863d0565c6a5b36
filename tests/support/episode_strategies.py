"""Episodes of every family and course, drawn by hypothesis."""

from hypothesis import strategies as st

from tests.support.published_runs import PUBLISHED, EpisodeScript, can_advance, make_episodes
from vigil.protocol.actions import STATUSES

EPISODES = {one.family: one for one in make_episodes(1)}
SCRIPTS = st.builds(
    EpisodeScript,
    family=st.sampled_from(sorted(PUBLISHED)),
    w=st.booleans(),
    end=st.sampled_from([*STATUSES, "NR", "IL"]),
    wait=st.integers(0, 3),
    advanced=st.booleans(),
).map(lambda plot: plot if can_advance(plot.family) else EpisodeScript(plot.family, plot.w, plot.end, plot.wait))
