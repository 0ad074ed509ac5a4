include(CMakePackageConfigHelpers)
set(hooke_config_dir ${CMAKE_INSTALL_LIBDIR}/cmake/hooke)
install(EXPORT hooke-targets NAMESPACE hooke:: DESTINATION ${hooke_config_dir})
configure_package_config_file(cmake/hooke-config.cmake.in ${PROJECT_BINARY_DIR}/hooke-config.cmake
                              INSTALL_DESTINATION ${hooke_config_dir})
write_basic_package_version_file(${PROJECT_BINARY_DIR}/hooke-config-version.cmake
                                 COMPATIBILITY SameMinorVersion)
install(FILES ${PROJECT_BINARY_DIR}/hooke-config.cmake ${PROJECT_BINARY_DIR}/hooke-config-version.cmake
        DESTINATION ${hooke_config_dir})
