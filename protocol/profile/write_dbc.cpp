// config/selfcal.dbc, from our own INS's profile.
#include <cstdio>

#include "protocol/profile/dbc_file.hpp"

int main() {
  const auto& own = *selfcal::profile::built_in();
  return std::fputs(selfcal::profile::dbc_text(own).c_str(), stdout) < 0 ? 1 : 0;
}
