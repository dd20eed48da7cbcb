# Commands that talk to the daemon: over D-Bus, and monitor over LCM.
find_package(Curses REQUIRED)
target_sources(selfcal PRIVATE
  monitor_terminal.cpp
  monitor_view.cpp
  online_client.cpp
  online_follow.cpp
  online_investigate.cpp
  online_monitor.cpp
  online_query.cpp
  online_run.cpp
  online_text.cpp
  run_progress.cpp)
# GCC 12 takes a std::string that is moved here for an overrun (false -Warray-bounds) if the headers are precompiled.
set_source_files_properties(monitor_view.cpp PROPERTIES SKIP_PRECOMPILE_HEADERS ON)
# The database can be restored without the daemon, which may refuse to start because of it.
target_include_directories(selfcal SYSTEM PRIVATE ${CURSES_INCLUDE_DIRS})
target_link_libraries(selfcal PRIVATE selfcal_operator_api selfcal_lcm ${CURSES_LIBRARIES} selfcal_daemon_core)
# GCC 12 takes a std::string that is moved for an overrun (false warnings) if the headers are precompiled.
set_source_files_properties(online_follow.cpp online_investigate.cpp online_query.cpp online_run.cpp online_text.cpp run_progress.cpp diagnosis_text.cpp dwell_table.cpp finding_text.cpp
  PROPERTIES SKIP_PRECOMPILE_HEADERS ON)
