#!/usr/bin/env bash
# Everything a fresh machine needs, installed only where it is missing: system packages, .venv, the package itself.
#
#   .house/setup.sh          what a render needs
#   .house/setup.sh EXTRA    with an extra of pyproject.toml: kornia, gui, vulkan, test, or all of them: all
#
# Python files are used from the tree, so only pyproject.toml and core_cpp/ can make a set-up stale.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."

extras=${1:-}
venv=.venv

say() { printf 'setup: %s\n' "$*"; }
die() {
    printf 'setup: error: %s\n' "$*" >&2
    exit 2
}

# --- is there anything to do? --------------------------------------------------------------------
fingerprint=$({
    sha256sum pyproject.toml .house/setup.sh
    find core_cpp -type f -print0 | LC_ALL=C sort -z | xargs -0 sha256sum
} | sha256sum | cut -d' ' -f1)
# The path is part of it: a moved tree needs its virtual environment made anew.
fingerprint="$fingerprint $PWD"
# One stamp for each extra that is installed; .setup-base stands for the package itself.
ready() { [ -x "$venv/bin/lab" ] && [ "$(cat "$venv/.setup-$1" 2>/dev/null)" = "$fingerprint" ]; }
if ready all || ready "${extras:-base}"; then
    exit 0
fi

# --- a Python ------------------------------------------------------------------------------------
python=
for candidate in "${PYTHON:-}" python3 python3.11 python3.12 python3.13; do
    if [ -n "$candidate" ] && command -v "$candidate" >/dev/null &&
        "$candidate" -c 'import sys; sys.exit(sys.version_info < (3, 11))' 2>/dev/null; then
        python=$candidate
        break
    fi
done

# --- system packages -----------------------------------------------------------------------------
# Embree, GLM and Highway build the core; the rest is what open3d's own library links to.
packages=(libembree-dev libglm-dev libhwy-dev libgomp1 libx11-6 libgl1 libegl1 libudev1 libusb-1.0-0 libidn2-0)
case "$extras" in
gui | test | all) packages+=(libegl-mesa0 libgl1-mesa-dri) ;; # the software display of the 3D view
esac
case "$extras" in
vulkan | all) packages+=(libvulkan1 libatomic1) ;; # the loader, and what slangpy links to
esac
case "$extras" in
test | all) # the browser and the screen of the inspector's tests
    command -v chromium >/dev/null || packages+=(chromium)
    command -v xvfb-run >/dev/null || packages+=(xvfb xauth)
    ;;
esac
command -v c++ >/dev/null || packages+=(g++)
if [ -z "$python" ]; then
    packages+=(python3 python3-venv python3-dev)
else
    version=$("$python" -c 'import sys; print("%d.%d" % sys.version_info[:2])')
    "$python" -c 'import ensurepip, venv' 2>/dev/null || packages+=("python$version-venv")
    "$python" -c 'import os, sysconfig; open(os.path.join(sysconfig.get_path("include"), "Python.h"))' 2>/dev/null ||
        packages+=("python$version-dev")
fi

if command -v dpkg-query >/dev/null && command -v apt-get >/dev/null; then
    missing=()
    for package in "${packages[@]}"; do
        status=$(dpkg-query -W -f='${db:Status-Status}' "$package" 2>/dev/null | head -n 1) || true
        [ "$status" = installed ] || missing+=("$package")
    done
    if [ ${#missing[@]} -gt 0 ]; then
        root=()
        if [ "$(id -u)" -ne 0 ]; then
            command -v sudo >/dev/null || die "these packages are missing: ${missing[*]}; install them as root: apt-get install ${missing[*]}"
            root=(sudo)
        fi
        say "installing system packages: ${missing[*]}"
        "${root[@]}" apt-get update -qq >/dev/null
        "${root[@]}" env DEBIAN_FRONTEND=noninteractive apt-get install -y -qq -o Dpkg::Use-Pty=0 --no-install-recommends "${missing[@]}" </dev/null >/dev/null
    fi
else
    headers=$(find /usr/include /usr/local/include /opt/homebrew/include -maxdepth 2 \
        \( -path '*/embree[34]/rtcore.h' -o -path '*/glm/glm.hpp' -o \
        -path '*/hwy/highway.h' \) 2>/dev/null | wc -l)
    if [ "$headers" -lt 3 ]; then
        die "this is no Debian or Ubuntu, and Embree, GLM or Highway was not found. Install them, then try again:
  Fedora:      dnf install gcc-c++ python3-devel embree-devel glm-devel highway-devel libglvnd-egl libglvnd-glx libX11 libusb1
  Arch Linux:  pacman -S gcc python embree glm highway libglvnd libx11 libusb
  macOS:       brew install python embree glm highway libomp"
    fi
fi
if [ -z "$python" ]; then
    python=python3
    "$python" -c 'import sys; sys.exit(sys.version_info < (3, 11))' 2>/dev/null ||
        die "Python 3.11 or newer is needed; this machine has $("$python" --version 2>&1). Name another one: PYTHON=/path/to/python make setup"
fi

# --- the virtual environment and the package -------------------------------------------------------
if ! "$venv/bin/python" -c 'import sys; sys.exit(sys.version_info < (3, 11))' 2>/dev/null; then
    say "making $venv with $("$python" --version)"
    rm -rf "$venv"
    "$python" -m venv "$venv"
fi
"$venv/bin/python" -m pip --version >/dev/null 2>&1 || "$venv/bin/python" -m ensurepip >/dev/null
pip=("$venv/bin/python" -m pip --disable-pip-version-check)

# uv installs several times faster; a machine where it can't (an index that only pip is set up for) uses pip.
uv=()
if command -v uv >/dev/null; then
    uv=(uv)
elif "$venv/bin/uv" --version >/dev/null 2>&1 || "${pip[@]}" install -q uv 2>/dev/null; then
    uv=("$venv/bin/uv")
fi
install() {
    if [ ${#uv[@]} -gt 0 ]; then
        "${uv[@]}" pip install --python "$venv/bin/python" "$@" && return
        say "uv did not succeed (above); trying pip"
        uv=()
    fi
    "${pip[@]}" install "$@"
}

mapfile -t build < <("$venv/bin/python" -c 'import tomllib
for need in tomllib.load(open("pyproject.toml", "rb"))["build-system"]["requires"]: print(need)')
say "installing the package${extras:+ with extra $extras} and building the core"
# The core is built with tools of the same environment and keeps its build folder: after an edit only what changed
# is compiled again.
install -q "${build[@]}"
install --no-build-isolation -e ".${extras:+[$extras]}"
"$venv/bin/lab" --version
for stamp in base ${extras:+"$extras"}; do
    printf '%s' "$fingerprint" >"$venv/.setup-$stamp"
done
say "ready: $venv/bin/lab"
