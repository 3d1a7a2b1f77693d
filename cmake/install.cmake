include(CMakePackageConfigHelpers)
get_property(planar_mapping_modules GLOBAL PROPERTY PLANAR_MAPPING_MODULES)
set(planar_mapping_config_dir ${CMAKE_INSTALL_LIBDIR}/cmake/planar_mapping)
configure_package_config_file(cmake/planar_mapping-config.cmake.in
  ${PROJECT_BINARY_DIR}/planar_mapping-config.cmake INSTALL_DESTINATION ${planar_mapping_config_dir})
write_basic_package_version_file(${PROJECT_BINARY_DIR}/planar_mapping-config-version.cmake
  COMPATIBILITY SameMinorVersion)
install(FILES ${PROJECT_BINARY_DIR}/planar_mapping-config.cmake ${PROJECT_BINARY_DIR}/planar_mapping-config-version.cmake
  DESTINATION ${planar_mapping_config_dir} COMPONENT development)
# The library looks for ready configurations from its own folder: in the build tree they are where they will be installed.
install(DIRECTORY config/ DESTINATION ${CMAKE_INSTALL_DATADIR}/planar_mapping/config COMPONENT tools)
file(MAKE_DIRECTORY ${PROJECT_BINARY_DIR}/share/planar_mapping)
file(CREATE_LINK ${PROJECT_SOURCE_DIR}/config ${PROJECT_BINARY_DIR}/share/planar_mapping/config SYMBOLIC)
