# cmake -DSOURCE=... -DBUILD=... -DWORK=... -DCONFIG=... -DGENERATOR=... -DCOMPILER=... -DFLAGS=... -DPREFIX_PATH=... -P build.cmake
#
# Installs BUILD, the build tree of SOURCE, into WORK/prefix and builds the plug-ins against it in WORK/build.

# What is no longer there must not be found; objects are kept, for copies preserve the times of files.
file(REMOVE_RECURSE ${WORK}/prefix ${WORK}/plugin_example)
execute_process(COMMAND ${CMAKE_COMMAND} --install ${BUILD} --config ${CONFIG} --prefix ${WORK}/prefix
                OUTPUT_QUIET COMMAND_ERROR_IS_FATAL ANY)

# A copy, as a newcomer has it: what lies around the folder in the tree is out of reach.
file(COPY ${SOURCE}/estimators/plugin_example DESTINATION ${WORK})
execute_process(COMMAND ${CMAKE_COMMAND} --fresh -S ${SOURCE}/harness/testing/plugin_test -B ${WORK}/build -G ${GENERATOR}
                        -DEXAMPLE=${WORK}/plugin_example -DCMAKE_BUILD_TYPE=${CONFIG} -DCMAKE_CXX_COMPILER=${COMPILER}
                        "-DCMAKE_CXX_FLAGS=${FLAGS}" "-DCMAKE_PREFIX_PATH=${WORK}/prefix;${PREFIX_PATH}"
                COMMAND_ERROR_IS_FATAL ANY)
execute_process(COMMAND ${CMAKE_COMMAND} --build ${WORK}/build --config ${CONFIG} --parallel 2 COMMAND_ERROR_IS_FATAL ANY)
