# Sourced by the scripts beside it: finds Python, makes .venv in the checkout and installs into it what a lock names.
# shellcheck shell=sh

set -eu

say() { printf '%s\n' "$*"; }
die() {
    printf '%s\n' "$*" >&2
    exit 2
}

root=$(CDPATH='' cd -- "$(dirname -- "$0")/.." && pwd) || die "$0: cannot enter the checkout"
cd -- "$root"
venv=$root/.venv
python=$venv/bin/python
# packages from elsewhere must not stand in for the locked ones
unset PYTHONPATH PYTHONHOME
# compiled once, not by each of some hundred processes: 0.5 s in a small sweep of 1.9 s
unset PYTHONDONTWRITEBYTECODE

# python_fits PROGRAM: whether it runs and is a version that the locks have packages for
python_fits() {
    "$1" -c 'import sys; sys.exit(not (3, 11) <= sys.version_info[:2] <= (3, 14))' >/dev/null 2>&1
}

# Sets `found` to a Python that fits: $PYTHON, or the first on the path.
find_python() {
    for found in ${PYTHON:+"$PYTHON"} python3 python3.14 python3.13 python3.12 python3.11 python; do
        if python_fits "$found"; then return 0; fi
        [ "$found" != "${PYTHON:-}" ] || die "PYTHON=$PYTHON: no working Python 3.11 to 3.14"
    done
    have=$(python3 --version 2>/dev/null) || have="none"
    die "Python 3.11 to 3.14 is needed (found: $have). Install one, or name it: PYTHON=/path/to/python3 $0"
}

# On Debian and Ubuntu venv is a package of its own: installs it if `found` lacks it and this is such a system.
need_venv_module() {
    if "$found" -c 'import ensurepip, venv' >/dev/null 2>&1; then return 0; fi
    version=$("$found" -c 'import sys; print("%d.%d" % sys.version_info[:2])')
    packages="python$version-venv python3-venv"
    hint="$found cannot make virtual environments: install the package python$version-venv (or python3-venv)"
    command -v apt-get >/dev/null 2>&1 || die "$hint"
    if [ "$(id -u)" -eq 0 ]; then
        as_root=""
    elif command -v sudo >/dev/null 2>&1; then
        as_root=sudo
        sudo -v || die "$hint as root: sudo does not let you" # once, not at each of the attempts below
    else
        die "$hint as root: there is no sudo here"
    fi
    for package in $packages; do
        say "Installing $package with apt-get"
        for attempt in as-it-is updated; do
            if [ "$attempt" = updated ]; then $as_root apt-get -qq update || true; fi
            if $as_root env DEBIAN_FRONTEND=noninteractive apt-get -qq install -y --no-install-recommends "$package" &&
                "$found" -c 'import ensurepip, venv' >/dev/null 2>&1; then
                return 0
            fi
        done
    done
    die "$hint as root: apt-get could not"
}

make_venv() {
    if python_fits "$python" && "$python" -m pip --version >/dev/null 2>&1; then return 0; fi
    find_python
    need_venv_module
    say "Making .venv with $("$found" --version)"
    "$found" -m venv --clear "$venv" || die "$found could not make $venv"
}

pip_install() {
    "$python" -m pip install --quiet --no-input --disable-pip-version-check "$@"
}

# is_installed LOCK: whether .venv has what LOCK names, and the project, by a checksum of all that it follows from, the
# place of the checkout included. Sets `wanted` to that checksum and `stamp` to the file that keeps it.
is_installed() {
    wanted=$({ printf '%s\n' "$root" && cat "$1" pyproject.toml scripts/common.sh && "$python" -VV; } | cksum)
    stamp=$venv/installed-${1%.lock}
    [ -f "$stamp" ] && [ "$(cat "$stamp")" = "$wanted" ]
}

# install_lock LOCK [LARGER]: .venv with what LOCK names, by its hashes, and the project itself. Nothing if that is there
# already, or what LARGER names, a lock that holds all of LOCK: what is in use must not be reinstalled.
install_lock() {
    make_venv
    if { [ $# -gt 1 ] && is_installed "$2"; } || is_installed "$1"; then return 0; fi
    say "Installing the packages of $1 into .venv"
    rm -f "$stamp"
    pip_install --no-compile --require-hashes --only-binary :all: --requirement "$1" ||
        die "The packages could not be installed: see pip's message above"
    # on all processors, where pip takes one; a file that no Python of this version can read is no loss
    "$python" -m compileall -qq -j 0 "$venv/lib" || true
    pip_install --no-deps --no-build-isolation --editable . ||
        die "The project could not be installed: see pip's message above"
    printf '%s\n' "$wanted" >"$stamp"
}

# use_background: from now on one process at a time may run in the background, and `scratch` is a folder; neither
# outlives the script.
use_background() {
    scratch=$(mktemp -d)
    background=""
    trap clean_up EXIT
    trap 'exit 130' INT
    trap 'exit 143' TERM
}

clean_up() {
    [ -z "$background" ] || kill "$background" 2>/dev/null || true
    [ -z "$background" ] || wait "$background" || true
    rm -rf "$scratch"
}

# begin COMMAND...: runs it in the background; what it says is kept for `finish`
begin() {
    "$@" >"$scratch/background.log" 2>&1 &
    background=$!
}

# finish: waits for what was begun and shows what it has said; its exit code
finish() {
    wait "$background" && ended_with=0 || ended_with=$?
    background=""
    cat "$scratch/background.log"
    return "$ended_with"
}
