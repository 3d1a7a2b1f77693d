# Installs the build tree into a prefix of its own, builds a small project against it, runs that.
function(run)
  execute_process(COMMAND ${ARGN} RESULT_VARIABLE result OUTPUT_VARIABLE output ERROR_VARIABLE output)
  if(NOT result EQUAL 0)
    string(JOIN " " command ${ARGN})
    message(FATAL_ERROR "${command}\n${output}")
  endif()
  set(output "${output}" PARENT_SCOPE)
endfunction()

file(REMOVE_RECURSE ${WORK_DIR})
set(prefix ${WORK_DIR}/prefix)
run(${CMAKE_COMMAND} --install ${BUILD_DIR} --prefix ${prefix})
set(consumers "core")
if(WITH_PCL)
  list(APPEND consumers "core:filters:segmentation:surface")
endif()
foreach(consumer IN LISTS consumers)
  string(REPLACE ":" ";" components ${consumer})
  string(MAKE_C_IDENTIFIER "${components}" name)
  run(${CMAKE_COMMAND} -S ${CONSUMER_DIR} -B ${WORK_DIR}/${name} -G ${GENERATOR}
    -DCMAKE_CXX_COMPILER=${COMPILER} -DCMAKE_BUILD_TYPE=${BUILD_TYPE} -DCMAKE_PREFIX_PATH=${prefix}
    "-DCOMPONENTS=${components}" -DSANITIZE=${SANITIZE})
  if(components STREQUAL "core" AND EXISTS ${WORK_DIR}/${name}/CMakeCache.txt)
    file(STRINGS ${WORK_DIR}/${name}/CMakeCache.txt pcl REGEX "^PCL_DIR:")
    if(pcl)
      message(FATAL_ERROR "COMPONENTS core looked for PCL: ${pcl}")
    endif()
  endif()
  run(${CMAKE_COMMAND} --build ${WORK_DIR}/${name})
  run(${WORK_DIR}/${name}/consumer)
  if(NOT output MATCHES "consumer works")
    message(FATAL_ERROR "the consumer said: ${output}")
  endif()
endforeach()

# An unknown component has to be refused.
execute_process(COMMAND ${CMAKE_COMMAND} -S ${CONSUMER_DIR} -B ${WORK_DIR}/unknown -G ${GENERATOR}
  -DCMAKE_CXX_COMPILER=${COMPILER} -DCMAKE_PREFIX_PATH=${prefix} "-DCOMPONENTS=core;no_such_part"
  RESULT_VARIABLE result OUTPUT_QUIET ERROR_QUIET)
if(result EQUAL 0)
  message(FATAL_ERROR "find_package accepted the component no_such_part")
endif()
file(REMOVE_RECURSE ${WORK_DIR})
