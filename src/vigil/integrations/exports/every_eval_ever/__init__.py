"""Export of results in the schema of Every Eval Ever, the EvalEval coalition's database of evaluations.

Source: schema 0.3.0 of the package `every-eval-ever`, https://github.com/evaleval/every_eval_ever. The package's
validator is run by hand (`docs/export.md`). The tests validate the output against copies of the package's two schemas.
"""
