# What a user installs: the command, the libraries with their headers, find_package(kinespace), pkg-config and a .deb.
include(GNUInstallDirs)
include(CMakePackageConfigHelpers)

# The sample motions serve the demo and the tests only.
set(installed_modules ${KINESPACE_MODULES})
list(REMOVE_ITEM installed_modules samples)

# kinespace::kinespace: everything that is free of the GPL. kinespace::alglib, where it is built, is asked for by name
# (licence.h).
add_library(kinespace_all INTERFACE)
add_library(kinespace::kinespace ALIAS kinespace_all)
set_target_properties(kinespace_all PROPERTIES EXPORT_NAME kinespace)
set(free_modules ${installed_modules})
list(REMOVE_ITEM free_modules alglib)

set(installed_targets kinespace_all)
if(KINESPACE_ALGLIB)
  set_target_properties(kinespace_alglib_itself PROPERTIES EXPORT_NAME alglib_itself)
  list(APPEND installed_targets kinespace_alglib_itself)
endif()
foreach(module IN LISTS free_modules)
  target_link_libraries(kinespace_all INTERFACE kinespace_${module})
endforeach()
foreach(module IN LISTS installed_modules)
  list(APPEND installed_targets kinespace_${module})
  get_target_property(folder kinespace_${module} SOURCE_DIR)
  install(DIRECTORY ${folder} DESTINATION ${CMAKE_INSTALL_INCLUDEDIR}/kinespace FILES_MATCHING PATTERN "*.h"
          PATTERN detail EXCLUDE                   # private to its folder
          REGEX "gltf/(tiny|arrays)\\.h$" EXCLUDE)  # of libraries that their users need not have
endforeach()
install(FILES include/kinespace.h ${KINESPACE_INCLUDE}/kinespace/version.h ${KINESPACE_INCLUDE}/kinespace/licence.h DESTINATION ${CMAKE_INSTALL_INCLUDEDIR}/kinespace)
install(TARGETS kinespace_command RUNTIME DESTINATION ${CMAKE_INSTALL_BINDIR})
install(TARGETS ${installed_targets} EXPORT kinespaceTargets ARCHIVE DESTINATION ${CMAKE_INSTALL_LIBDIR})

set(package_dir ${CMAKE_INSTALL_LIBDIR}/cmake/kinespace)
install(EXPORT kinespaceTargets NAMESPACE kinespace:: DESTINATION ${package_dir})
configure_package_config_file(cmake/kinespaceConfig.cmake.in kinespaceConfig.cmake INSTALL_DESTINATION ${package_dir})
write_basic_package_version_file(kinespaceConfigVersion.cmake COMPATIBILITY SameMinorVersion)
install(FILES ${CMAKE_CURRENT_BINARY_DIR}/kinespaceConfig.cmake ${CMAKE_CURRENT_BINARY_DIR}/kinespaceConfigVersion.cmake
        DESTINATION ${package_dir})

# A static library stands before those it uses, so the arrows' order is turned round.
set(pkgconfig_libs ${free_modules})
list(REVERSE pkgconfig_libs)
list(TRANSFORM pkgconfig_libs PREPEND -lkinespace_)
list(JOIN pkgconfig_libs " " pkgconfig_libs)
file(RELATIVE_PATH pkgconfig_up /${CMAKE_INSTALL_LIBDIR} /)
configure_file(cmake/kinespace.pc.in kinespace.pc @ONLY)
install(FILES ${CMAKE_CURRENT_BINARY_DIR}/kinespace.pc DESTINATION ${CMAKE_INSTALL_LIBDIR}/pkgconfig)
if(KINESPACE_ALGLIB)
  configure_file(cmake/kinespace-alglib.pc.in kinespace-alglib.pc @ONLY)
  install(FILES ${CMAKE_CURRENT_BINARY_DIR}/kinespace-alglib.pc DESTINATION ${CMAKE_INSTALL_LIBDIR}/pkgconfig)
endif()

install(FILES README.md CHANGELOG.md CONTRIBUTING.md DESTINATION ${CMAKE_INSTALL_DOCDIR})
file(READ LICENSE copyright)
if(KINESPACE_ALGLIB)
  string(PREPEND copyright "The sources are under the Apache License 2.0 below. The command kinespace is linked with ALGLIB, which is under the
GNU General Public License, version 2 or later (/usr/share/common-licenses/GPL-2): as a whole it is under the GPL.\n\n")
endif()
file(WRITE ${CMAKE_CURRENT_BINARY_DIR}/copyright "${copyright}")
install(FILES ${CMAKE_CURRENT_BINARY_DIR}/copyright DESTINATION ${CMAKE_INSTALL_DOCDIR})
install(DIRECTORY docs/ DESTINATION ${CMAKE_INSTALL_DOCDIR})

set(CPACK_GENERATOR DEB)
set(CPACK_PACKAGING_INSTALL_PREFIX /usr)
set(CPACK_STRIP_FILES ON)
set(CPACK_PACKAGE_CONTACT "The kinespace authors <kinespace@authors.invalid>")
set(CPACK_PACKAGE_DESCRIPTION_SUMMARY "${PROJECT_DESCRIPTION}")
set(CPACK_DEBIAN_FILE_NAME DEB-DEFAULT)
set(CPACK_DEBIAN_PACKAGE_SECTION science)
set(CPACK_DEBIAN_PACKAGE_SHLIBDEPS ON)
set(CPACK_DEBIAN_PACKAGE_RECOMMENDS pocl-opencl-icd)
# For programs built on the libraries: what kinespaceConfig.cmake and kinespace.pc look for.
set(CPACK_DEBIAN_PACKAGE_SUGGESTS "libeigen3-dev, libarmadillo-dev, libopenblas-dev, ocl-icd-opencl-dev, \
opencl-clhpp-headers, libfmt-dev, libtbb-dev, libxxhash-dev, libzstd-dev, liblzma-dev, libsqlite3-dev, libdraco-dev, libmeshoptimizer-dev, libpng-dev, nlohmann-json3-dev, pkg-config")
if(KINESPACE_ALGLIB)
  string(APPEND CPACK_DEBIAN_PACKAGE_SUGGESTS ", libalglib-dev")
endif()
include(CPack)
