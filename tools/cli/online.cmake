# Commands that talk to the daemon: over D-Bus, and monitor over LCM.
target_sources(selfcal PRIVATE
  online_client.cpp
  online_monitor.cpp
  online_query.cpp
  online_run.cpp
  online_text.cpp)
target_link_libraries(selfcal PRIVATE selfcal_operator_api selfcal_lcm)
