#!/usr/bin/env bash
# Installs the Debian 12 packages that are missing, then configures and builds build/release:
#     scripts/setup.sh program     what merl-scan itself needs, and builds it
#     scripts/setup.sh tests       with what the tests need, and builds everything
# Both build the same files in the same way, so what one has built the other does not build again.
# The first builds without MPI unless that is there already (libopenmpi-dev; docs/many-machines.md).
# Further arguments go to CMake.
set -euo pipefail
cd "$(dirname "$0")/.."

packages=(
    g++ cmake ninja-build pkg-config                                    # tools
    glslang-dev glslang-tools   # shaders; the CMake files of the first name the program of the second
    libvulkan-dev mesa-vulkan-drivers                                   # Vulkan, lavapipe
    libglm-dev libtbb-dev libfmt-dev libxxhash-dev libssl-dev libhwy-dev  # libraries of the engine
    libboost-dev libnlopt-dev                                           # of the scan
    libcli11-dev nlohmann-json3-dev libopenexr-dev libpng-dev zlib1g-dev  # of the command line
)
case "${1:-}" in
program) options=(-DMERL_SCAN_UNITY=ON -DMERL_SCAN_TESTS=OFF -DMERL_SCAN_PYTHON=OFF) ;;
tests)
    options=(-DMERL_SCAN_UNITY=ON -DMERL_SCAN_TESTS=ON -DPython3_EXECUTABLE=/usr/bin/python3)  # Debian's
    packages+=(
        pybind11-dev python3-dev python3-numpy mypy            # the Python module and its tests
        python3-venv python3-pip python3-setuptools python3-wheel  # its package
        python3-nbclient python3-nbformat python3-ipykernel python3-matplotlib python3-pandas  # its notebook and tables
        python3 spirv-tools vulkan-validationlayers chromium firefox-esr  # what tests run
        librsvg2-bin                                           # opens pictures that pages save
        zsh fish groff-base dpkg-dev                           # readers of what the program says of itself; packages
        libgtest-dev libgmock-dev libbenchmark-dev             # what they are made of
        libopenmpi-dev openmpi-bin                             # several processes of `distances`
        clang-format clang-tidy clang libclang-rt-dev          # style, a second compiler, its sanitizers
    )
    ;;
*)
    echo "$0: found \"${1:-}\"; expected program or tests" >&2
    exit 2
    ;;
esac

command -v dpkg-query apt-get >/dev/null || {
    echo "$0: this is no Debian; install what Debian calls ${packages[*]}, then: cmake --preset release ${options[*]} && cmake --build --preset release" >&2
    exit 1
}
missing=()
for package in "${packages[@]}"; do
    dpkg-query -W -f '${Status}' "$package" 2>/dev/null | grep -q '^install ok installed$' ||
        missing+=("$package")
done
if [ ${#missing[@]} -gt 0 ]; then
    as_root=()
    if [ "$(id -u)" -ne 0 ]; then
        command -v sudo >/dev/null || {
            echo "$0: packages are missing, and without sudo only root can install them: apt-get install --no-install-recommends ${missing[*]}" >&2
            exit 1
        }
        as_root=(sudo)
    fi
    echo "Installing: ${missing[*]}"
    "${as_root[@]}" apt-get update -q
    "${as_root[@]}" env DEBIAN_FRONTEND=noninteractive \
        apt-get install -y -q --no-install-recommends "${missing[@]}"
fi

cmake --preset release "${options[@]}" "${@:2}"
cmake --build --preset release
