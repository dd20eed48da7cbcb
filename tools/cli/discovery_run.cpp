#include "tools/cli/discovery_run.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "daemon/estimate/beyond_catalogue.hpp"
#include "daemon/estimate/search_beyond.hpp"
#include "estimator/discovery/named_effects.hpp"
#include "protocol/recording/atomic_file.hpp"
#include "protocol/schedule_file/schedule_file.hpp"
#include "tools/cli/terminal.hpp"

namespace selfcal::cli {
namespace {

struct LawsToTry {
  std::vector<discovery::LawTerm> terms;
  std::vector<double> stated;
};

// A `?` begins at 1, in the unit that it stands for: Gauss-Newton finds the rest or says so by its sigma.
Expected<LawsToTry> read_terms(const std::string& file) {
  constexpr double first_guess = 1.0;
  const Expected<std::vector<LawText>> texts = read_laws(file);
  if (!texts) {
    return tl::unexpected(texts.error());
  }
  LawsToTry laws;
  for (std::size_t k = 0; k < texts->size(); ++k) {
    const LawText& text = (*texts)[k];
    if (!text.process.empty()) {
      return fail(ErrorKind::bad_input,
                  fmt::format("{}: law {}: process \"{}\": only expressions are tried; --discover looks for processes",
                              file, k + 1, text.process));
    }
    auto expression = laws::Expression::parse(text.expression);
    if (!expression) {
      return fail(ErrorKind::bad_input, fmt::format("{}: law {}: expression: column {}: {}", file, k + 1,
                                                    expression.error().column, expression.error().words));
    }
    std::vector<double> constants(expression->free_constants(), first_guess);
    laws.terms.push_back({text.axis, std::move(*expression), std::move(constants)});
    laws.stated.push_back(text.coefficient.value_or(NAN));
  }
  return laws;
}

// Beside what stands named, all of it fitted anew.
Expected<void> try_them(const std::string& file, const LawsToTry& laws, const discovery::UnexplainedRest& rest,
                        BeyondCatalogue& result) {
  auto tried = discovery::try_laws(rest.recordings(), laws.terms, laws.stated);
  if (!tried) {
    return fail(ErrorKind::bad_input,
                fmt::format("{}: law {}: expression: {}", file, tried.error().law + 1, tried.error().words));
  }
  if (rest.recordings().size() > 1 || !rest.taken_out().empty()) {
    std::vector<discovery::LawTerm> terms;
    Eigen::VectorXd coefficient(static_cast<Eigen::Index>(tried->size()));
    for (const discovery::TriedLaw& law : *tried) {
      coefficient(static_cast<Eigen::Index>(terms.size())) = law.coefficient;
      terms.push_back(law.term);
    }
    const auto joint = rest.beside(terms, coefficient);
    if (!joint) {
      return fail(ErrorKind::bad_input, fmt::format("{}: {}", file, joint.error()));
    }
    discovery::adopt(*joint, *tried);
  }
  result.tried = std::move(*tried);
  return {};
}

// `first`: of the recording that `data` is.
Expected<void> plan_and_write(const std::string& file, std::span<const discovery::UnitRecording> unit,
                              const ImuData& data, const diagnosis::Diagnosis& first, BeyondCatalogue& result) {
  result.next = first.instead && !file.empty() ? discovery::plan_against_names({data, first.calibration}, first, {})
                                               : plan_next(unit, *result.found, {});
  if (file.empty()) {
    return {};
  }
  if (!result.next) {
    fmt::print(
        stderr,
        "selfcal diagnose: {} is not written: no equations that another rotation would tell apart; for effects of the "
        "catalogue --split-schedule plans one\n",
        file);
    return {};
  }
  return write_file_atomically(
      file, fmt::format("# Tells the equation found from {}: {:.1f} sigma, {:.1f} now.\n{}", result.next->closest,
                        result.next->separation, result.next->separation_now, format_schedule(result.next->schedule)));
}

}  // namespace

void add_discovery_options(Options& options, DiscoveryArguments& arguments) {
  options.flag("--discover", arguments.discover,
               "look for equations beyond the catalogue also where the catalogue leaves nothing");
  options.texts("--with", arguments.with,
                "a further recording of the same unit, looked at together with the first; repeated");
  options.exclude("--with", "--against");
  options.text("--law", arguments.laws, "try the laws of this file beside the 24 and what was named");
  options.text("--next-experiment", arguments.next_experiment,
               "write the schedule that would tell the equations found from their rivals");
}

std::string BeyondCatalogue::text(Detail detail) const {
  return (together ? together_text(*together) : std::string()) + (joint ? effects_text(*joint) : std::string()) +
         (found ? discovery_text(*found, next, detail) : std::string()) +
         (tried.empty() ? std::string() : trial_text(tried));
}

void BeyondCatalogue::add_to(nlohmann::ordered_json& document) const {
  add_next_experiment(document, next);
  if (together) {
    document["together"] = together_json(*together);
  }
  if (joint) {
    document["fitted_effects"] = fitted_effects_json(*joint);
  }
  if (!tried.empty()) {
    document["laws"] = trial_json(tried);
  }
}

Expected<BeyondCatalogue> look_beyond(const DiscoveryArguments& arguments, std::span<const DiagnosedFile> recordings,
                                      const diagnosis::DiagnosisOptions& of_catalogue, diagnosis::Diagnosis& first) {
  BeyondCatalogue result;
  const bool unexplained =
      std::any_of(recordings.begin(), recordings.end(), [](const DiagnosedFile& r) { return r.diagnosis.unexplained; });
  const bool asked = arguments.discover || unexplained || recordings.size() > 1 || !arguments.next_experiment.empty();
  const std::vector<discovery::DiagnosedRecording> unit = recordings_of(recordings);
  LawsToTry laws;
  if (!arguments.laws.empty()) {
    Expected<LawsToTry> read = read_terms(arguments.laws);
    if (!read) {
      return tl::unexpected(read.error());
    }
    laws = std::move(*read);
  }
  const auto try_on = [&](const discovery::UnexplainedRest& rest) {
    return laws.terms.empty() ? Expected<void>() : try_them(arguments.laws, laws, rest, result);
  };
  ProgressLine line;
  const discovery::Progress progress = [&line](const std::string& words) { line.show(words); };
  discovery::DiscoveryOptions options;
  options.coloured = first.before.coloured;
  auto searched =
      search_beyond(unit, of_catalogue, options, first, asked ? Search::always : Search::where_due, progress);
  if (!searched) {
    return fail(ErrorKind::bad_input, searched.error());
  }
  auto& search = *searched;
  if (!search) {
    if (laws.terms.empty()) {
      return result;
    }
    const auto rest = discovery::UnexplainedRest::of(unit);
    if (!rest) {
      return fail(ErrorKind::bad_input, rest.error());
    }
    return try_on(*rest).map([&] { return std::move(result); });
  }
  // What the search withdrew is not taken out: a name that takes up a part of a law leaves another one.
  if (const auto tried = try_on(search->rest); !tried) {
    return tl::unexpected(tried.error());
  }
  if ((!asked && !first.unexplained) || (search->said_by_catalogue && arguments.next_experiment.empty())) {
    return result;
  }
  result.found = std::move(search->found);
  auto joint = fit_together(search->rest, *result.found, first);
  if (!joint) {
    return fail(ErrorKind::bad_input, joint.error());
  }
  result.joint = std::move(*joint);
  if (recordings.size() > 1) {
    result.together = put_together(recordings, search->rest, *result.joint);
  }
  if (const auto planned =
          plan_and_write(arguments.next_experiment, search->rest.recordings(), recordings.front().data, first, result);
      !planned) {
    return tl::unexpected(planned.error());
  }
  if (search->said_by_catalogue) {
    result.found.reset();
  }
  return result;
}

}  // namespace selfcal::cli
