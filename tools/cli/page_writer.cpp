#include "tools/cli/page_writer.hpp"

namespace selfcal::cli {

PlanPageWriter& plan_page_writer() {
  static PlanPageWriter writer = nullptr;
  return writer;
}

bool is_page(const std::filesystem::path& file) { return file.extension() == ".html" || file.extension() == ".pdf"; }

}  // namespace selfcal::cli
