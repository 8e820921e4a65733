# SPDX-License-Identifier: Apache-2.0
# The pure libraries for programs of others: find_package(zerodrift) and pkg-config. They are a component of their own, which
# the programs' installation and package leave out: `cmake --install build/release --component development --prefix DIR`.
include(CMakePackageConfigHelpers)
# A library after those that use it, as a linker reads static ones.
set(libraries diagnosis compensation navigation experts regression thermal twin allan core)
set(config lib/cmake/zerodrift)
foreach(library IN LISTS libraries)
  set_target_properties(zerodrift_${library} PROPERTIES EXPORT_NAME ${library})
  install(TARGETS zerodrift_${library} EXPORT zerodrift_libraries COMPONENT development EXCLUDE_FROM_ALL
          ARCHIVE DESTINATION lib FILE_SET HEADERS DESTINATION include/zerodrift)
  list(APPEND archives -lzerodrift_${library})
endforeach()
set_target_properties(zerodrift_options PROPERTIES EXPORT_NAME options)
install(TARGETS zerodrift_options EXPORT zerodrift_libraries COMPONENT development EXCLUDE_FROM_ALL)
install(EXPORT zerodrift_libraries NAMESPACE zerodrift:: DESTINATION ${config} FILE zerodrift-targets.cmake
        COMPONENT development EXCLUDE_FROM_ALL)

file(WRITE ${PROJECT_BINARY_DIR}/development/zerodrift-config.cmake "include(CMakeFindDependencyMacro)
find_dependency(Eigen3 3.4 NO_MODULE)
include(\${CMAKE_CURRENT_LIST_DIR}/zerodrift-targets.cmake)
")
write_basic_package_version_file(${PROJECT_BINARY_DIR}/development/zerodrift-config-version.cmake COMPATIBILITY SameMinorVersion)
install(FILES ${PROJECT_BINARY_DIR}/development/zerodrift-config.cmake ${PROJECT_BINARY_DIR}/development/zerodrift-config-version.cmake
        DESTINATION ${config} COMPONENT development EXCLUDE_FROM_ALL)

list(JOIN archives " " archives)
file(WRITE ${PROJECT_BINARY_DIR}/development/zerodrift.pc "prefix=\${pcfiledir}/../..
Name: zerodrift
Description: ${PROJECT_DESCRIPTION}: Allan statistics, online SVR, compensation, twin, diagnosis, navigation
Version: ${PROJECT_VERSION}
Requires: eigen3
Cflags: -I\${prefix}/include/zerodrift -std=c++20 -ffp-contract=off
Libs: -L\${prefix}/lib ${archives}
")
install(FILES ${PROJECT_BINARY_DIR}/development/zerodrift.pc DESTINATION lib/pkgconfig COMPONENT development EXCLUDE_FROM_ALL)
