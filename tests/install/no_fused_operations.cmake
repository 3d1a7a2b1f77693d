# Disassembles LIBRARIES with OBJDUMP and fails if one holds an instruction that multiplies and adds in
# one step (x86-64, AArch64): its last bit differs from that of two steps, and not all processors have it.
set(found "")
foreach(library IN LISTS LIBRARIES)
  execute_process(COMMAND ${OBJDUMP} -d --no-show-raw-insn ${library}
    COMMAND awk "/^[0-9a-f]+ </ { name = $2 } /\t(vfn?m(add|sub)|fn?m(add|sub)|fml[as])/ { print name }"
    COMMAND sort -u
    OUTPUT_VARIABLE functions RESULTS_VARIABLE results)
  if(NOT results STREQUAL "0;0;0")
    message(FATAL_ERROR "cannot disassemble ${library}: ${results}")
  endif()
  string(APPEND found "${functions}")
endforeach()
if(found)
  message(NOTICE "${found}")
  message(FATAL_ERROR "fused operations in the functions above")
endif()
