# SPDX-License-Identifier: Apache-2.0
# Manual pages (section 1), made of the programs' own help when they are built.
find_program(HELP2MAN help2man REQUIRED)
set(programs zerodrift compensation gyro_publisher thermal_publisher allan_monitor navigation_filter ctl console discovery_server)
set(folder ${PROJECT_BINARY_DIR}/man/man1)
add_custom_command(
  OUTPUT ${folder}/zerodrift.1.gz
  COMMAND ${PROJECT_SOURCE_DIR}/cmake/man_pages.sh ${CMAKE_RUNTIME_OUTPUT_DIRECTORY} ${folder} ${PROJECT_VERSION}
  DEPENDS ${programs} ${PROJECT_SOURCE_DIR}/cmake/man_pages.sh
  COMMENT "Making manual pages of the programs' help")
add_custom_target(man_pages ALL DEPENDS ${folder}/zerodrift.1.gz)
install(DIRECTORY ${folder} DESTINATION share/man)
