# What is installed, and as which Debian packages: comap-core, comap-edge, comap-tools, libcomap-dev, libcomap-robot1,
# libcomap-robot-dev.
include(GNUInstallDirs)

install(TARGETS mapping_core RUNTIME COMPONENT core)
install(TARGETS edge_agent RUNTIME COMPONENT edge)
install(TARGETS fleet RUNTIME COMPONENT tools)

# A service's configuration holds only what differs from the defaults, so that new defaults leave it alone. All keys with
# their defaults are an example.
install(FILES containers/services/core.yaml DESTINATION /etc/comap COMPONENT core)
install(FILES containers/services/robot.yaml DESTINATION /etc/comap COMPONENT edge)
install(FILES config/core.yaml DESTINATION ${CMAKE_INSTALL_DATADIR}/doc/comap-core/examples COMPONENT core)
install(FILES config/robot.yaml DESTINATION ${CMAKE_INSTALL_DATADIR}/doc/comap-edge/examples COMPONENT edge)

# Manual pages and completion. The programs themselves write them.
if(NOT CMAKE_CROSSCOMPILING)
  set(tools ${PROJECT_BINARY_DIR}/tools)
  add_custom_command(
    OUTPUT ${tools}/fleet
    COMMAND fleet man ${tools}/man1
    COMMAND fleet completion zsh > ${tools}/_fleet
    COMMAND fleet completion bash > ${tools}/fleet
    DEPENDS fleet VERBATIM)
  foreach(program mapping_core edge_agent)
    add_custom_command(
      OUTPUT ${tools}/${program}.1
      COMMAND ${program} --man > ${tools}/${program}.1
      COMMAND ${program} --completion bash > ${tools}/${program}
      COMMAND ${program} --completion zsh > ${tools}/_${program}
      DEPENDS ${program} VERBATIM)
  endforeach()
  file(MAKE_DIRECTORY ${tools})
  add_custom_target(packaged_files ALL DEPENDS ${tools}/mapping_core.1 ${tools}/edge_agent.1 ${tools}/fleet)
  set(completions_bash ${CMAKE_INSTALL_DATADIR}/bash-completion/completions)
  set(completions_zsh ${CMAKE_INSTALL_DATADIR}/zsh/vendor-completions)
  foreach(program_of mapping_core:core edge_agent:edge fleet:tools)
    string(REPLACE ":" ";" program_of ${program_of})
    list(GET program_of 0 program)
    list(GET program_of 1 package)
    install(FILES ${tools}/${program} DESTINATION ${completions_bash} COMPONENT ${package})
    install(FILES ${tools}/_${program} DESTINATION ${completions_zsh} COMPONENT ${package})
  endforeach()
  install(FILES ${tools}/mapping_core.1 DESTINATION ${CMAKE_INSTALL_MANDIR}/man1 COMPONENT core)
  install(FILES ${tools}/edge_agent.1 DESTINATION ${CMAKE_INSTALL_MANDIR}/man1 COMPONENT edge)
  install(DIRECTORY ${tools}/man1 DESTINATION ${CMAKE_INSTALL_MANDIR} COMPONENT tools)
endif()
install(FILES containers/systemd/comap-core.service DESTINATION lib/systemd/system COMPONENT core)
install(FILES containers/systemd/comap-edge.service DESTINATION lib/systemd/system COMPONENT edge)
install(FILES containers/systemd/comap-discovery.service DESTINATION lib/systemd/system COMPONENT tools)
set(package_of_dev libcomap-dev)
set(package_of_robot libcomap-robot1)
set(package_of_robot_dev libcomap-robot-dev)
foreach(package core edge tools dev robot robot_dev)
  set(name comap-${package})
  if(DEFINED package_of_${package})
    set(name ${package_of_${package}})
  endif()
  install(FILES LICENSE DESTINATION ${CMAKE_INSTALL_DATADIR}/doc/${name} RENAME copyright COMPONENT ${package})
endforeach()
# As in the source, so that links between them hold.
set(documentation ${CMAKE_INSTALL_DATADIR}/doc/comap-tools)
install(FILES README.md CHANGELOG.md LICENSE DESTINATION ${documentation} COMPONENT tools)
install(DIRECTORY docs DESTINATION ${documentation} COMPONENT tools)

# For programs that speak with robots and core themselves: types, messages and their encoding, link.
set(exported types proto codec keys discovery link session)
list(TRANSFORM exported PREPEND comap_ OUTPUT_VARIABLE exported_targets)
install(TARGETS ${exported_targets} EXPORT comap ARCHIVE DESTINATION ${CMAKE_INSTALL_LIBDIR} COMPONENT dev)
install(EXPORT comap NAMESPACE comap:: DESTINATION ${CMAKE_INSTALL_LIBDIR}/cmake/comap COMPONENT dev)
foreach(room types codec keys discovery link session)
  install(DIRECTORY protocol/${room} DESTINATION ${CMAKE_INSTALL_INCLUDEDIR}/comap/protocol COMPONENT dev
    FILES_MATCHING PATTERN *.h)
endforeach()
install(DIRECTORY protocol/proto/comap DESTINATION ${CMAKE_INSTALL_DATADIR}/comap/proto COMPONENT dev
  FILES_MATCHING PATTERN *.proto)
install(FILES docs/wire.md DESTINATION ${CMAKE_INSTALL_DATADIR}/doc/libcomap-dev COMPONENT dev)
include(CMakePackageConfigHelpers)
write_basic_package_version_file(${PROJECT_BINARY_DIR}/comap-config-version.cmake COMPATIBILITY SameMinorVersion)
install(FILES cmake/comap-config.cmake ${PROJECT_BINARY_DIR}/comap-config-version.cmake
  DESTINATION ${CMAKE_INSTALL_LIBDIR}/cmake/comap COMPONENT dev)

# For programs on a robot that ask its agent: a library with a binary interface that stays.
install(TARGETS comap_robot EXPORT comap_robot
  LIBRARY DESTINATION ${CMAKE_INSTALL_LIBDIR} COMPONENT robot NAMELINK_COMPONENT robot_dev)
install(EXPORT comap_robot NAMESPACE comap:: DESTINATION ${CMAKE_INSTALL_LIBDIR}/cmake/comap_robot
  FILE comap_robot-config.cmake COMPONENT robot_dev)
write_basic_package_version_file(${PROJECT_BINARY_DIR}/comap_robot-config-version.cmake COMPATIBILITY SameMinorVersion)
set(pkgconfig ${CMAKE_INSTALL_LIBDIR}/pkgconfig)
file(RELATIVE_PATH up_from_pkgconfig /${pkgconfig} /)  # its prefix is where it comes to lie, a package's too
configure_file(robot_api/comap-robot.pc.in ${PROJECT_BINARY_DIR}/comap-robot.pc @ONLY)
install(FILES ${PROJECT_BINARY_DIR}/comap_robot-config-version.cmake
  DESTINATION ${CMAKE_INSTALL_LIBDIR}/cmake/comap_robot COMPONENT robot_dev)
install(FILES ${PROJECT_BINARY_DIR}/comap-robot.pc DESTINATION ${pkgconfig} COMPONENT robot_dev)
install(FILES robot_api/comap_robot.h robot_api/comap_robot.hpp DESTINATION ${CMAKE_INSTALL_INCLUDEDIR}
  COMPONENT robot_dev)
install(FILES docs/robot-api.md docs/wire.md DESTINATION ${CMAKE_INSTALL_DATADIR}/doc/libcomap-robot-dev COMPONENT robot_dev)
install(DIRECTORY robot_api/example/ DESTINATION ${CMAKE_INSTALL_DATADIR}/doc/libcomap-robot-dev/examples
  COMPONENT robot_dev)

set(CPACK_GENERATOR DEB)
set(CPACK_PACKAGE_NAME comap)
set(CPACK_PACKAGE_VENDOR CoMap)
set(CPACK_PACKAGE_CONTACT "CoMap developers <comap@localhost>")
set(CPACK_PACKAGE_DIRECTORY ${PROJECT_BINARY_DIR}/packages)
set(CPACK_PACKAGING_INSTALL_PREFIX /usr)
set(CPACK_STRIP_FILES ON)
set(CPACK_COMPONENTS_ALL core edge tools dev robot robot_dev)
set(CPACK_COMPONENTS_GROUPING IGNORE)
set(CPACK_DEB_COMPONENT_INSTALL ON)
set(CPACK_DEBIAN_FILE_NAME DEB-DEFAULT)
set(CPACK_DEBIAN_PACKAGE_RELEASE 1)
set(CPACK_DEBIAN_PACKAGE_SECTION science)
set(CPACK_DEBIAN_PACKAGE_SHLIBDEPS ON)
set(CPACK_DEBIAN_PACKAGE_GENERATE_SHLIBS ON)  # of libraries: which package a program that links them needs
set(CPACK_DEBIAN_PACKAGE_CONTROL_STRICT_PERMISSION ON)

set(debian ${PROJECT_SOURCE_DIR}/containers/debian)
set(CPACK_DEBIAN_CORE_PACKAGE_NAME comap-core)
set(CPACK_COMPONENT_CORE_DESCRIPTION "Mapping core of CoMap
 Takes the keyframes of all robots of a site and makes one dense map of them,
 on any Vulkan device or on the processor alone.")
set(CPACK_DEBIAN_CORE_PACKAGE_DEPENDS "adduser, mesa-vulkan-drivers | vulkan-icd")
set(CPACK_DEBIAN_CORE_PACKAGE_CONTROL_EXTRA
  "${debian}/core/postinst;${debian}/core/prerm;${debian}/core/postrm;${debian}/core/conffiles")
set(CPACK_DEBIAN_EDGE_PACKAGE_NAME comap-edge)
set(CPACK_COMPONENT_EDGE_DESCRIPTION "Robot's agent of CoMap
 Tracks the motion of an RGB-D camera, ships keyframes to the mapping core and
 takes the joint map back.")
set(CPACK_DEBIAN_EDGE_PACKAGE_DEPENDS "adduser")
set(CPACK_DEBIAN_EDGE_PACKAGE_CONTROL_EXTRA
  "${debian}/edge/postinst;${debian}/edge/prerm;${debian}/edge/postrm;${debian}/edge/conffiles")
set(CPACK_DEBIAN_TOOLS_PACKAGE_NAME comap-tools)
set(CPACK_COMPONENT_TOOLS_DESCRIPTION "Fleet tools of CoMap
 Inspect, judge, repair and export maps; replay data sets as several robots.")
set(CPACK_DEBIAN_TOOLS_PACKAGE_DEPENDS "mesa-vulkan-drivers | vulkan-icd")
set(CPACK_DEBIAN_TOOLS_PACKAGE_RECOMMENDS "comap-core, comap-edge")
set(CPACK_DEBIAN_TOOLS_PACKAGE_CONTROL_EXTRA
  "${debian}/tools/postinst;${debian}/tools/prerm;${debian}/tools/postrm")
set(CPACK_DEBIAN_DEV_PACKAGE_NAME libcomap-dev)
set(CPACK_COMPONENT_DEV_DESCRIPTION "Protocol library of CoMap
 Types, messages and link, for programs that speak with robots and core.")
set(CPACK_DEBIAN_DEV_PACKAGE_SECTION libdevel)
set(CPACK_DEBIAN_DEV_PACKAGE_DEPENDS
  "libeigen3-dev, libprotobuf-dev, libfastrtps-dev, libfastcdr-dev, libssl-dev, libjpeg62-turbo-dev, libturbojpeg0-dev, libzstd-dev")
set(CPACK_DEBIAN_ROBOT_PACKAGE_NAME libcomap-robot1)
set(CPACK_COMPONENT_ROBOT_DESCRIPTION "Pose and map of a robot of CoMap for its other programs
 Reads from the agent on the same robot where it is and which surfaces are
 around it.")
set(CPACK_DEBIAN_ROBOT_PACKAGE_SECTION libs)
set(CPACK_DEBIAN_ROBOT_DEV_PACKAGE_NAME libcomap-robot-dev)
set(CPACK_COMPONENT_ROBOT_DEV_DESCRIPTION "Pose and map of a robot of CoMap for its other programs: development
 Headers for C and C++, and examples.")
set(CPACK_DEBIAN_ROBOT_DEV_PACKAGE_SECTION libdevel)
set(CPACK_DEBIAN_ROBOT_DEV_PACKAGE_DEPENDS "libcomap-robot1 (>= ${PROJECT_VERSION})")
set(CPACK_COMPONENT_CORE_REQUIRED ON)
if(NOT CMAKE_CROSSCOMPILING)  # their configurations are written by the programs
  include(CPack)
endif()
