#!/usr/bin/env bash
# Whole frames of the Vulkan engine under the validation layers of Vulkan, which must have nothing to say.
#
#   .house/validate_vulkan.sh [ARGUMENTS of tests/validation/frames.py]
#
# The layers must be 1.4.309 or newer. A machine that has them uses them; elsewhere a Debian 13 is unpacked into a folder
# (LAB_DEBIAN13, otherwise below the user's cache: 4 GB), this tree is copied there, set up, and run with Debian 13's
# layers and its software driver. May be run again at any time: it makes only what is missing.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."

oldest_layers=1.4.309
suite=trixie
frames=(-m tests.validation.frames "$@")

say() { printf 'validate-vulkan: %s\n' "$*"; }
die() {
    printf 'validate-vulkan: error: %s\n' "$*" >&2
    exit 2
}

# --- here, if this machine has such layers -----------------------------------------------------------------------
layers() { # the version in the layer's own description, below folder $1
    find "$1/usr/share/vulkan" "$1/usr/local/share/vulkan" "$1/etc/vulkan" -name VkLayer_khronos_validation.json \
        -exec sed -n 's/.*"api_version": *"\([0-9.]*\)".*/\1/p' {} + 2>/dev/null | sort -V | tail -n 1 || true
}
new_enough() { [ -n "$1" ] && [ "$(printf '%s\n' "$oldest_layers" "$1" | sort -V | head -n 1)" = "$oldest_layers" ]; }

here=$(layers "")
if new_enough "$here"; then
    say "with this machine's layers, $here"
    bash .house/setup.sh vulkan
    exec .venv/bin/python "${frames[@]}"
fi

# --- a Debian 13 in a folder -------------------------------------------------------------------------------------
command -v apt-get >/dev/null || die "the layers of this machine (${here:-none}) are older than $oldest_layers, and this is
  no Debian or Ubuntu that could unpack a Debian 13. Install newer ones (package vulkan-validationlayers,
  vulkan-validation-layers or the Vulkan SDK), then try again"
[ "$(id -u)" -eq 0 ] || die "the layers of this machine (${here:-none}) are older than $oldest_layers; a Debian 13 is unpacked
  and entered as root: sudo make validate-vulkan"

root=${LAB_DEBIAN13:-${XDG_CACHE_HOME:-$HOME/.cache}/many-lights-lab/debian13}
if [ ! -e "$root/etc/debian_version" ] || [ -d "$root/debootstrap" ]; then # its work folder is left by a broken run
    if ! command -v debootstrap >/dev/null; then
        say "installing debootstrap"
        apt-get update -qq >/dev/null
        apt-get install -y -qq -o Dpkg::Use-Pty=0 --no-install-recommends debootstrap </dev/null >/dev/null
    fi
    # From where this machine already gets its packages.
    mirror=$(apt-get indextargets --format '$(ORIGIN) $(SITE) $(REPO_URI)' 'Identifier: Packages' |
        sed -n 's/^Debian .* //p' | grep -v security | head -n 1)
    [ -n "$mirror" ] || die "no mirror of Debian is configured for apt, so none is known for $suite"
    say "unpacking a minimal Debian 13 into $root"
    rm -rf "$root"
    mkdir -p "$root"
    log=$(mktemp)
    debootstrap --variant=minbase --include=ca-certificates "$suite" "$root" "$mirror" >"$log" 2>&1 ||
        die "debootstrap did not succeed: $(tail -n 3 "$log")"
    rm -f "$log"
fi

say "copying this tree into it"
tree=$root/srv/lab
mkdir -p "$tree" "$root/srv/scenes"
git ls-files -z --cached --others --exclude-standard >"$root/srv/files"
# What is gone here must not stay there; what was built there may.
if [ -e "$root/srv/files.last" ]; then
    LC_ALL=C comm -z -13 <(sort -z "$root/srv/files") <(sort -z "$root/srv/files.last") |
        (cd "$tree" && xargs -0 -r rm -f)
fi
mv "$root/srv/files" "$root/srv/files.last"
tar --null --ignore-failed-read -T "$root/srv/files.last" -cf - 2>/dev/null | tar -C "$tree" --no-same-owner -xf -
if [ -n "${LAB_SCENES:-}" ]; then cp -ru "$LAB_SCENES/." "$root/srv/scenes"; fi
cp -L /etc/resolv.conf "$root/etc/resolv.conf"

# A name space of its own for what is mounted: it goes with the process, however that ends.
enter() {
    unshare --mount bash -c '
        set -e
        root=$1
        shift
        mount -t proc proc "$root/proc"
        mount --rbind /dev "$root/dev"
        mount -t tmpfs tmpfs "$root/tmp"
        [ ! -d /etc/ssl/certs ] || mount --bind /etc/ssl/certs "$root/etc/ssl/certs"  # of whatever stands in between
        for folder in $LAB_MOUNTED; do mkdir -p "$root$folder" && mount --bind "$folder" "$root$folder"; done
        exec chroot "$root" "$@"' enter "$root" "$@"
}
# Wheels that pip finds in a folder of this machine, it finds there, too.
LAB_MOUNTED=
for folder in ${PIP_FIND_LINKS:-}; do [ ! -d "$folder" ] || LAB_MOUNTED+=" $folder"; done
export LAB_MOUNTED

missing=()
for package in vulkan-validationlayers mesa-vulkan-drivers libvulkan1 libatomic1; do
    [ -e "$root/var/lib/dpkg/info/$package.list" ] || [ -e "$root/var/lib/dpkg/info/$package:$(dpkg --print-architecture).list" ] ||
        missing+=("$package")
done
if [ ${#missing[@]} -gt 0 ]; then
    say "installing ${missing[*]} there"
    enter bash -c 'apt-get update -qq >/dev/null && DEBIAN_FRONTEND=noninteractive \
        apt-get install -y -qq -o Dpkg::Use-Pty=0 --no-install-recommends "$@" </dev/null >/dev/null' install "${missing[@]}"
fi
there=$(layers "$root")
new_enough "$there" || die "the layers in $root are ${there:-missing}, older than $oldest_layers"
say "with the layers of Debian 13, $there"
enter env -u PYTHON -u XDG_CACHE_HOME HOME=/root LC_ALL=C.UTF-8 LAB_SCENES="${LAB_SCENES:+/srv/scenes}" \
    PATH=/usr/local/sbin:/usr/local/bin:/usr/sbin:/usr/bin:/sbin:/bin \
    bash -c 'cd /srv/lab && bash .house/setup.sh vulkan && exec .venv/bin/python "$@"' frames "${frames[@]}"
