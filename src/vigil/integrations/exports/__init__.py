"""Export of runs to the formats of other tools: a dataset folder, and results for databases of evaluations.

The same run always gives the same files. Hidden state stays in the run's folder and is not exported: it is the answer
key of a pack, and published text ends up in training data.
"""
