# A Rust compiler for other kinds of machines where rustup cannot add their targets; to be sourced after common.sh.
#
# Debian's compiler, the standard libraries of its packages and those that are built here of its source are unpacked under
# target/cross. Nothing of the system changes: the lists of packages are in that folder, too. An emulator and a C cross compiler
# are installed as packages where that is possible.

cross=$target_dir/cross

# cross_unpack NAME PACKAGE...: downloads packages and unpacks them, once; NAME stands for all of them.
cross_unpack() {
    local name=$1 debs=$cross/debs/$1 deb
    shift
    [ ! -e "$cross/$name.unpacked" ] || return 0
    command -v apt-get >/dev/null && command -v dpkg-deb >/dev/null || return 1
    local state=(-o "Dir::State::Lists=$cross/lists" -o "Dir::Cache=$cross/cache" -o Acquire::Languages=none
        -o APT::Sandbox::User= -o "APT::Architectures::=$(dpkg --print-architecture)" -o APT::Architectures::=arm64)
    mkdir -p "$cross/lists/partial" "$cross/cache/archives/partial" "$cross/root" "$debs"
    [ -e "$cross/updated" ] || { apt-get "${state[@]}" -qq update && touch "$cross/updated"; } >/dev/null 2>&1 || return 1
    (cd "$debs" && apt-get "${state[@]}" -qq download "$@") >/dev/null 2>&1 || return 1
    for deb in "$debs"/*.deb; do dpkg-deb -x "$deb" "$cross/root" || return 1; done
    rm -r "$debs"
    touch "$cross/$name.unpacked"
}

# cross_rust: sets RUSTC to Debian's compiler, which has the standard libraries of this machine and of AArch64. Its artifacts go to a
# folder of their own, since they fit no other compiler.
cross_rust() {
    [ "$(uname -m)" = x86_64 ] || return 1
    cross_unpack rust rustc-web libstd-rust-web-1.96 libstd-rust-web-dev libstd-rust-web-dev:arm64 libllvm22 || return 1
    local libraries=$cross/root/usr/lib/x86_64-linux-gnu
    printf '#!/bin/sh\nLD_LIBRARY_PATH=%s exec %s "$@"\n' "'$libraries'" "'$cross/root/usr/bin/rustc'" >"$cross/rustc"
    chmod +x "$cross/rustc"
    "$cross/rustc" --version >/dev/null 2>&1 || return 1
    export RUSTC=$cross/rustc CARGO_TARGET_DIR=$cross/target CARGO_INCREMENTAL=0
    # These fit the compiler that rustup chose.
    unset RUSTUP_TOOLCHAIN RUSTC_WRAPPER
}

# cross_arm: as cross_rust, with what links and runs programs for AArch64.
cross_arm() {
    local packages=() as_root=()
    command -v aarch64-linux-gnu-gcc >/dev/null || packages+=(gcc-aarch64-linux-gnu libc6-dev-arm64-cross)
    command -v qemu-aarch64 >/dev/null || packages+=(qemu-user)
    if [ ${#packages[@]} -gt 0 ]; then
        command -v apt-get >/dev/null || return 1
        [ "$(id -u)" -eq 0 ] || as_root=(sudo -n)
        "${as_root[@]}" env DEBIAN_FRONTEND=noninteractive \
            apt-get install -y -qq --no-install-recommends "${packages[@]}" >/dev/null 2>&1 || return 1
    fi
    cross_rust || return 1
    export CARGO_TARGET_AARCH64_UNKNOWN_LINUX_GNU_LINKER=aarch64-linux-gnu-gcc
    export CARGO_TARGET_AARCH64_UNKNOWN_LINUX_GNU_RUNNER="qemu-aarch64 -L /usr/aarch64-linux-gnu"
    # For what is written in C.
    export CC_aarch64_unknown_linux_gnu=aarch64-linux-gnu-gcc CXX_aarch64_unknown_linux_gnu=aarch64-linux-gnu-g++
}
