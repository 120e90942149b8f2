# Functions that the scripts in tools/ share; to be sourced, not run.

started_in=$PWD
root=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)
cd "$root" || exit 2
target_dir=${CARGO_TARGET_DIR:-$root/target}

note() { printf '%s\n' "$*" >&2; }
# absolute PATH: a path as whoever started the script means it, who may be in another folder.
absolute() { case $1 in /*) printf '%s\n' "$1" ;; *) printf '%s\n' "$started_in/$1" ;; esac }

# Exits with a hint when there is no Rust; finds one that rustup has installed into the home folder.
need_rust() {
    command -v cargo >/dev/null || PATH="${CARGO_HOME:-$HOME/.cargo}/bin:$PATH"
    if ! command -v cargo >/dev/null; then
        note "Rust is missing. Install it from https://rustup.rs:"
        note "    curl --proto '=https' --tlsv1.2 -sSf https://sh.rustup.rs | sh"
        exit 2
    fi
}

have_cxx() { command -v "${CXX:-c++}" >/dev/null; }
have_tetgen() {
    [ -n "${TETGEN_DIR:-}" ] || { have_cxx && echo '#include <tetgen.h>' | "${CXX:-c++}" -E -x c++ - >/dev/null 2>&1; }
}
have_nightly() { command -v rustup >/dev/null && rustup run nightly rustc --version >/dev/null 2>&1; }
have_miri() { have_nightly && cargo +nightly miri --version >/dev/null 2>&1; }
have_sanitizer() { compgen -G "$(rustc --print sysroot)/lib/rustlib/$(rustc -vV | sed -n 's/^host: //p')/lib/librustc*_rt.asan.*" >/dev/null; }
# A display without a screen, keys for it, and what the player loads to open a window.
have_display() { command -v Xvfb >/dev/null && command -v xdotool >/dev/null; }
# A browser without a window, for the test of the viewer page.
have_chromium() { command -v chromium-headless-shell >/dev/null || command -v chromium >/dev/null; }
have_venv() { command -v python3 >/dev/null && python3 -c 'import venv, ensurepip' 2>/dev/null; }

# install_missing plain|python|deep: installs the system packages that are missing, where that is possible.
# Reports what stays missing and goes on: everything but the TetGen worker builds without them.
install_missing() {
    local packages=()
    command -v cc >/dev/null || packages+=(gcc libc6-dev)
    have_cxx || packages+=(g++)
    have_tetgen || packages+=(libtet1.5-dev)
    [ "$1" = plain ] || have_venv || packages+=(python3 python3-venv)
    if [ "$1" != plain ]; then
        # What the recipes for build systems are tested with.
        command -v make >/dev/null || packages+=(make)
        command -v ninja >/dev/null || packages+=(ninja-build)
        command -v cmake >/dev/null || packages+=(cmake)
        command -v pkg-config >/dev/null || packages+=(pkg-config)
        command -v git-lfs >/dev/null || packages+=(git-lfs)
    fi
    [ "$1" = plain ] || have_display || packages+=(xvfb xdotool libx11-xcb1 libxcursor1 libxi6 libxkbcommon-x11-0)
    [ "$1" = plain ] || have_chromium || packages+=(chromium-headless-shell)
    if [ "$1" = deep ]; then
        # What links and runs programs for AArch64.
        command -v aarch64-linux-gnu-gcc >/dev/null || packages+=(gcc-aarch64-linux-gnu libc6-dev-arm64-cross)
        command -v aarch64-linux-gnu-g++ >/dev/null || packages+=(g++-aarch64-linux-gnu)
        command -v qemu-aarch64 >/dev/null || packages+=(qemu-user)
    fi
    [ ${#packages[@]} -eq 0 ] && return 0

    local as_root=()
    if [ "$(id -u)" -ne 0 ]; then as_root=(sudo -n); fi
    if command -v apt-get >/dev/null && "${as_root[@]}" true 2>/dev/null; then
        note "Installing ${packages[*]}"
        "${as_root[@]}" apt-get update -qq >/dev/null 2>&1 || note "apt-get update failed; trying with the lists at hand"
        # One by one, so that a package that cannot be installed does not keep the others from being installed.
        local package
        for package in "${packages[@]}"; do
            "${as_root[@]}" env DEBIAN_FRONTEND=noninteractive \
                apt-get install -y -qq --no-install-recommends "$package" >/dev/null 2>&1 \
                || note "could not install $package"
        done
    else
        note "Missing and not installable from here (no apt-get, or not root): ${packages[*]}"
    fi
    command -v cc >/dev/null || note "No C compiler: Rust needs one to link. Install gcc or clang."
    have_cxx || note "No C++ compiler: meshopt-compressed glTF files cannot be read. Install g++ or clang."
    have_tetgen || note "No TetGen: the worker is not built, and compiled files hold BVHs only."
    [ "$1" = plain ] || have_display || note "No Xvfb or no xdotool: the test of the window is skipped."
    [ "$1" = plain ] || have_chromium || note "No Chromium: the test of the viewer page is skipped."
    [ "$1" = plain ] || have_venv || note "No python3 with venv: the Python cross-checks are skipped."
}

# package_tools: puts maturin, zig and cargo-zigbuild on PATH, from PyPI, in a virtual environment in the build's folder. Zig compiles C
# and C++ and links, for systems with an older C library, for musl, and for other processors.
package_tools() {
    local tools=$target_dir/package-tools
    if [ ! -x "$tools/bin/cargo-zigbuild" ]; then
        "${PYTHON:-python3}" -m venv "$tools"
        "$tools/bin/pip" install --quiet --disable-pip-version-check 'maturin>=1.9,<2' 'cargo-zigbuild>=0.24,<0.25' 'ziglang>=0.17,<0.18'
    fi
    PATH=$tools/bin:$PATH
}
# have_target TARGET: returns true if there is a standard library for it, or it can be added.
have_target() {
    [ -d "$(rustc --print sysroot)/lib/rustlib/$1/lib" ] && return 0
    command -v rustup >/dev/null && rustup target add "$1" >/dev/null 2>&1
}
