#!/bin/sh
# Set up a Blender with a window, in a place of its own, for the test that drives it by mouse and
# keys: .blender-window/blender. Its packages come from Debian (13, where this system's own Blender
# is too old; or another release that is named, in .blender-window-RELEASE: sid has the newest
# Blender) and are unpacked there, so that nothing of this system changes and no root is needed.
# Only the virtual display and what moves its mouse are installed as usual, if they are not there.
set -eu
cd "$(dirname "$0")/.."
release=${1:-trixie}
place=$(pwd)/.blender-window${1:+-$1}
unset PYTHONHOME PYTHONPATH VIRTUAL_ENV

say() { printf '%s\n' "$*"; }
fail() { printf 'set-up of the window test: %s\n' "$*" >&2; exit 1; }

command -v apt-get >/dev/null 2>&1 ||
    fail "this needs Debian or Ubuntu. Elsewhere: BLENDER=/path/to/blender make studio-window-test"

# --- a virtual display, and a hand for its mouse and keys -----------------------------------------
missing=
command -v Xvfb >/dev/null 2>&1 || missing="xvfb"
command -v xdotool >/dev/null 2>&1 || missing="$missing xdotool"
if [ -n "$missing" ]; then
    as_root=
    [ "$(id -u)" -eq 0 ] || as_root=sudo
    say "Installing $missing ..."
    $as_root apt-get update -qq || say "the package lists could not be refreshed"
    # shellcheck disable=SC2086
    $as_root env DEBIAN_FRONTEND=noninteractive \
        apt-get install -y -qq --no-install-recommends $missing >/dev/null ||
        fail "type: sudo apt-get install $missing"
fi

# --- Blender and all that it needs ----------------------------------------------------------------
tree=$place/tree
packages=$place/packages
mkdir -p "$place/lists/partial" "$packages/archives/partial" "$tree"
: > "$place/status"

mirror=$(apt-get --print-uris update 2>/dev/null |
    sed -n "s|^'\([^']*/debian\)/*/dists/.*|\1|p" | head -n 1)
[ -n "$mirror" ] || mirror=http://deb.debian.org/debian
keys=/usr/share/keyrings/debian-archive-keyring.gpg
[ -f "$keys" ] || fail "type: sudo apt-get install debian-archive-keyring"
echo "deb [signed-by=$keys] $mirror $release main" > "$place/sources.list"

# An apt of its own, which believes that nothing is installed.
own_apt() {
    apt-get -qq -o Dir::State="$place" -o Dir::State::Lists="$place/lists" \
        -o Dir::State::status="$place/status" -o Dir::Cache="$packages" \
        -o Dir::Etc::SourceList="$place/sources.list" -o Dir::Etc::SourceParts=/dev/null \
        -o Dir::Etc::Preferences=/dev/null -o Dir::Etc::PreferencesParts=/dev/null \
        -o APT::Sandbox::User="$(id -un)" -o APT::Install-Recommends=false \
        -o Acquire::Languages=none -o Acquire::IndexTargets::deb::Contents-deb::DefaultEnabled=false \
        "$@"
}
say "Fetching Blender's packages (some 300 MB the first time) ..."
own_apt update
# Blender loads OpenGL when it starts, and some of its packages do not name what draws with it.
own_apt install --yes --download-only blender python3-numpy \
    libgl1 libglx-mesa0 libegl1 libegl-mesa0 libgl1-mesa-dri >/dev/null

say "Unpacking them into $place ..."
rm -rf "$tree"
mkdir -p "$tree/usr"
find "$packages/archives" -name '*.deb' -print0 |
    xargs -0 -n 8 -P "$(nproc)" sh -c 'tree=$1; shift
        for package do dpkg-deb -x "$package" "$tree"; done' unpack "$tree"
own_apt clean

library=$(find "$tree/usr/lib" -maxdepth 1 -name '*-linux-gnu*' | head -n 1)
loader=$(find "$library" -maxdepth 1 -name 'ld-linux-*.so.*' | head -n 1)
[ -n "$loader" ] || fail "$tree holds no loader"
places=$library:$library/blas:$library/lapack:$library/pulseaudio:$tree/usr/lib
cat > "$place/blender" <<EOF
#!/bin/sh
# Blender out of $tree, with that tree's libraries and Python.
export BLENDER_SYSTEM_RESOURCES="$tree/usr/share/blender" BLENDER_SYSTEM_PYTHON="$tree/usr"
export LIBGL_ALWAYS_SOFTWARE=1 LIBGL_DRIVERS_PATH="$library/dri"
export __EGL_VENDOR_LIBRARY_DIRS="$tree/usr/share/glvnd/egl_vendor.d"
exec "$loader" --library-path "$places" "$tree/usr/bin/blender" "\$@"
EOF
# Blender starts this Python for its extensions.
python=$(find "$tree/usr/bin" -name 'python3.*' -type f | grep -E 'python3\.[0-9]+$' | head -n 1)
mv "$python" "$python.real"
cat > "$python" <<EOF
#!/bin/sh
export PYTHONHOME="$tree/usr"
exec "$loader" --library-path "$places" --argv0 "\$0" "$python.real" "\$@"
EOF
chmod +x "$place/blender" "$python"
"$place/blender" --version >/dev/null || fail "$place/blender does not start"

touch "$place/.set-up"
say "The window test will use $("$place/blender" --version | head -n 1)."
