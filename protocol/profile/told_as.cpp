#include "protocol/profile/told_as.hpp"

namespace selfcal::profile {

ProfilePtr told_as(const ProfilePtr& profile) {
  if (!profile->move) {
    return profile;
  }
  const Profile& own = *built_in();
  auto told = std::make_shared<Profile>(*profile);
  told->schedule = own.schedule;
  told->schedule.did = kept_schedule_did;
  for (const auto member : {&Profile::state, &Profile::directory}) {
    ((*told).*member).layout = (own.*member).layout;
    ((*told).*member).given.clear();
  }
  told->rotate.result = own.rotate.result;
  return told;
}

}  // namespace selfcal::profile
