# SPDX-License-Identifier: Apache-2.0
find_program(ZERODRIFT_NPM npm REQUIRED)

# zerodrift_npm_ci(<folder> COMMENT <text> PACKAGES <file>...)
# Installs into <folder> what these lists of packages name; <folder>/packages.stamp is there once it is done. Only a changed list
# asks the registry.
function(zerodrift_npm_ci folder)
  cmake_parse_arguments(ARG "" "COMMENT" "PACKAGES" ${ARGN})
  add_custom_command(
    OUTPUT ${folder}/packages.stamp
    COMMAND ${CMAKE_COMMAND} -E make_directory ${folder}
    COMMAND ${CMAKE_COMMAND} -E copy_if_different ${ARG_PACKAGES} ${folder}
    COMMAND ${CMAKE_COMMAND} -E chdir ${folder} ${ZERODRIFT_NPM} ci --prefer-offline --loglevel=error
    COMMAND ${CMAKE_COMMAND} -E touch ${folder}/packages.stamp
    DEPENDS ${ARG_PACKAGES}
    COMMENT "${ARG_COMMENT}: npm ci"
    VERBATIM)
endfunction()
