#!/bin/sh
# What to do after the set-up and after the demo: lines that work when they are pasted.
cat <<'LINES'

    . .venv/bin/activate
    optisense render gelsight-mini --contact cylinder:1,3@2,1:0.6 --out touch
    python -c 'import optisense as ots; print(*ots.load("gelsight-mini").parts)'

More to try: README.md, and your own sensor in docs/your-sensor.md.
LINES
