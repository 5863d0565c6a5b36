"""Studies: a study's file names the models, conditions and repeats of a whole evaluation, and thereby its runs."""
