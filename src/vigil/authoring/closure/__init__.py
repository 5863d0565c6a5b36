"""The closure-stress suite: its tasks, the certificates that prove their answers, and the functions that propose
tasks.
"""
