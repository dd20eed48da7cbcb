// What the search for laws (estimator/discovery) found where nothing in the catalogue explains a recording: for the summary, for
// people and as JSON.
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>

#include "estimator/diagnosis/diagnosis.hpp"
#include "estimator/discovery/discovery.hpp"

namespace selfcal {

// Of the misfit that the catalogue leaves, the share that laws and processes take away; 0 where none was found. What is only described
// takes nothing away.
double explained_share(const discovery::Discovery& found);
// Laws or processes were found that take away all but a tenth of the misfit, or leave noise. Beside a process no axis is only described.
bool explains(const discovery::Discovery* found);
// "; 7 % of the misfit is left" where what explains leaves more than noise, else empty.
std::string left_words(const discovery::Discovery& found);

// Laws that hold in two recordings and more of a unit, with one coefficient and one set of constants, and leave noise: what may
// stand behind a set that is written.
bool confirmed(const discovery::Discovery* found);

// Whether equations alone were found that explain what such a walk or instability had been named for, or jumps at the turns that are ten times
// as likely as the walk of the same sensors.
bool replaces_process(const discovery::Discovery& found, const diagnosis::Diagnosis& diagnosis);
// Then it is a rejected name, and the recording is unexplained by the catalogue; else nothing is changed.
void replace_process(diagnosis::Diagnosis& diagnosis, const discovery::Discovery& found);

// The diagnosis with the 24 as fitted with the laws, and with what these leave (`after`, `remaining`), where laws explain what the
// catalogue leaves: the catalogue's rejected names correct nothing, and sigma holds what stands as well in the place of names beside the laws. Where what is found explains too little the 24 stay, and their sigma
// holds how far equations that are only described move them.
diagnosis::Diagnosis with_laws(diagnosis::Diagnosis diagnosis, const discovery::Discovery* found);

// "accel_y and accel_z take a new offset at each turn"; "gyro_x follows abs(wz) or one of 22 others" where it matters which, for
// they differ on another plan; empty where nothing was found. "(accel_relaxation)" behind an equation that this effect of the catalogue
// makes too.
std::string discovered_words(const discovery::Discovery& found);
// "in place of all that gyro_z has a bias that walks at random (odds 0.05)"
std::string instead_words(const discovery::OtherExplanation& instead);
// "gyro_x follows sin(outer)*fx**2 and gyro_y follows t"
std::string laws_words(const diagnosis::LawsInstead& instead);
// "in its place gyro_x follows wz (odds 0.2)"; "in the place of gyro_g_sensitivity gyro_x ..." where other names stay. Only where there are any.
std::string in_place_words(const diagnosis::Diagnosis& diagnosis);
// Names of sensors stand beside the laws too.
bool in_place_of_some(const diagnosis::Diagnosis& diagnosis);
// Whether laws in the place of what is named have odds that are worth a word in the verdict, and an experiment.
bool doubtful(const diagnosis::Diagnosis& diagnosis);
// "accel_y: jump per turn, 24.5 +- 4.2 ug; ...; NIS 5.81 becomes 0.99"
std::string discovered_figures(const discovery::Discovery& found);
// The same without what they make of NIS.
std::string law_figures(const discovery::Discovery& found);

// "what no catalogue holds"; "what the catalogue alone does not explain" where an effect of it makes some of the laws.
const char* beyond_what(const discovery::Discovery& found);

// "discovered", "described", "processes" and "discovery" of the document.
void add_discovery(nlohmann::ordered_json& document, const discovery::Discovery& found);

}  // namespace selfcal
