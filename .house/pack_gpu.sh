#!/usr/bin/env bash
# What a machine with a graphics card but no network needs, in one folder of some 30 MB, for .house/gpu_machine.sh there:
#
#   .house/pack_gpu.sh FOLDER [SCENE.glb ...]
#
# Scenes are copied into it. It runs where the network is: wheels come by pip and libraries by apt, from wherever these
# are set up to look. PYTHON_VERSION (3.12) and MACHINE_HAS (packages that need no carrying) describe the other machine.
set -euo pipefail

say() { printf 'pack-gpu: %s\n' "$*"; }
die() {
    printf 'pack-gpu: error: %s\n' "$*" >&2
    exit 2
}

[ $# -ge 1 ] || die "name the folder: .house/pack_gpu.sh FOLDER [SCENE.glb ...]"
version=${PYTHON_VERSION:-3.12}
has=${MACHINE_HAS:-numpy scipy pillow rich pygments cmake ninja packaging pathspec sortedcontainers mypy-extensions typing-extensions}
folder=$(mkdir -p "$1" && cd "$1" && pwd)
shift
scenes=()
for scene in "$@"; do
    [ -f "$scene" ] || die "there is no scene $scene"
    scenes+=("$(realpath "$scene")")
done
cd "$(dirname "${BASH_SOURCE[0]}")/.."
python=${PYTHON:-python3}
"$python" -m pip --version >/dev/null 2>&1 || die "$python has no pip; name another one: PYTHON=/path/to/python"
for tool in apt-get strip tar xz unzip; do
    command -v "$tool" >/dev/null || die "$tool is missing"
done

# open3d, which reads .ply and lists of lights, is as large as all else together ten times over: it stays here.
wanted=$("$python" - "$has" <<'PYTHON'
import re, sys, tomllib
project = tomllib.load(open("pyproject.toml", "rb"))
extras = project["project"]["optional-dependencies"]
left = {"open3d", *sys.argv[1].lower().split()}
tools = ["mypy", "ruff", "clang-format", "pre-commit", "playwright", "mitsuba"]
needs = project["build-system"]["requires"] + project["project"]["dependencies"] + extras["vulkan"] + extras["test"]
for need in needs:
    name = re.split(r"[^\w.-]", need)[0].lower()
    if name not in left and name not in tools:
        print(need)
PYTHON
)
# What these need in turn.
wanted+=$'\n'$(printf '%s\n' 'dataclasses-json>=0.6' 'marshmallow>=3.18,<4' 'typing-inspect>=0.4' 'deprecated<2' 'wrapt<3' 'pluggy>=1.6' \
    'iniconfig>=2')

platforms=()
for glibc in 35 34 31 28 27 24 17; do platforms+=(--platform "manylinux_2_${glibc}_x86_64"); done
platforms+=(--platform manylinux2014_x86_64 --platform manylinux1_x86_64)
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
rm -rf "$folder/wheels" "$folder/debs" "$folder/slangpy.tar.xz"
mkdir -p "$folder/wheels" "$folder/debs" "$folder/scenes"
say "fetching wheels for Python $version"
mapfile -t names <<<"$wanted"
"$python" -m pip download -q --disable-pip-version-check --no-deps --only-binary=:all: --implementation cp \
    --python-version "$version" "${platforms[@]}" -d "$folder/wheels" "${names[@]}"

say "making slangpy slim"
(
    cd "$work"
    unzip -q "$folder"/wheels/slangpy-*.whl
    rm "$folder"/wheels/slangpy-*.whl
    # Only what runs: no static library, headers, tests, or modules that no shader here imports.
    rm -rf slangpy/libslang-rhi.a slangpy/{tests,benchmarks,include,data/test_images} slangpy/slang-standard-module-*
    find slangpy -name '*.so*' -type f -exec strip --strip-unneeded {} +
    tar -cf - slangpy slangpy-*.dist-info | xz -9e -T2 >"$folder/slangpy.tar.xz"
)

say "fetching libraries"
(
    cd "$folder/debs"
    apt-get download -qq libembree3-3 libembree-dev libtbb12 libtbbmalloc2 libtbbbind-2-5 libglm-dev libhwy1 libhwy-dev \
        libvulkan1 libx11-6 libxcb1 libxau6 libxdmcp6 libbsd0 libmd0 libatomic1 2>/dev/null ||
        die "apt-get download did not succeed; run apt-get update. These are the names of Debian 12"
)
[ ${#scenes[@]} -eq 0 ] || cp -f "${scenes[@]}" "$folder/scenes/"
size=$(du -sm "$folder" | cut -f1)
say "$folder: $size MB ($(ls "$folder/wheels" | wc -l) wheels, $(ls "$folder/debs" | wc -l) libraries, ${#scenes[@]} scenes)"
[ "$size" -le 50 ] || die "that is more than 50 MB; leave scenes out"
