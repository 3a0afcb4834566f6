#!/bin/sh
# Set up .venv-blender: Blender as a Python module, in which the extension's tests run. It needs
# Python 3.11 on Linux, which is what those modules are built for, and some libraries of a desktop.
# With a version as argument (4.2, 5.0) it sets up that Blender in .venv-blender-VERSION.
set -eu
cd "$(dirname "$0")/.."
version=${1:-}
venv=.venv-blender${version:+-$version}
unset PYTHONHOME PYTHONPATH VIRTUAL_ENV

say() { printf '%s\n' "$*"; }
fail() { printf 'set-up of Blender: %s\n' "$*" >&2; exit 1; }

fits='import sys; sys.exit(sys.version_info[:2] != (3, 11))'
python=
for candidate in ${BLENDER_PYTHON:-} python3.11 python3 /usr/bin/python3.11; do
    if command -v "$candidate" >/dev/null 2>&1 && "$candidate" -c "$fits" >/dev/null 2>&1; then
        python=$candidate
        break
    fi
done
[ -n "$python" ] || fail "Python 3.11 is needed, exactly: Blender's module is built for it.
Install it, or name one: make BLENDER_PYTHON=/path/to/python3.11 studio-tests"

if ! "$venv/bin/python" -c "$fits; import pip" >/dev/null 2>&1; then
    say "Making the virtual environment $venv ..."
    "$python" -m venv --clear "$venv"
fi
say "Installing Blender's Python module into $venv (350 MB the first time) ..."
install() { "$venv/bin/python" -m pip install --quiet --disable-pip-version-check --no-input "$@"; }
if [ -n "$version" ]; then
    pytest=$(sed -n 's/^\(pytest==[^ ]*\).*/\1/p' requirements-blender.lock)
    install "bpy==$version.*" "$pytest"
else
    install --require-hashes --requirement requirements-blender.lock
fi

# --- libraries of a desktop that the module links to -------------------------------------------
loads() { timeout 120 "$venv/bin/python" -c 'import bpy' >/dev/null 2>&1; }
libraries="libgl1 libx11-6 libxext6 libxfixes3 libxi6 libxrender1 libxkbcommon0 libsm6 libice6 libegl1"
if ! loads && command -v apt-get >/dev/null 2>&1; then
    as_root=
    [ "$(id -u)" -eq 0 ] || as_root=sudo
    say "Installing $libraries ..."
    $as_root apt-get update -qq || say "set-up of Blender: the package lists could not be refreshed"
    # shellcheck disable=SC2086
    $as_root env DEBIAN_FRONTEND=noninteractive \
        apt-get install -y -qq --no-install-recommends $libraries >/dev/null || true
fi
loads || fail "'$venv/bin/python -c \"import bpy\"' fails. It needs: $libraries"

touch "$venv/.set-up"
say "Blender's module is set up."
