# cmake -D PROGRAM=path -D SUITES=[*-filter] -D STUDY=filter -D LABEL=label -D PROPERTIES=list -D OUT=file -P add_suites.cmake
# Writes what ctest reads: one test for each suite of a gtest program, and each test of STUDY with that label too.
# Filters are gtest's, and may be empty: nothing. That of SUITES names what is not in them.
set(text "")
string(REPLACE ";" " " properties "${PROPERTIES}")

function(list_tests FILTER OUT_VARIABLE)
  set(listed "")
  if(FILTER)
    execute_process(COMMAND ${PROGRAM} --gtest_list_tests --gtest_filter=${FILTER} OUTPUT_VARIABLE listed RESULT_VARIABLE status TIMEOUT 60)
    if(NOT status EQUAL 0)
      message(FATAL_ERROR "${PROGRAM} --gtest_list_tests: ${status}")
    endif()
  endif()
  string(REPLACE "\n" ";" lines "${listed}")
  set(${OUT_VARIABLE} "${lines}" PARENT_SCOPE)
endfunction()

# A test that is skipped would pass unseen within its suite: it fails there, and belongs to what stands apart.
list_tests("${SUITES}" lines)
string(REPLACE "*-" "-" without "${SUITES}")
foreach(line IN LISTS lines)
  if(line MATCHES "^([^ ]+)\\.( +#.*)?$")
    set(suite ${CMAKE_MATCH_1})
    string(APPEND text "add_test([=[${suite}]=] [=[${PROGRAM}]=] [=[--gtest_filter=${suite}.*${without}]=])\n"
                       "set_tests_properties([=[${suite}]=] PROPERTIES LABELS ${LABEL} ${properties} FAIL_REGULAR_EXPRESSION [=[\\[  SKIPPED \\]]=])\n")
  endif()
endforeach()

list_tests("${STUDY}" lines)
foreach(line IN LISTS lines)
  if(line MATCHES "^([^ ]+\\.)( +#.*)?$")
    set(suite ${CMAKE_MATCH_1})
  elseif(line MATCHES "^  ([^ ]+)")
    set(test ${suite}${CMAKE_MATCH_1})
    string(APPEND text "add_test([=[${test}]=] [=[${PROGRAM}]=] [=[--gtest_filter=${test}]=])\n"
                       "set_tests_properties([=[${test}]=] PROPERTIES LABELS [=[${LABEL};study]=] ${properties} SKIP_REGULAR_EXPRESSION [=[\\[  SKIPPED \\]]=])\n")
  endif()
endforeach()
file(WRITE ${OUT} "${text}")
