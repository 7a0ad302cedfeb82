#!/usr/bin/env bash
# Installs the Debian 12 packages that are missing, then configures and builds build/release.
# Called by demo.sh and test.sh; arguments go to CMake.
set -euo pipefail
cd "$(dirname "$0")/.."

packages=(
    g++ cmake ninja-build pkg-config python3                            # tools
    glslang-dev glslang-tools spirv-tools                               # shaders
    libvulkan-dev mesa-vulkan-drivers vulkan-validationlayers           # Vulkan, lavapipe
    libglm-dev libtbb-dev libfmt-dev libxxhash-dev libhwy-dev           # libraries of the engine
    libboost-dev                                                        # of the scan
    libcli11-dev nlohmann-json3-dev libopenexr-dev libpng-dev           # of the command line
    libgtest-dev libgmock-dev libbenchmark-dev chromium                 # of the tests
    clang-format clang-tidy                                             # style
)

missing=()
for package in "${packages[@]}"; do
    dpkg-query -W -f '${Status}' "$package" 2>/dev/null | grep -q '^install ok installed$' ||
        missing+=("$package")
done
if [ ${#missing[@]} -gt 0 ]; then
    echo "Installing: ${missing[*]}"
    as_root=()
    [ "$(id -u)" -eq 0 ] || as_root=(sudo)
    "${as_root[@]}" apt-get update -q
    "${as_root[@]}" env DEBIAN_FRONTEND=noninteractive \
        apt-get install -y -q --no-install-recommends "${missing[@]}"
fi

cmake --preset release "$@"
cmake --build --preset release
