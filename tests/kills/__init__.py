"""Commands that are killed at random moments, the files that they leave, and their repetition.

`work` names the commands and tells what of their results must be equal, `killing` kills one and
judges what it left, and `python -m tests.kills` (`make kill-tests`) does so as often as it is told
and counts.
"""
