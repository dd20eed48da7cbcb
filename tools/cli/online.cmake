# Commands that talk to the daemon: over D-Bus, and monitor over LCM.
find_package(Curses REQUIRED)
target_sources(selfcal PRIVATE
  monitor_terminal.cpp
  monitor_view.cpp
  online_client.cpp
  online_monitor.cpp
  online_query.cpp
  online_run.cpp
  online_text.cpp)
# The database can be restored without the daemon, which may refuse to start because of it.
target_include_directories(selfcal SYSTEM PRIVATE ${CURSES_INCLUDE_DIRS})
target_link_libraries(selfcal PRIVATE selfcal_operator_api selfcal_lcm ${CURSES_LIBRARIES} selfcal_daemon_core)
