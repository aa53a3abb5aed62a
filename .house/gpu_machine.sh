#!/usr/bin/env bash
# Tests and measures everything on a machine with a graphics card and no network:
#
#   .house/gpu_machine.sh CARRIED RESULTS [SCENE]
#
# CARRIED is the folder that .house/pack_gpu.sh made where there was a network, for this machine's version of Python.
# The machine itself must have Python 3.11 or newer with pip, a C++20 compiler, CMake, and the card's driver with Vulkan.
# SCENE is measured: by default a carried sponza.glb, else the atrium. RESULTS gets a few files:
#
#   summary.txt                          what was done, how it ended, and how long it took
#   setup.txt, tests.txt, measure.txt    all that was said meanwhile
#   bench.json, bench.png                lab bench --engine vulkan
#   paper_tables.json                    the paper's Tables 1, 2, 3 and Figure 1
#   race_laboratory.json                 what unguarded reservoirs cost
#
# STEPS="setup tests bench tables race" names the steps, so that a machine with a limit on a command's time can take
# them one by one: what setup made stays in build/gpu-machine. A step that fails does not keep the others from running;
# the exit code tells. QUICK=1 does all of it on next to nothing, as a rehearsal: also without a card (lavapipe).
set -uo pipefail

say() { printf 'gpu-machine: %s\n' "$*"; }
die() {
    printf 'gpu-machine: error: %s\n' "$*" >&2
    exit 2
}

[ $# -ge 2 ] || die "name two folders: .house/gpu_machine.sh CARRIED RESULTS [SCENE]"
carried=$(realpath "$1")
[ -f "$carried/slangpy.tar.xz" ] || die "$1 was not made by .house/pack_gpu.sh: it holds no slangpy.tar.xz"
mkdir -p "$2" || die "$2 can't be written"
results=$(realpath "$2")
scene=
if [ $# -ge 3 ]; then
    scene=$(realpath "$3")
    [ -f "$scene" ] || die "there is no scene $3"
fi
cd "$(dirname "${BASH_SOURCE[0]}")/.." || exit 2
if [ -z "$scene" ]; then
    scene=scenes/atrium/scene.toml
    [ ! -f "$carried/scenes/sponza.glb" ] || scene=$carried/scenes/sponza.glb
fi
python=${PYTHON:-python3}
"$python" -c 'import sys; sys.exit(sys.version_info < (3, 11))' || die "$python is no Python 3.11 or newer"
"$python" -m pip --version >/dev/null || die "$python has no pip"

work=$PWD/build/gpu-machine
site=$work/site root=$work/root
quick=${QUICK:-}

# Ours first, then what the machine has.
export PYTHONPATH="$PWD:$site${PYTHONPATH:+:$PYTHONPATH}"
export LD_LIBRARY_PATH="$root/usr/lib/x86_64-linux-gnu:$root/lib/x86_64-linux-gnu${LD_LIBRARY_PATH:+:$LD_LIBRARY_PATH}"
export CMAKE_PREFIX_PATH="$root/usr${CMAKE_PREFIX_PATH:+:$CMAKE_PREFIX_PATH}"
export PYTHONUNBUFFERED=1
export XDG_CACHE_HOME=$work/cache
if [ -z "${VK_DRIVER_FILES:-}" ] && ! ls /usr/share/vulkan/icd.d/*.json /etc/vulkan/icd.d/*.json >/dev/null 2>&1; then
    # Where containers are given the card's driver in a folder of its own.
    found=$(find /usr/local /opt -name 'nvidia_icd*.json' 2>/dev/null | head -n 1)
    [ -z "$found" ] || export VK_DRIVER_FILES=$found
fi

setup() {
    rm -rf "$work"
    mkdir -p "$site" "$root"
    local deb
    for deb in "$carried"/debs/*.deb; do
        if command -v dpkg-deb >/dev/null; then
            dpkg-deb -x "$deb" "$root" || return
        else
            (cd "$root" && ar p "$deb" data.tar.xz | tar -xJf -) || return
        fi
    done
    tar -xJf "$carried/slangpy.tar.xz" -C "$site" || return
    local pip=("$python" -m pip --disable-pip-version-check install -q --no-index --no-deps --no-cache-dir --upgrade)
    "${pip[@]}" --target "$site" "$carried"/wheels/*.whl || return
    # The core is built here; Python files are used from the tree, so the installed ones go.
    "${pip[@]}" --no-build-isolation --target "$work/built" . || return
    cp "$work"/built/lab/_core*.so lab/ || return
    rm -rf "$work/built/lab" "$work/built/gui"
    cp -r "$work"/built/* "$site/" || return
    ldd lab/_core*.so | grep -E 'embree|tbb' || return
    "$python" -m lab info || return
    "$python" -c '
from lab.engine.vulkan.device import open_gpu
about = open_gpu().describe()
print(about)
'
}

tests() {
    # Tests that ask for programs that are not there skip, and say so.
    LAB_REQUIRE_VULKAN=1 "$python" -m pytest -q -p no:cacheprovider -W default tests/parity tests/unit/test_vulkan_*.py \
        tests/unit/test_paper_tables.py
}

bench() {
    local flags=()
    [ -z "$quick" ] || flags=(--frames 2 --size 64x36 --set vpls=2000)
    "$python" -m lab bench "$scene" --engine vulkan -o "$results/bench" "${flags[@]}" || return
    # It may be kept with the project then: where the scene lay on this machine is nobody's business.
    "$python" - "$results/bench.json" <<'PYTHON'
import json, pathlib, sys
path = pathlib.Path(sys.argv[1])
record = json.loads(path.read_text())
record["scene"]["path"] = pathlib.Path(record["scene"]["path"]).name
path.write_text(json.dumps(record, indent=2) + "\n")
PYTHON
}

tables() {
    local flags=()
    [ -z "$quick" ] || flags=(--quick --size 64x36)
    "$python" -m lab.experiments.paper_tables "$scene" --engine vulkan --json "$results/paper_tables.json" "${flags[@]}"
}

race() {
    local flags=()
    [ -z "$quick" ] || flags=(--sizes 64x36 --frames 64 --pixels 64 --set vpls=1000)
    "$python" -m lab.experiments.race_laboratory "$scene" -o "$results/race_laboratory.json" "${flags[@]}"
}

failed=0
for step in ${STEPS:-setup tests bench tables race}; do
    case $step in
    setup | tests) log=$results/$step.txt ;;
    bench | tables | race) log=$results/measure.txt ;;
    *) die "STEPS: there is no step $step; there are: setup tests bench tables race" ;;
    esac
    say "$step"
    start=$SECONDS
    $step 2>&1 | tee -a "$log"
    code=${PIPESTATUS[0]}
    [ "$code" -eq 0 ] || failed=1
    printf '%s %s: exit code %s after %s s\n' "$(date -u +%FT%TZ)" "$step" "$code" $((SECONDS - start)) |
        tee -a "$results/summary.txt"
    if [ "$step" = setup ] && [ "$code" -ne 0 ]; then
        break # nothing could work
    fi
done
exit $failed
