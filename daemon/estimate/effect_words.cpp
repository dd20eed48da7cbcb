#include "daemon/estimate/effect_words.hpp"

#include <array>
#include <cctype>
#include <utility>

#include "daemon/estimate/analysis.hpp"

namespace selfcal {
namespace {

using Words = std::pair<std::string_view, std::string_view>;

// Of what is no equation of the catalogue, whose effects have their own words.
constexpr std::array noise = {
    Words{"gyro_noise_level", "gyro noise (ARW) of another size than assumed"},
    Words{"accel_noise_level", "accelerometer noise (VRW) of another size than assumed"},
    Words{"gyro_random_walk", "random walk of the gyro drift (rate random walk)"},
    Words{"accel_random_walk", "random walk of the accelerometer bias"},
    Words{"gyro_bias_instability", "gyro drift that wanders and comes back (bias instability)"},
    Words{"accel_bias_instability", "accelerometer bias that wanders and comes back (bias instability)"},
    Words{"quantisation", "coarser quantisation than assumed"},
    Words{"vibration_line", "vibration at a single frequency"},
};

constexpr std::array symbols = {
    Words{"df", "what the accelerometers put out too much"},
    Words{"df_i", "what accelerometer i puts out too much"},
    Words{"dw", "what the gyros put out too much"},
    Words{"dw_i", "what gyro i puts out too much"},
    Words{"d", "displacement of the base"},
    Words{"f", "specific force"},
    Words{"f_i", "specific force along axis i"},
    Words{"u", "specific force over g"},
    Words{"u_i", "specific force along axis i, over g"},
    Words{"u_j", "specific force along axis j, over g"},
    Words{"u_k", "specific force along axis k, over g"},
    Words{"w", "angular rate"},
    Words{"w_i", "angular rate about axis i"},
    Words{"B_j", "magnetic field along axis j"},
    Words{"T", "temperature"},
    Words{"t", "time since the start of the recording"},
    Words{"s", "time since the end of the last turn"},
    Words{"tau", "time constant, fitted"},
    Words{"lag", "what a first-order lag makes of it"},
    Words{"A", "angle that the gimbal turned lately; it fades with tau"},
    Words{"h_i", "coefficient of axis i, fitted"},
    Words{"w0", "width of the zone, fitted"},
    Words{"r", "offset from the gimbal's centre, fitted"},
    Words{"a_i", "coefficient of axis i, fitted"},
    Words{"b_i", "coefficient of axis i, fitted"},
    Words{"c_i", "coefficient of axis i, fitted"},
    Words{"k_i", "coefficient of axis i, fitted"},
    Words{"r_i", "fitted for axis i"},
    Words{"a", "amplitudes, fitted"},
    Words{"b", "amplitudes, fitted"},
    Words{"k", "coefficient, fitted"},
    Words{"G_ij", "coefficient of axis i for axis j, fitted"},
    Words{"M_ij", "coefficient of axis i for axis j, fitted"},
    Words{"K", "matrix of coefficients, fitted"},
};

template <std::size_t N>
std::string_view look_up(const std::array<Words, N>& table, std::string_view key) {
  for (const auto& [name, words] : table) {
    if (name == key) {
      return words;
    }
  }
  return {};
}

bool in_name(char c) { return std::isalnum(static_cast<unsigned char>(c)) != 0 || c == '_'; }

}  // namespace

std::string effect_words(std::string_view id) {
  std::string words = words_in_catalogue(id);
  if (words.empty()) {
    words = look_up(noise, id);
  }
  return words.empty() ? std::string(id) : words;
}

std::vector<Symbol> symbols_of(std::string_view equation) {
  std::vector<Symbol> found;
  for (std::size_t at = 0; at < equation.size();) {
    std::size_t end = at;
    while (end < equation.size() && in_name(equation[end])) {
      ++end;
    }
    const std::string_view name = equation.substr(at, end - at);
    // The one letter with two meanings: base_sway's frequency.
    const bool frequency = name == "f" && equation.starts_with("d = ");
    const std::string_view meaning = name.empty() ? std::string_view()
                                     : frequency  ? std::string_view("frequency, fitted")
                                                  : look_up(symbols, name);
    bool known = false;
    for (const Symbol& symbol : found) {
      known = known || symbol.name == name;
    }
    if (!meaning.empty() && !known) {
      found.push_back({std::string(name), std::string(meaning)});
    }
    at = end == at ? at + 1 : end;
  }
  return found;
}

}  // namespace selfcal
