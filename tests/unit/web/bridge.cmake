tagwrench_test(NAME web_bridge_test LABEL unit
  SOURCES bridge_desk_test.cpp bridge_job_command_test.cpp bridge_job_process_test.cpp bridge_job_report_test.cpp
          bridge_names_test.cpp bridge_run_test.cpp
  LIBS tagwrench_web_bridge)
