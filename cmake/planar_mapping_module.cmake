# One call makes a module: its library, its alias and its flags. Its rooms add sources and headers.
#
#   planar_mapping_module(NAME core PUBLIC Eigen3::Eigen PRIVATE Threads::Threads PRECOMPILE <Eigen/Geometry>)
#   planar_mapping_room(core SOURCES a.cpp ... HEADERS a.h ...)        # HEADERS: what is installed
#
# Without PRECOMPILE the module uses the precompiled header of core. Modules are exported as planar_mapping::NAME.
# COMPONENT is the install component of the library, runtime if it is not given. A PCL module, which is laid out as
# PCL's are, names its sources and keeps its headers below include/.
set_property(GLOBAL PROPERTY PLANAR_MAPPING_MODULES "")

# What is installed finds our libraries by its own place: it runs with an empty environment, wherever it is moved.
function(planar_mapping_set_rpath target folder)
  file(RELATIVE_PATH to_libraries /prefix/${folder} /prefix/${CMAKE_INSTALL_LIBDIR})
  set_target_properties(${target} PROPERTIES INSTALL_RPATH "$ORIGIN/${to_libraries}")
endfunction()

function(planar_mapping_set_flags target)
  target_compile_features(${target} PUBLIC cxx_std_17)
  set_target_properties(${target} PROPERTIES UNITY_BUILD ${PLANAR_MAPPING_UNITY_BUILD} UNITY_BUILD_BATCH_SIZE 4)
  target_compile_options(${target} PRIVATE -Wall -Wextra -Wpedantic -Wshadow -Wnon-virtual-dtor -Woverloaded-virtual)
  if(PLANAR_MAPPING_WARNINGS_AS_ERRORS)
    target_compile_options(${target} PRIVATE -Werror)
  endif()
  if(PLANAR_MAPPING_SANITIZE STREQUAL "address")
    target_compile_options(${target} PRIVATE -fsanitize=address,undefined -fno-sanitize-recover=undefined
                           -fno-omit-frame-pointer)
    # Under asan Eigen would align memory by hand, and free by hand what packaged PCL took from malloc.
    target_compile_definitions(${target} PRIVATE EIGEN_MALLOC_ALREADY_ALIGNED=1)
    target_link_options(${target} PRIVATE -fsanitize=address,undefined)
    if(CMAKE_CXX_COMPILER_ID MATCHES Clang)
      # gcc says by this macro that it sanitizes; types of packaged libraries have no instrumented vtables.
      target_compile_definitions(${target} PRIVATE __SANITIZE_ADDRESS__)
      target_compile_options(${target} PRIVATE -fno-sanitize=vptr,function)
    endif()
  elseif(PLANAR_MAPPING_SANITIZE STREQUAL "thread")
    target_compile_options(${target} PRIVATE -fsanitize=thread -fno-omit-frame-pointer)
    target_link_options(${target} PRIVATE -fsanitize=thread)
  elseif(PLANAR_MAPPING_SANITIZE)
    message(FATAL_ERROR "PLANAR_MAPPING_SANITIZE must be empty, address or thread")
  endif()
  if(PLANAR_MAPPING_FUZZ)
    target_compile_options(${target} PRIVATE -fsanitize=fuzzer-no-link,float-cast-overflow
                           -fno-sanitize-recover=float-cast-overflow)
  endif()
endfunction()

function(planar_mapping_module)
  cmake_parse_arguments(ARG "" "NAME;COMPONENT" "SOURCES;PUBLIC;PRIVATE;PRECOMPILE" ${ARGN})
  if(NOT ARG_COMPONENT)
    set(ARG_COMPONENT runtime)
  endif()
  set(target planar_mapping_${ARG_NAME})
  add_library(${target} ${ARG_SOURCES})
  add_library(planar_mapping::${ARG_NAME} ALIAS ${target})
  set_target_properties(${target} PROPERTIES
    EXPORT_NAME ${ARG_NAME}
    VERSION ${PROJECT_VERSION}
    SOVERSION ${PROJECT_VERSION_MAJOR}
    CXX_VISIBILITY_PRESET hidden
    VISIBILITY_INLINES_HIDDEN ON
    POSITION_INDEPENDENT_CODE ON
    DEFINE_SYMBOL ""
    CXX_EXTENSIONS OFF)
  planar_mapping_set_flags(${target})
  planar_mapping_set_rpath(${target} ${CMAKE_INSTALL_LIBDIR})
  # A product and a sum stay two operations: only some processors can fuse them, and maps are the same on all.
  # Libraries alone compute maps.
  target_compile_options(${target} PRIVATE -ffp-contract=off -fno-semantic-interposition)
  if(ARG_SOURCES)
    target_include_directories(${target} PUBLIC
      $<BUILD_INTERFACE:${CMAKE_CURRENT_SOURCE_DIR}/include>
      $<INSTALL_INTERFACE:${CMAKE_INSTALL_INCLUDEDIR}>)
    install(DIRECTORY include/ DESTINATION ${CMAKE_INSTALL_INCLUDEDIR} COMPONENT development)
  endif()
  target_link_libraries(${target} PUBLIC ${ARG_PUBLIC} PRIVATE ${ARG_PRIVATE})
  if(ARG_PRECOMPILE)
    target_precompile_headers(${target} PRIVATE ${ARG_PRECOMPILE})
  else()
    target_precompile_headers(${target} REUSE_FROM planar_mapping_core)
  endif()
  target_sources(${target} PUBLIC FILE_SET HEADERS BASE_DIRS ${PROJECT_SOURCE_DIR}/src)
  planar_mapping_install_module(${ARG_NAME} ${ARG_COMPONENT})
endfunction()

function(planar_mapping_install_module name component)
  install(TARGETS planar_mapping_${name} EXPORT planar_mapping_${name}_targets
    LIBRARY DESTINATION ${CMAKE_INSTALL_LIBDIR} COMPONENT ${component} NAMELINK_COMPONENT development
    ARCHIVE DESTINATION ${CMAKE_INSTALL_LIBDIR} COMPONENT development
    RUNTIME DESTINATION ${CMAKE_INSTALL_BINDIR} COMPONENT ${component}
    FILE_SET HEADERS DESTINATION ${CMAKE_INSTALL_INCLUDEDIR} COMPONENT development)
  install(EXPORT planar_mapping_${name}_targets NAMESPACE planar_mapping::
    DESTINATION ${CMAKE_INSTALL_LIBDIR}/cmake/planar_mapping COMPONENT development)
  set_property(GLOBAL APPEND PROPERTY PLANAR_MAPPING_MODULES ${name})
endfunction()

# What a room, which is the calling folder, adds to a module.
function(planar_mapping_room module)
  cmake_parse_arguments(ARG "" "" "SOURCES;HEADERS" ${ARGN})
  set(target planar_mapping_${module})
  list(TRANSFORM ARG_SOURCES PREPEND ${CMAKE_CURRENT_SOURCE_DIR}/)
  list(TRANSFORM ARG_HEADERS PREPEND ${CMAKE_CURRENT_SOURCE_DIR}/)
  if(ARG_SOURCES)
    target_sources(${target} PRIVATE ${ARG_SOURCES})
  endif()
  set(scope PUBLIC)
  get_target_property(type ${target} TYPE)
  if(type STREQUAL "INTERFACE_LIBRARY")
    set(scope INTERFACE)
  endif()
  target_sources(${target} ${scope} FILE_SET HEADERS BASE_DIRS ${PROJECT_SOURCE_DIR}/src FILES ${ARG_HEADERS})
endfunction()

# Libraries show what is public alone. Programs that use what is internal link static libraries of the same objects:
# these names in place of those in a list of libraries.
function(planar_mapping_internal_names list)
  if(BUILD_SHARED_LIBS)
    list(TRANSFORM ${list} REPLACE "^planar_mapping(::|_)([a-z_]+)$" "planar_mapping_\\2_internal")
  endif()
  set(${list} ${${list}} PARENT_SCOPE)
endfunction()

function(planar_mapping_internal_library target)
  if(NOT BUILD_SHARED_LIBS OR NOT TARGET ${target})
    return()
  endif()
  set(name ${target}_internal)
  get_target_property(type ${target} TYPE)
  if(type STREQUAL "INTERFACE_LIBRARY")
    set(scope INTERFACE)
    add_library(${name} INTERFACE)
    get_target_property(libraries ${target} INTERFACE_LINK_LIBRARIES)
  else()
    set(scope PUBLIC)
    add_library(${name} STATIC EXCLUDE_FROM_ALL $<TARGET_OBJECTS:${target}>)
    set_target_properties(${name} PROPERTIES LINKER_LANGUAGE CXX)
    get_target_property(libraries ${target} LINK_LIBRARIES)
  endif()
  list(FILTER libraries EXCLUDE REGEX "^::@")  # marks of the folders that added them
  planar_mapping_internal_names(libraries)
  target_link_libraries(${name} ${scope} ${libraries})
  target_include_directories(${name} ${scope} $<TARGET_PROPERTY:${target},INTERFACE_INCLUDE_DIRECTORIES>)
  target_compile_definitions(${name} ${scope} $<TARGET_PROPERTY:${target},INTERFACE_COMPILE_DEFINITIONS>)
  target_compile_features(${name} ${scope} cxx_std_17)
endfunction()

# An executable of ours: a tool, an example, a test or a benchmark.
function(planar_mapping_executable target)
  cmake_parse_arguments(ARG "" "" "SOURCES;LINK;PRECOMPILE" ${ARGN})
  add_executable(${target} ${ARG_SOURCES})
  set_target_properties(${target} PROPERTIES CXX_EXTENSIONS OFF)
  planar_mapping_set_flags(${target})
  target_link_libraries(${target} PRIVATE ${ARG_LINK})
  list(LENGTH ARG_SOURCES count)
  if(ARG_PRECOMPILE AND count GREATER 2)  # fewer sources than that compile sooner without
    target_precompile_headers(${target} PRIVATE ${ARG_PRECOMPILE})
  endif()
endfunction()

# A program that is installed.
function(planar_mapping_install_program target component)
  planar_mapping_set_rpath(${target} ${CMAKE_INSTALL_BINDIR})
  install(TARGETS ${target} RUNTIME DESTINATION ${CMAKE_INSTALL_BINDIR} COMPONENT ${component})
endfunction()

# For programs that draw: what sanitizers should know of the graphics driver.
function(planar_mapping_graphics_sanitizer_options target)
  if(PLANAR_MAPPING_SANITIZE)
    target_sources(${target} PRIVATE ${PROJECT_SOURCE_DIR}/cmake/graphics_sanitizer_options.cpp)
  endif()
endfunction()

# For programs that use the network: what sanitizers should know of libzmq.
function(planar_mapping_network_sanitizer_options target)
  if(PLANAR_MAPPING_SANITIZE)
    target_sources(${target} PRIVATE ${PROJECT_SOURCE_DIR}/cmake/network_sanitizer_options.cpp)
  endif()
endfunction()
