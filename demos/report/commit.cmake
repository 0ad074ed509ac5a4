# Writes the commit of SOURCE into the header OUT, where it changed. Without git it is unknown.
set(commit "unknown")
find_program(git git)
if(git)
  execute_process(
    COMMAND ${git} describe --always --dirty=+changes --exclude=* --abbrev=12
    WORKING_DIRECTORY ${SOURCE}
    OUTPUT_VARIABLE found
    RESULT_VARIABLE failed
    ERROR_QUIET OUTPUT_STRIP_TRAILING_WHITESPACE)
  if(NOT failed)
    set(commit ${found})
  endif()
endif()
set(text "#define HOOKE_COMMIT \"${commit}\"\n")
set(before "")
if(EXISTS ${OUT})
  file(READ ${OUT} before)
endif()
if(NOT text STREQUAL before)
  file(WRITE ${OUT} "${text}")
endif()
