"""The renderer's ground floor: libLLVM, the Mitsuba variant, threads, Ctrl-C, device arrays and
low-discrepancy sequences.

Nothing here knows what a sensor is. `variant` and `llvm` must be used before Mitsuba is imported;
the other modules import it.
"""
