# Run by ctest: adds each GoogleTest suite of `program` as one test with `labels` and `environment`. A process for each
# suite starts the device once, where a process for each test would take twice the time. Tests whose names match
# `except` or the environment variable LEAVE_OUT_TESTS (patterns with wildcards, separated by colons) are not run.
if(NOT EXISTS ${program})
  add_test(${name}_is_not_built ${program})
  set_tests_properties(${name}_is_not_built PROPERTIES LABELS "${labels}")
  return()
endif()
execute_process(COMMAND ${program} --gtest_list_tests WORKING_DIRECTORY ${directory} OUTPUT_VARIABLE listing
  RESULT_VARIABLE result TIMEOUT 60)
if(NOT result EQUAL 0)
  message(FATAL_ERROR "${program} --gtest_list_tests failed: ${result}\n${listing}")
endif()
foreach(suite IN LISTS thorough)
  if(NOT listing MATCHES "(^|\n)${suite}\\.")
    message(FATAL_ERROR "${program} has no suite ${suite}, which is listed as thorough")
  endif()
endforeach()
set(leftOut ${except} $ENV{LEAVE_OUT_TESTS})
if(leftOut)
  string(REPLACE ";" ":" leftOut "-${leftOut}")
endif()
# A suite's line is its name and a dot; a comment follows for parametrised and typed suites.
string(REGEX MATCHALL "(^|\n)[A-Za-z0-9_/]+\\." suites "${listing}")
foreach(suite IN LISTS suites)
  string(STRIP "${suite}" suite)
  string(REGEX REPLACE "\\.$" "" suite "${suite}")
  set(suiteLabels ${labels})
  list(FIND thorough "${suite}" place) # ctest sets no policies, so if(IN_LIST) is not known
  if(NOT place EQUAL -1)
    list(APPEND suiteLabels thorough)
  endif()
  add_test(${suite} ${program} --gtest_filter=${suite}.*${leftOut} --gtest_brief=1)
  set_tests_properties(${suite} PROPERTIES LABELS "${suiteLabels}" ENVIRONMENT "${environment}" TIMEOUT 900
    WORKING_DIRECTORY ${directory})
endforeach()
