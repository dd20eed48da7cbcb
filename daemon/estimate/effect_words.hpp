// The physics that a diagnosis names, in words.
#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace selfcal {

// "creep of the accelerometers after each turn" for accel_relaxation; the identifier itself where it is not known.
std::string effect_words(std::string_view id);

// The symbols that an equation of the catalogue uses, each with its meaning: {"u", "specific force over g, b axes"}.
struct Symbol {
  std::string name, meaning;
};
std::vector<Symbol> symbols_of(std::string_view equation);

}  // namespace selfcal
