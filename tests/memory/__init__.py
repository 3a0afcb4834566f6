"""Work that is done again and again in one process: memory and open files stay bounded.

`work` does it and measures, and `python -m tests.memory` does so as often as it is told.
"""
