// The hub's schema in versions: what a database has, what this program knows, and the way from one to the other.
#pragma once

#include <string>
#include <vector>

#include "daemon/hub/hub_connection.hpp"

namespace selfcal::hub {

int known_version();  // the newest that this program knows

// 0: the database holds no hub. An error where the server does not answer.
Expected<int> version_of(Connection& connection);

// Takes the database to known_version, all steps in one transaction: a step that fails leaves it as it was. Who reads or
// writes meanwhile waits; where others hold a table for longer than 10 s the step is given up with an error. Two at once wait
// for each other. Needs the right to create roles and, the first time, a schema. Returns the version before.
Expected<int> migrate(Connection& connection);

// What is wrong in it, a line each; empty: nothing. `recordings`: the shared folder, whose files are hashed; empty: not
// looked at.
Expected<std::vector<std::string>> check(Connection& connection, const std::string& recordings);

// A role that logs in with this password and does what `kind` (set, reader, analyst) may; a set's has the set's name. An
// existing role gets the new password.
Expected<void> admit(Connection& connection, const std::string& kind, const std::string& name,
                     const std::string& password);

}  // namespace selfcal::hub
