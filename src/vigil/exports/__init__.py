"""Export of runs to the formats of other tools: a dataset folder, and results for databases of evaluations.

The same run always gives the same files. Hidden state is left out: it is the answer key of a pack, and published
text ends up in training data. It stays in the run's folder.
"""
