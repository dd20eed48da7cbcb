#include "tools/cli/column_list.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <string_view>

#include "protocol/import/text_dialect.hpp"

namespace selfcal::cli {

Expected<std::vector<std::size_t>> listed_columns(const std::string& path, const import::ColumnSource& source,
                                                  const std::string& option, const std::string& list) {
  std::vector<std::size_t> columns;
  const auto& names = source.names();
  for (std::size_t begin = 0; begin <= list.size();) {
    const std::size_t end = std::min(list.find(',', begin), list.size());
    const std::string word(import::trimmed(std::string_view(list).substr(begin, end - begin)));
    begin = end + 1;
    const bool number = !word.empty() && word.size() < 5 && word.find_first_not_of("0123456789") == std::string::npos;
    const auto found =
        std::find_if(names.begin(), names.end(), [&](const auto& name) { return import::trimmed(name) == word; });
    const std::size_t column = number ? std::stoul(word) - 1 : static_cast<std::size_t>(found - names.begin());
    if (column >= names.size()) {
      return fail(ErrorKind::bad_input,
                  fmt::format("{}: {}: '{}' is none of its {} columns", path, option, word, names.size()));
    }
    columns.push_back(column);
  }
  return columns;
}

}  // namespace selfcal::cli
