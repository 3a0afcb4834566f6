#!/bin/sh
# Set up .venv-blender: Blender as a Python module, in which the extension's tests run. Each of
# these modules is built for one version of Python, and needs some libraries of a desktop.
#
#   setup_blender.sh             the Blender that fits the Python found here, as locked
#   setup_blender.sh VERSION     that one (4.2, 5.0, 5.1) in .venv-blender-VERSION
#   setup_blender.sh --why-not   change nothing; say in a line why it can't be set up, if so
set -eu
cd "$(dirname "$0")/.."
ask=no
[ "${1:-}" != --why-not ] || { ask=yes; shift; }
version=${1:-}
venv=.venv-blender${version:+-$version}
name="set-up of Blender"
unset PYTHONHOME PYTHONPATH VIRTUAL_ENV
. scripts/system.sh
cannot() { if [ "$ask" = yes ]; then say "$*"; exit 0; else fail "$*"; fi; }
[ "$ask" = no ] || [ ! -e "$venv/.set-up" ] || exit 0

case "$version" in # the Python that Blender's module is built for
"") needed="3.11 3.13" ;;
4.* | 5.0) needed=3.11 ;;
*) needed=3.13 ;;
esac
case "$(uname -sm)" in
"Linux x86_64" | "Darwin arm64") ;;
*) cannot "Blender publishes no Python module for $(uname -sm)." ;;
esac

python=
for wanted in $needed; do
    fits="import sys; sys.exit('%d.%d' % sys.version_info[:2] != '$wanted')"
    for candidate in ${BLENDER_PYTHON:-} "python$wanted" python3 "/usr/bin/python$wanted"; do
        if [ -z "$python" ] && command -v "$candidate" >/dev/null 2>&1 &&
            "$candidate" -c "$fits" >/dev/null 2>&1; then
            python=$candidate
            break 2
        fi
    done
done
[ -n "$python" ] || cannot "Blender's module needs Python $(echo "$needed" | sed 's/ / or /'), and \
none was found. Install it (without an administrator: uv python install 3.11), or name one: make BLENDER_PYTHON=/path/to/python3.11 studio-tests"

# --- libraries of a desktop that the module links to, and the packages of Debian that bring them ---
libraries="libGL.so.1:libgl1 libX11.so.6:libx11-6 libXext.so.6:libxext6 libXfixes.so.3:libxfixes3
    libXi.so.6:libxi6 libXrender.so.1:libxrender1 libxkbcommon.so.0:libxkbcommon0
    libSM.so.6:libsm6 libICE.so.6:libice6 libEGL.so.1:libegl1"
lacking() {
    [ "$(uname)" = Linux ] || return 0
    for pair in $libraries; do
        "$python" -c "import ctypes; ctypes.CDLL('${pair%%:*}')" >/dev/null 2>&1 ||
            printf ' %s' "${pair#*:}"
    done
}
packages=$(lacking)
if [ -n "$packages" ] && [ "$can_install" = no ]; then
    cannot "Blender's module needs libraries that are not here, and you have no right to install \
them. Ask an administrator to type: apt-get install$packages"
fi
if ! has_pip_for_venvs "$python" && [ ! -x "$venv/bin/python" ] && [ "$ask" = yes ] &&
    [ "$can_install" = no ]; then
    cannot "$python can't make virtual environments. Ask an administrator to type: \
apt-get install python$(version_of "$python")-venv"
fi
[ "$ask" = no ] || exit 0

for package in $packages; do
    apt_install "$package" || true
done
if ! "$venv/bin/python" -c "import pip; $fits" >/dev/null 2>&1; then
    if ! has_pip_for_venvs "$python" && [ "$can_install" = yes ]; then
        apt_install "python$(version_of "$python")-venv" python3-venv || true
    fi
    say "Making the virtual environment $venv ..."
    make_venv "$python" "$venv" || fail "$python can't make virtual environments with pip in them"
fi
say "Installing Blender's Python module into $venv (350 MB the first time) ..."
install() { "$venv/bin/python" -m pip install --quiet --disable-pip-version-check --no-input "$@"; }
if [ -n "$version" ]; then
    pytest=$(sed -n 's/^\(pytest==[^ ]*\).*/\1/p' requirements-blender.lock)
    install "bpy==$version.*" "$pytest"
else
    install --require-hashes --requirement requirements-blender.lock
fi
"$venv/bin/python" -c 'import bpy' >/dev/null ||
    fail "'$venv/bin/python -c \"import bpy\"' fails; see the lines above"

touch "$venv/.set-up"
say "Blender's module is set up."
