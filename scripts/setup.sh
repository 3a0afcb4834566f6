#!/bin/sh
# Set up this folder for work: a virtual environment in .venv with the locked dependencies, and
# the libLLVM that the renderer needs. Touches no other environment. `make` runs it when needed.
set -eu
cd "$(dirname "$0")/.."
root=$(pwd)
venv="$root/.venv"
unset PYTHONHOME PYTHONPATH VIRTUAL_ENV

say() { printf '%s\n' "$*"; }
fail() { printf 'set-up: %s\n' "$*" >&2; exit 1; }

# --- Python 3.11 or newer -------------------------------------------------------------------
fits='import sys; sys.exit(sys.version_info < (3, 11))'
python=
for candidate in ${PYTHON:-} python3 python3.13 python3.12 python3.11 python3.14 \
    /usr/bin/python3; do
    if command -v "$candidate" >/dev/null 2>&1 && "$candidate" -c "$fits" >/dev/null 2>&1; then
        python=$candidate
        break
    fi
done
[ -n "$python" ] || fail "Python 3.11 or newer is needed and none was found.
Install it, then run this again, or name one: make PYTHON=/path/to/python3.12 setup"

# --- how to install system packages -----------------------------------------------------------
as_root=
can_install=no
if command -v apt-get >/dev/null 2>&1; then
    if [ "$(id -u)" -eq 0 ]; then
        can_install=yes
    elif command -v sudo >/dev/null 2>&1 && { sudo -n true 2>/dev/null || [ -t 0 ]; }; then
        can_install=yes
        as_root=sudo
    fi
fi
apt_updated=no
apt_install() { # the first of the named packages that this system offers
    if [ "$apt_updated" = no ]; then
        apt_updated=yes
        $as_root apt-get update -qq || say "set-up: the package lists could not be refreshed"
    fi
    for package in "$@"; do
        if apt-cache show "$package" >/dev/null 2>&1; then
            say "Installing $package ..."
            $as_root env DEBIAN_FRONTEND=noninteractive \
                apt-get install -y -qq --no-install-recommends "$package" >/dev/null && return 0
        fi
    done
    return 1
}

# --- .venv ------------------------------------------------------------------------------------
if ! "$python" -c 'import ensurepip, venv' >/dev/null 2>&1; then
    version=$("$python" -c 'import sys; print("%d.%d" % sys.version_info[:2])')
    if [ "$can_install" = yes ]; then
        apt_install "python$version-venv" python3-venv || true
    fi
    "$python" -c 'import ensurepip, venv' >/dev/null 2>&1 ||
        fail "$python can't make virtual environments. Type: sudo apt-get install python$version-venv"
fi
if ! "$venv/bin/python" -c "$fits; import pip" >/dev/null 2>&1; then
    say "Making the virtual environment .venv ..."
    "$python" -m venv --clear "$venv"
fi
say "Installing the locked dependencies into .venv (a few minutes the first time) ..."
"$venv/bin/python" -m pip install --quiet --disable-pip-version-check --no-input \
    --require-hashes --requirement requirements.lock
"$venv/bin/python" -m pip install --quiet --disable-pip-version-check --no-input \
    --no-deps --no-build-isolation --editable .

# --- system libraries that the renderer needs: libLLVM, and on Linux libatomic ---------------------
renderer_loads() {
    "$venv/bin/python" - "$@" <<'EOF'
import sys
from optisense.errors import OptiSenseError
from optisense.optics.backend.llvm import find_llvm
from optisense.optics.backend.variant import import_renderer
try:
    library = find_llvm()
    import_renderer("mitsuba")
except OptiSenseError as error:
    sys.exit("" if "--quiet" in sys.argv else f"set-up: {error}")
print(f"The renderer will use {library}")
EOF
}
if ! renderer_loads --quiet 2>/dev/null; then
    if [ "$(uname)" = Darwin ]; then
        if command -v brew >/dev/null 2>&1; then
            say "Installing LLVM through Homebrew ..."
            brew install --quiet llvm || true
        fi
    elif [ "$can_install" = yes ]; then
        apt_install libllvm19 libllvm18 libllvm20 libllvm21 libllvm17t64 libllvm17 || true
        apt_install libatomic1 || true
    fi
    renderer_loads || fail "Type the command above, then run make again."
fi

touch "$venv/.set-up"
say "Set-up is done."
