# What `cmake --install` puts where, what other projects find it by, and the packages of CPack.

include(GNUInstallDirs)
include(CMakePackageConfigHelpers)
set(CMAKE_INSTALL_DEFAULT_COMPONENT_NAME program)

install(TARGETS merl-scan RUNTIME)

# Man pages and completions: the program makes them of what it declares.
set(documents ${PROJECT_BINARY_DIR}/share)
add_custom_command(OUTPUT ${documents}/made
  COMMAND ${CMAKE_COMMAND} -E rm -rf ${documents}
  COMMAND ${CMAKE_COMMAND} -E make_directory ${documents}/man/man1 ${documents}/bash-completion/completions
          ${documents}/zsh/vendor-completions ${documents}/fish/vendor_completions.d
  COMMAND merl-scan man --out ${documents}/man/man1
  COMMAND merl-scan completion bash > ${documents}/bash-completion/completions/merl-scan
  COMMAND merl-scan completion zsh > ${documents}/zsh/vendor-completions/_merl-scan
  COMMAND merl-scan completion fish > ${documents}/fish/vendor_completions.d/merl-scan.fish
  COMMAND ${CMAKE_COMMAND} -E touch ${documents}/made
  DEPENDS merl-scan VERBATIM)
add_custom_target(documents ALL DEPENDS ${documents}/made)
install(DIRECTORY ${documents}/man ${documents}/bash-completion ${documents}/zsh ${documents}/fish
        DESTINATION ${CMAKE_INSTALL_DATADIR})
install(FILES LICENSE CITATION.cff CHANGELOG.md docs/licences.md DESTINATION ${CMAKE_INSTALL_DOCDIR})

# The libraries, with the headers below one root: #include "app/pipeline/scan.h".
set(headers ${CMAKE_INSTALL_INCLUDEDIR}/merl_scan)
set(libraries pipeline engine device glsl_headers scan base)  # each before those that it uses
foreach(library IN LISTS libraries)
  set_target_properties(${library} PROPERTIES OUTPUT_NAME merl_scan_${library})
  target_include_directories(${library} INTERFACE $<INSTALL_INTERFACE:${headers}>)
endforeach()
install(TARGETS ${libraries} EXPORT merl_scan ARCHIVE COMPONENT development)
install(DIRECTORY engine scan DESTINATION ${headers} COMPONENT development FILES_MATCHING PATTERN "*.h")
install(DIRECTORY app/pipeline ${PROJECT_BINARY_DIR}/app/app/pipeline DESTINATION ${headers}/app COMPONENT development
        FILES_MATCHING PATTERN "*.h" PATTERN "abc_golden.h" EXCLUDE)

set(package ${CMAKE_INSTALL_LIBDIR}/cmake/merl_scan)
install(EXPORT merl_scan NAMESPACE merl_scan:: FILE merl_scanTargets.cmake DESTINATION ${package} COMPONENT development)
configure_package_config_file(cmake/merl_scanConfig.cmake.in merl_scanConfig.cmake INSTALL_DESTINATION ${package}
                              NO_SET_AND_CHECK_MACRO)
# Nothing is promised between versions below 1.
write_basic_package_version_file(merl_scanConfigVersion.cmake COMPATIBILITY SameMinorVersion)
install(FILES ${PROJECT_BINARY_DIR}/merl_scanConfig.cmake ${PROJECT_BINARY_DIR}/merl_scanConfigVersion.cmake
        DESTINATION ${package} COMPONENT development)

# The libraries are static: whoever links them needs what they use, so all of it is public here.
set(LIBRARY_FLAGS "")
foreach(library IN LISTS libraries)
  string(APPEND LIBRARY_FLAGS " -lmerl_scan_${library}")
endforeach()
# The folder may be moved: its place is that of the file.
file(RELATIVE_PATH PREFIX_FROM_PC "/${CMAKE_INSTALL_LIBDIR}/pkgconfig" "/")
string(REGEX REPLACE "/$" "" PREFIX_FROM_PC "${PREFIX_FROM_PC}")
configure_file(cmake/merl_scan.pc.in merl_scan.pc @ONLY)
install(FILES ${PROJECT_BINARY_DIR}/merl_scan.pc DESTINATION ${CMAKE_INSTALL_LIBDIR}/pkgconfig COMPONENT development)

# `cpack -G DEB`: the program, what other programs are built with, and the module for Debian's Python.
set(CPACK_PACKAGE_NAME merl-scan)
set(CPACK_PACKAGE_CONTACT "The merl-scan developers <merl-scan@localhost>")
set(CPACK_PACKAGE_DESCRIPTION_SUMMARY ${PROJECT_DESCRIPTION})
set(CPACK_PACKAGING_INSTALL_PREFIX /usr)
set(CPACK_STRIP_FILES ON)
set(CPACK_GENERATOR DEB)
set(CPACK_DEB_COMPONENT_INSTALL ON)
set(CPACK_COMPONENTS_ALL program development)
set(CPACK_DEBIAN_FILE_NAME DEB-DEFAULT)
set(CPACK_DEBIAN_PACKAGE_SECTION science)
set(CPACK_DEBIAN_PACKAGE_SHLIBDEPS ON)
set(CPACK_DEBIAN_PROGRAM_PACKAGE_NAME merl-scan)
set(CPACK_DEBIAN_PROGRAM_PACKAGE_RECOMMENDS "mesa-vulkan-drivers, libvulkan1")  # without them: the processor alone
set(CPACK_DEBIAN_DEVELOPMENT_PACKAGE_NAME libmerl-scan-dev)
set(CPACK_DEBIAN_DEVELOPMENT_PACKAGE_SECTION libdevel)
set(CPACK_DEBIAN_DEVELOPMENT_PACKAGE_SHLIBDEPS OFF)
set(CPACK_DEBIAN_DEVELOPMENT_PACKAGE_DEPENDS
    "glslang-dev, glslang-tools, libboost-dev, libfmt-dev, libglm-dev, libhwy-dev, libnlopt-dev, libssl-dev, libtbb-dev, libvulkan-dev, libxxhash-dev, nlohmann-json3-dev, pkg-config, spirv-tools")
if(MERL_SCAN_PYTHON)
  find_package(Python3 REQUIRED COMPONENTS Interpreter)
  math(EXPR next_minor "${Python3_VERSION_MINOR} + 1")
  list(APPEND CPACK_COMPONENTS_ALL dist_packages)
  set(CPACK_DEBIAN_DIST_PACKAGES_PACKAGE_NAME python3-merl-scan)
  set(CPACK_DEBIAN_DIST_PACKAGES_PACKAGE_SECTION python)
  # Beside what dpkg-shlibdeps finds; compiled for this one version of Python.
  set(CPACK_DEBIAN_DIST_PACKAGES_PACKAGE_DEPENDS
      "python3 (>= 3.${Python3_VERSION_MINOR}), python3 (<< 3.${next_minor}), python3-numpy")
  set(CPACK_DEBIAN_DIST_PACKAGES_PACKAGE_RECOMMENDS ${CPACK_DEBIAN_PROGRAM_PACKAGE_RECOMMENDS})
  set(CPACK_DEBIAN_DIST_PACKAGES_PACKAGE_SUGGESTS "python3-pandas, python3-tqdm")
endif()
include(CPack)
