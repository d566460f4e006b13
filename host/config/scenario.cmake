# A scenario file -> the simulator's plain struct.
add_library(tagwrench_scenario STATIC ${CMAKE_CURRENT_LIST_DIR}/scenario_config.cpp)
target_link_libraries(tagwrench_scenario PUBLIC tagwrench_flags tagwrench_simulator PRIVATE tagwrench_yaml)
