# What the program makes of pictures and sensor files: tests and benchmarks of the core for web pages find it beside that.
add_executable(tagwrench_core_vectors core_vectors.cpp)
target_link_libraries(tagwrench_core_vectors PRIVATE tagwrench_config tagwrench_scenario tagwrench_simulator tagwrench_renderers
                                                     fmt::fmt nlohmann_json::nlohmann_json opencv_core)
set_target_properties(tagwrench_core_vectors PROPERTIES OUTPUT_NAME core_vectors RUNTIME_OUTPUT_DIRECTORY ${TAGWRENCH_WEB_DIR}/core)
