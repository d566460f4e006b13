# cmake -D PROGRAM=path -D APART=filter -D PROPERTIES=list -D OUT=file -P add_suites.cmake
# Writes what ctest reads: one test for each suite of a gtest program, without the tests that APART matches.
# A test that is skipped would pass unseen within its suite: it fails there, and belongs to APART.
execute_process(COMMAND ${PROGRAM} --gtest_list_tests --gtest_filter=-${APART} OUTPUT_VARIABLE listed RESULT_VARIABLE status TIMEOUT 60)
if(NOT status EQUAL 0)
  message(FATAL_ERROR "${PROGRAM} --gtest_list_tests: ${status}")
endif()
string(REPLACE "\n" ";" lines "${listed}")
set(text "")
string(REPLACE ";" " " properties "${PROPERTIES}")
foreach(line IN LISTS lines)
  if(line MATCHES "^([^ ]+)\\.( +#.*)?$")
    set(suite ${CMAKE_MATCH_1})
    string(APPEND text "add_test([=[${suite}]=] [=[${PROGRAM}]=] [=[--gtest_filter=${suite}.*-${APART}]=])\n"
                       "set_tests_properties([=[${suite}]=] PROPERTIES ${properties} FAIL_REGULAR_EXPRESSION [=[\\[  SKIPPED \\]]=])\n")
  endif()
endforeach()
file(WRITE ${OUT} "${text}")
