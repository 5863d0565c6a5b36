"""Studies: files that name the models, conditions and repeats of a whole evaluation, and the runs that follow."""
