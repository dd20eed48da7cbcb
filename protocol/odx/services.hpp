// The services of an INS as an ODX layer has them: each a request, its positive response, and the one negative response of all.
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "protocol/odx/dictionary.hpp"
#include "protocol/profile/profile.hpp"

namespace selfcal::odx {

// Where the parts of a layer go, in the order of the standard.
struct Layer {
  Node services, requests, responses, refusals;
};

// How many services were written.
std::size_t write_services(const profile::Profile& profile, const Layer& layer, Dictionary& dictionary);

}  // namespace selfcal::odx
