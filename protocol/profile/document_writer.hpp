// An interface document in one of its two forms, piece by piece.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "protocol/profile/describe.hpp"

namespace selfcal::profile {

using Row = std::vector<std::string>;

class Writer {
 public:
  Writer(Markup markup, std::string_view title);
  void heading(std::string_view words);
  void say(std::string_view words);
  void table(const Row& head, const std::vector<Row>& rows);
  void picture(std::string_view drawing);
  std::string end() const;

 private:
  bool html_;
  std::string text_;
};

}  // namespace selfcal::profile
