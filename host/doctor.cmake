# The doctor looks at every room's needs; it is linked by main alone.
add_library(tagwrench_doctor STATIC ${CMAKE_CURRENT_LIST_DIR}/doctor.cpp)
target_compile_definitions(tagwrench_doctor PRIVATE TAGWRENCH_VERSION="${PROJECT_VERSION}")
target_link_libraries(tagwrench_doctor PUBLIC tagwrench_flags PRIVATE tagwrench_source fmt::fmt)
