"""Runs in the forms that other tools read: a dataset's folder, and results for those who collect evaluations.

What is written is the same for the same run. Hidden state is left out: it is the answer key of a pack, and what is
published ends up in training data. It stays in the run's folder, beside the pack.
"""
