# Writes OUTPUT with the commit of SOURCE, whether it has uncommitted changes, and the compiler FLAGS; touches it only on change.
execute_process(COMMAND git -C ${SOURCE} rev-parse HEAD OUTPUT_VARIABLE commit OUTPUT_STRIP_TRAILING_WHITESPACE
                ERROR_QUIET RESULT_VARIABLE failed)
if(failed)
  set(commit "unknown")
endif()
execute_process(COMMAND git -C ${SOURCE} status --porcelain --untracked-files=no OUTPUT_VARIABLE changes ERROR_QUIET)
set(dirty 0)
if(changes)
  set(dirty 1)
endif()
string(STRIP "${FLAGS}" FLAGS)
file(CONFIGURE OUTPUT ${OUTPUT} CONTENT
     "#pragma once\n#define NULLMARK_GIT_COMMIT \"${commit}\"\n#define NULLMARK_GIT_DIRTY ${dirty}\n#define NULLMARK_COMPILER_FLAGS \"${FLAGS}\"\n")
