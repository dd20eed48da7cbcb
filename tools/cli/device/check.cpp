// selfcal device check: conformance of an INS with its profile and with the standards.
#include <fmt/format.h>

#include <algorithm>
#include <nlohmann/json.hpp>

#include "daemon/ins/unlock_key.hpp"
#include "protocol/document/document_head.hpp"
#include "protocol/profile/read_profile.hpp"
#include "tools/cli/device/bus_commands.hpp"
#include "tools/cli/device/conformance.hpp"

namespace selfcal::cli::device {
namespace {

std::size_t count(const std::vector<Result>& results, Verdict verdict) {
  return static_cast<std::size_t>(std::ranges::count(results, verdict, &Result::verdict));
}

std::string document_of(const CheckArguments& arguments, const profile::Profile& profile,
                        const std::vector<Result>& results) {
  using Json = nlohmann::ordered_json;
  Json list = Json::array();
  for (const Result& r : results) {
    Json item{{"id", r.id}, {"clause", r.clause}, {"requirement", r.requirement}, {"verdict", name(r.verdict)}};
    if (r.verdict == Verdict::not_tried) {
      item["why"] = r.came;
    } else {
      item.update({{"sent", r.sent}, {"expected", r.expected}, {"came", r.came}});
    }
    list.push_back(std::move(item));
  }
  const Json body{{"interface", arguments.interface},
                  {"profile", profile.name},
                  {"wrote", arguments.write},
                  {"holds", count(results, Verdict::holds)},
                  {"fails", count(results, Verdict::fails)},
                  {"not_tried", count(results, Verdict::not_tried)},
                  {"requirements", std::move(list)}};
  return document::with_head(document::conformance, body).dump();
}

void print(const CheckArguments& arguments, const std::vector<Result>& results) {
  for (const Result& r : results) {
    if (r.verdict == Verdict::not_tried) {
      fmt::print("not tried  {}: {} ({}): {}\n", r.id, r.requirement, r.clause, r.came);
    } else if (r.verdict == Verdict::holds) {
      fmt::print("holds      {}: {} ({})\n", r.id, r.requirement, r.clause);
      if (arguments.all) {
        fmt::print("             sent      {}\n             expected  {}\n             came      {}\n", r.sent,
                   r.expected, r.came);
      }
    } else {
      fmt::print(
          "FAILS      {}: {} ({})\n             sent      {}\n             expected  {}\n             came      {}\n",
          r.id, r.requirement, r.clause, r.sent, r.expected, r.came);
    }
  }
  fmt::print("{} hold, {} fail, {} not tried\n", count(results, Verdict::holds), count(results, Verdict::fails),
             count(results, Verdict::not_tried));
}

}  // namespace

Expected<int> check(const CheckArguments& arguments) {
  const auto profile = chosen_profile(arguments.profile);
  if (!profile) {
    return tl::unexpected(profile.error());
  }
  if (const std::string why = cannot_try(**profile); !why.empty()) {
    return fail(ErrorKind::bad_input, why);
  }
  Permission permission;
  permission.write = arguments.write;
  if ((*profile)->security.program) {
    permission.key = UnlockKey{};  // the program says it
  } else if (!arguments.key_file.empty()) {
    InsConfig config;
    config.key_file = arguments.key_file;
    const auto key = load_unlock_key(config);
    if (!key) {
      return tl::unexpected(key.error());
    }
    permission.key = *key;
  }
  auto tester = Tester::open(arguments.interface, **profile);
  if (!tester) {
    return tl::unexpected(tester.error());
  }
  const auto results = Conformance(*tester, **profile, permission).run();
  if (!results) {
    return tl::unexpected(results.error());
  }
  if (arguments.json) {
    fmt::print("{}\n", document_of(arguments, **profile, *results));
  } else {
    print(arguments, *results);
  }
  return count(*results, Verdict::fails) > 0 ? 1 : 0;
}

}  // namespace selfcal::cli::device
