# Functions that the set-up scripts share; they source this file, and set `name`, which messages
# begin with.
# shellcheck shell=sh

say() { printf '%s\n' "$*"; }
fail() { printf '%s: %s\n' "$name" "$*" >&2; exit 1; }

# --- installing system packages -----------------------------------------------------------------
as_root=
can_install=no # whether packages of the system can be installed here, by apt-get
if command -v apt-get >/dev/null 2>&1; then
    if [ "$(id -u)" -eq 0 ]; then
        can_install=yes
    elif command -v sudo >/dev/null 2>&1; then
        # Without a password, or by somebody who can type one and belongs to the administrators.
        if sudo -n true 2>/dev/null ||
            { [ -t 0 ] && id -nG | grep -qwE 'sudo|wheel|admin'; }; then
            can_install=yes
            as_root=sudo
        fi
    fi
fi

apt_updated=no
apt_install() { # the first of the named packages that this system offers
    if [ "$apt_updated" = no ]; then
        apt_updated=yes
        $as_root apt-get update -qq || say "$name: the package lists could not be refreshed"
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

unpack_deb() { # PACKAGE FOLDER: unpack a package of Debian or Ubuntu; needs no administrator
    command -v apt-get >/dev/null 2>&1 && command -v dpkg-deb >/dev/null 2>&1 || return 1
    mkdir -p "$2"
    (cd "$2" && apt-get download -qq "$1" && dpkg-deb -x "$1"_*.deb .) >/dev/null 2>&1
}

# --- virtual environments -------------------------------------------------------------------------
version_of() { "$1" -c 'import sys; print("%d.%d" % sys.version_info[:2])'; }
has_pip_for_venvs() { "$1" -c 'import ensurepip, venv' >/dev/null 2>&1; }

make_venv() { # PYTHON FOLDER: a virtual environment with pip, by whatever brings pip here
    if has_pip_for_venvs "$1"; then
        "$1" -m venv --clear "$2"
        return
    fi
    "$1" -m venv --clear --without-pip "$2" || return 1
    if "$1" -m pip --version >/dev/null 2>&1; then
        "$1" -m pip --quiet --disable-pip-version-check --python "$2/bin/python" install pip
    elif command -v uv >/dev/null 2>&1; then
        uv pip install --quiet --python "$2/bin/python" pip
    else # Debian keeps pip for virtual environments in a package of its own
        unpack_deb python3-pip-whl "$2/debian" || return 1
        set -- "$2" "$2"/debian/usr/share/python-wheels/pip-*.whl
        "$1/bin/python" "$2/pip" --quiet --disable-pip-version-check install --no-index "$2" ||
            return 1
        rm -rf "$1/debian"
    fi
}
