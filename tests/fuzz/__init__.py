"""Malformed input of every kind that OptiSense reads: made, tried and kept.

`strategies` spoils whole files by their schemas, `kinds` and `engine_kind` name the kinds of input
and the door where each is read, `cases` keeps what was found as files in `tests/assets/fuzz`, and
`python -m tests.fuzz` (`make fuzz`) runs for as long as it is told and counts.
"""
