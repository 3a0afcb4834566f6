"""Options of commands, each defined once: its type, unit, bounds, default and help.

The command line makes its options from these models (`optisense.cli.from_options`), and requests to
the engine have their fields (`optisense.engine`). No slow package is imported here.
"""
