"""The interface to the renderer: libLLVM, the Mitsuba variant, threads, Ctrl-C, device arrays and
low-discrepancy sequences.

These modules do not depend on sensors. `variant` and `llvm` must be used before Mitsuba is
imported; the other modules import it.
"""
