#!/usr/bin/env bash
# Vulkan without a graphics card: Mesa's lavapipe. Debian 12's own is too old for ray tracing; its backports have a
# newer one. May be run again at any time: it installs only what is missing.
set -euo pipefail

say() { printf 'software-vulkan: %s\n' "$*"; }
die() {
    printf 'software-vulkan: error: %s\n' "$*" >&2
    exit 2
}

oldest_mesa=24.1 # the first whose lavapipe traces rays with pipelines
suite=bookworm-backports
# slangpy itself links to libX11 and libatomic, display or not.
libraries=(libvulkan1 libx11-6 libatomic1)

id=$(. /etc/os-release 2>/dev/null && printf '%s %s' "${ID:-}" "${VERSION_ID:-}") || id=
if [ "$id" != "debian 12" ]; then
    die "this prepares Debian 12 alone, and this is ${id:-another system}. A graphics card's own Vulkan driver needs no
  preparation. For a software driver install Mesa $oldest_mesa or newer, with lavapipe, and the Vulkan loader:
  Debian 13, Ubuntu 24.10 or newer:  apt-get install mesa-vulkan-drivers ${libraries[*]}
  Fedora:      dnf install mesa-vulkan-drivers vulkan-loader libX11 libatomic
  Arch Linux:  pacman -S vulkan-swrast vulkan-icd-loader libx11"
fi

version_of() { dpkg-query -W -f='${db:Status-Status} ${Version}' "$1" 2>/dev/null | sed -n 's/^installed //p'; }
mesa_is_new() {
    local version
    version=$(version_of mesa-vulkan-drivers)
    [ -n "$version" ] && dpkg --compare-versions "$version" ge "$oldest_mesa"
}
missing=()
for library in "${libraries[@]}"; do
    [ -n "$(version_of "$library")" ] || missing+=("$library")
done
if mesa_is_new && [ ${#missing[@]} -eq 0 ]; then
    say "nothing to do: Mesa $(version_of mesa-vulkan-drivers) is installed"
    exit 0
fi

root=()
if [ "$(id -u)" -ne 0 ]; then
    command -v sudo >/dev/null || die "packages are missing; run it as root: make software-vulkan"
    root=(sudo)
fi
install() {
    "${root[@]}" env DEBIAN_FRONTEND=noninteractive \
        apt-get install -y -qq -o Dpkg::Use-Pty=0 --no-install-recommends "$@" </dev/null >/dev/null
}

if ! mesa_is_new; then
    known=$(apt-get indextargets --format '$(CODENAME) $(REPO_URI)' 'Identifier: Packages')
    if ! grep -q "^$suite " <<<"$known"; then
        # From where this machine already gets its Debian; Debian signs all its suites with the keys of this package.
        keys=/usr/share/keyrings/debian-archive-keyring.gpg
        [ -f "$keys" ] || missing+=(debian-archive-keyring)
        mirror=$(sed -n 's/^bookworm //p' <<<"$known" | head -n 1)
        [ -n "$mirror" ] || die "no source of bookworm itself is configured for apt, so none is known for $suite"
        say "adding the suite $suite of this machine's Debian mirror to apt's sources"
        printf '%s\n' 'Types: deb' "URIs: $mirror" "Suites: $suite" 'Components: main' "Signed-By: $keys" |
            "${root[@]}" tee /etc/apt/sources.list.d/lab-backports.sources >/dev/null
    fi
fi
"${root[@]}" apt-get update -qq >/dev/null
if [ ${#missing[@]} -gt 0 ]; then
    say "installing ${missing[*]}"
    install "${missing[@]}"
fi
if ! mesa_is_new; then
    say "installing mesa-vulkan-drivers from $suite"
    install -t "$suite" mesa-vulkan-drivers
fi
mesa_is_new || die "mesa-vulkan-drivers is $(version_of mesa-vulkan-drivers), older than $oldest_mesa: has the mirror $suite?"
say "ready: Mesa $(version_of mesa-vulkan-drivers)"
