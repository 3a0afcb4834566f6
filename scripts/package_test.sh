#!/bin/sh
# Build the wheel, install it in an empty environment outside this folder, and render there. Run it
# by `make package-test`, which builds the Blender extension first, to compare.
set -eu
cd "$(dirname "$0")/.."
root=$(pwd)
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
say() { printf '\n== %s\n' "$*"; }

say "Building the wheel"
.venv/bin/python -m pip wheel --quiet --disable-pip-version-check --no-deps \
    --no-build-isolation --wheel-dir "$work" .

say "Installing it in an empty environment"
.venv/bin/python -m venv "$work/venv"
sed -n 's/ \\$//; s/^[a-z0-9].*==.*/&/p' requirements.lock > "$work/constraints.txt"
"$work/venv/bin/python" -m pip install --quiet --disable-pip-version-check --no-input \
    --constraint "$work/constraints.txt" "$work"/optisense-*.whl

say "Taking the Blender extension out of it"
cd "$work"
"$work/venv/bin/optisense" studio --zip "$work/studio.zip"
cmp "$work/studio.zip" "$root/dist/optisense_studio.zip"

say "Rendering with it"
"$work/venv/bin/optisense" doctor
"$work/venv/bin/optisense" render gelsight-mini --contact sphere:1.5@0,0:0.8 \
    --resolution 80x60 --photons 100000 --out "$work/render"
for file in image.png radiance.exr normals.npy contact_mask.npy run.json report.html; do
    [ -s "$work/render/$file" ] || { echo "the render lacks $file" >&2; exit 1; }
done
say "The package is in order"
