#!/bin/sh
# Set up this folder for work: a virtual environment in .venv with the locked dependencies, and
# the libLLVM that the renderer needs. Touches no other environment. `make` runs it when needed.
set -eu
cd "$(dirname "$0")/.."
root=$(pwd)
venv="$root/.venv"
name=set-up
unset PYTHONHOME PYTHONPATH VIRTUAL_ENV
. scripts/system.sh

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
version=$(version_of "$python")

# --- what the machine lacks: seen before anything is downloaded --------------------------------
has_venv() { "$venv/bin/python" -c "import pip; $fits" >/dev/null 2>&1; }
probe() { # run a line of Python with .venv's interpreter, or before that is there with the other
    if has_venv; then set -- "$venv/bin/python" "$1"; else set -- "$python" "$1"; fi
    PYTHONPATH=$root PYTHONDONTWRITEBYTECODE=1 "$1" -c "$2" >/dev/null 2>&1
}
has_llvm() { probe 'from optisense.optics.backend.llvm import find_llvm; find_llvm()'; }
has_atomic() { probe 'from optisense.optics.backend.llvm import load_atomic; load_atomic()'; }
llvm_wheel_fits() { [ "$(uname -sm)" = "Linux x86_64" ]; }

[ -z "${DRJIT_LIBLLVM_PATH:-}" ] || has_llvm || fail "DRJIT_LIBLLVM_PATH=$DRJIT_LIBLLVM_PATH is no \
libLLVM of version 17 or newer that can be loaded. Unset it, or name another."
has_venv || has_pip_for_venvs "$python" || [ "$can_install" = no ] ||
    apt_install "python$version-venv" python3-venv || true
if ! has_llvm; then
    if [ "$(uname)" = Darwin ] && command -v brew >/dev/null 2>&1; then
        say "Installing LLVM through Homebrew ..."
        brew install --quiet llvm || true
    elif [ "$can_install" = yes ]; then
        apt_install libllvm19 libllvm18 libllvm20 libllvm21 libllvm17t64 libllvm17 || true
    fi
fi
has_atomic || [ "$can_install" = no ] || apt_install libatomic1 || true
# Open CASCADE, which reads and writes STEP files, links to libGL; all else works without it.
has_gl() { probe 'import ctypes, sys; sys.platform != "linux" or ctypes.CDLL("libGL.so.1")'; }
has_gl || [ "$can_install" = no ] || apt_install libgl1 || true

# --- what could not be installed, and comes another way or not at all ----------------------------
scratch=$(mktemp -d)
trap 'rm -rf "$scratch"' EXIT
lacking=
packages=
lacks() { # PACKAGE SENTENCE
    packages="$packages $1"
    lacking="$lacking
  - $2"
}
if ! has_venv; then
    say "Making the virtual environment .venv ..."
    make_venv "$python" "$venv" ||
        lacks "python$version-venv" "pip for virtual environments of $python"
fi
if ! has_atomic; then
    if unpack_deb libatomic1 "$scratch"; then
        say "libatomic goes into .venv, as no system package can be installed."
        mkdir -p "$venv/lib"
        cp "$scratch"/usr/lib/*/libatomic.so.1 "$venv/lib/"
    else
        lacks libatomic1 "libatomic, a library of the compiler GCC, which the renderer needs"
    fi
fi
llvm_wheel=no
if ! has_llvm; then
    if llvm_wheel_fits; then
        llvm_wheel=yes
    else
        lacks libllvm19 "libLLVM 17 or newer, with which the renderer compiles its kernels"
    fi
fi
if [ -n "$lacking" ]; then
    case "$(uname)" in
    Darwin) command="brew install llvm" ;;
    *) command="apt-get install$packages      (or what this system calls them)" ;;
    esac
    fail "this machine lacks, and you have no right to install here:$lacking
Ask an administrator to type
    $command
and run this again. Without one, take what is lacking from conda:
    conda create -n optisense -c conda-forge python=3.12 libllvm19 libgcc
    conda activate optisense
    make PYTHON=\"\$CONDA_PREFIX/bin/python\" setup
A libLLVM in an unusual place is named by DRJIT_LIBLLVM_PATH=/path/to/libLLVM.so.
docs/install.md says more. No dependency was downloaded yet."
fi

# --- the dependencies -----------------------------------------------------------------------------
install() { "$venv/bin/python" -m pip install --quiet --disable-pip-version-check --no-input "$@"; }
say "Installing the locked dependencies into .venv (a few minutes the first time) ..."
install --require-hashes --requirement requirements.lock
install --no-deps --no-build-isolation --editable .
if [ "$llvm_wheel" = yes ]; then
    say "Installing libLLVM into .venv, as no system package can be installed ..."
    install --require-hashes --requirement requirements-llvm.lock
fi

"$venv/bin/python" - <<'PROBE' || fail "the renderer does not start; see the line above."
import sys
from optisense.errors import OptiSenseError
from optisense.optics.backend.llvm import find_llvm
from optisense.optics.backend.variant import import_renderer
try:
    library = find_llvm()
    import_renderer("mitsuba")
except OptiSenseError as error:
    sys.exit(f"set-up: {error}")
print(f"The renderer will use {library}")
PROBE

touch "$venv/.set-up"
say "Set-up is done."
