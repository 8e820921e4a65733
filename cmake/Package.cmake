# SPDX-License-Identifier: Apache-2.0
# `cpack` in a release build's folder makes zerodrift_<version>_<architecture>.deb of what `cmake --install` installs.
# Debian's copyright file: the project's licence, and those of the packages that the page was bundled of.
set(copyrights \"${PROJECT_SOURCE_DIR}/deploy/debian/copyright\")
if(ZERODRIFT_BUILD_PAGE)
  string(APPEND copyrights " \"${PROJECT_BINARY_DIR}/share/zerodrift/console/licences.txt\"")
endif()
install(CODE "set(text)
foreach(part ${copyrights})
  file(READ \"\${part}\" read)
  string(APPEND text \"\${read}\\n\")
endforeach()
file(WRITE \"\$ENV{DESTDIR}\${CMAKE_INSTALL_PREFIX}/share/doc/zerodrift/copyright\" \"\${text}\")
list(APPEND CMAKE_INSTALL_MANIFEST_FILES \${CMAKE_INSTALL_PREFIX}/share/doc/zerodrift/copyright)")

set(CPACK_GENERATOR DEB)
set(CPACK_PACKAGE_NAME zerodrift)
set(CPACK_PACKAGE_CONTACT zerodrift)
set(CPACK_PACKAGE_VERSION ${PROJECT_VERSION})
set(CPACK_PACKAGE_DESCRIPTION_SUMMARY ${PROJECT_DESCRIPTION})
set(CPACK_STRIP_FILES ON)
# With DESTDIR, as what is written at installation names its prefix.
set(CPACK_SET_DESTDIR ON)
set(CPACK_INSTALL_PREFIX /usr)
set(CPACK_DEBIAN_FILE_NAME DEB-DEFAULT)
set(CPACK_DEBIAN_PACKAGE_SECTION science)
set(CPACK_DEBIAN_PACKAGE_SHLIBDEPS ON)
set(CPACK_DEBIAN_PACKAGE_RECOMMENDS gnuplot-nox)  # pictures of reports
set(CPACK_DEBIAN_PACKAGE_CONTROL_EXTRA ${PROJECT_SOURCE_DIR}/deploy/debian/postinst;${PROJECT_SOURCE_DIR}/deploy/debian/prerm;${PROJECT_SOURCE_DIR}/deploy/debian/postrm)
include(CPack)
