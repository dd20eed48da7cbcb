#include "daemon/estimate/summary.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <span>

#include "daemon/estimate/beyond_catalogue.hpp"
#include "daemon/estimate/effect_words.hpp"
#include "daemon/estimate/quantity_text.hpp"
#include "daemon/estimate/showing_schedule.hpp"
#include "estimator/geometry/units.hpp"
#include "protocol/law_file/law_file.hpp"

namespace selfcal {
namespace {

using diagnosis::Diagnosis;
using diagnosis::DiagnosisVerdict;
using diagnosis::Finding;

constexpr double significant = 3.0;  // sigma, of a coefficient that is worth a sentence

std::string nis_text(const Consistency& c) {
  return fmt::format("NIS {:.3g} where {:.3g} to {:.3g} is expected, innovations {}", c.nis_mean, c.nis_low, c.nis_high,
                     whiteness_text(std::log(c.whiteness_p_value)));
}

// A file name as a shell takes it.
std::string quoted(const std::string& file) {
  const bool plain = file.find_first_not_of(
                         "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789"
                         "_-./+=:,@%") == std::string::npos;
  if (plain && !file.empty()) {
    return file;
  }
  std::string text = "'";
  for (const char c : file) {
    text += c == '\'' ? std::string("'\\''") : std::string(1, c);
  }
  return text + "'";
}

std::string command(const char* verb, const Subject& subject, const std::string& more = {}) {
  const std::string about = subject.recording.empty() ? fmt::format("{}", subject.run) : quoted(subject.recording);
  return fmt::format("selfcal {} {}{}{}", verb, about, more.empty() ? "" : " ", more);
}

// The coefficient that shows the effect best, with its constant where there is one.
std::string figures_of(const Finding& finding) {
  const auto strength = [](const diagnosis::FindingParameter& p) {
    return p.sigma > 0.0 && std::isfinite(p.sigma) ? std::abs(p.value) / p.sigma : 0.0;
  };
  std::string text;
  const diagnosis::FindingParameter* strongest = nullptr;
  for (const diagnosis::FindingParameter& p : finding.parameters) {
    const bool constant = p.name == "tau" || p.name == "frequency" || p.name == "w0";
    if (constant && finding.parameters.size() > 1) {
      continue;
    }
    if (strongest == nullptr || strength(p) > strength(*strongest)) {
      strongest = &p;
    }
  }
  if (strongest != nullptr) {
    text = fmt::format("{} {}", strongest->name, with_sigma(strongest->value, strongest->sigma, strongest->unit));
  }
  return text;
}

std::string figures_with_significance(const Finding& finding) {
  const std::string figures = figures_of(finding);
  return fmt::format("{}{}{:.0f} sigma", figures, figures.empty() ? "" : ", ", finding.significance);
}

// The parameter that the omission moves most, in its sigma; empty where none moves by three.
std::string largest_correction(const Diagnosis& d) {
  int at = -1;
  double largest = significant;
  for (int k = 0; k < sensor_parameter_count; ++k) {
    const double moved = std::abs(d.value(k) - d.calibration.value(k)) / d.calibration.sigma(k);
    if (moved > largest) {
      largest = moved;
      at = k;
    }
  }
  if (at < 0) {
    return {};
  }
  const SensorParameter& p = sensor_parameters[static_cast<std::size_t>(at)];
  const QuantityText with = quantity_text(d.value(at) / p.si_per_unit, d.sigma(at) / p.si_per_unit);
  const QuantityText without = quantity_text(d.calibration.value(at) / p.si_per_unit, d.sigma(at) / p.si_per_unit);
  return fmt::format("{} is {} {}, not {}", p.name, with.value, p.unit, without.value);
}

// ", or as well ...": what explains the recording no worse than what is named.
std::string or_as_well(const Finding& f) {
  if (f.equivalent.empty()) {
    return {};
  }
  const std::size_t more = f.equivalent.size() - 1;
  return fmt::format(", or as well {}{}", effect_words(f.equivalent.front()),
                     more == 0   ? std::string()
                     : more == 1 ? ", or " + effect_words(f.equivalent.back())
                                 : fmt::format(", or one of {} others", more));
}

// Every kind of finding once, with how many there are of one that is there several times, and what else it may be.
std::vector<std::string> kinds_of(const Diagnosis& d) {
  std::vector<std::string> effects, words;
  for (const Finding& f : d.findings) {
    if (std::ranges::find(effects, f.effect) == effects.end()) {
      const auto same = std::ranges::count(d.findings, f.effect, &Finding::effect);
      const bool lines = f.effect == "vibration_line" && same > 1;
      effects.push_back(f.effect);
      words.push_back(effect_words(f.effect) + (lines ? fmt::format(", {} of them", same) : or_as_well(f)));
    }
  }
  return words;
}

// Laws in the place of what is named, or of some of it.
std::string or_laws(const Diagnosis& d) {
  if (!doubtful(d)) {
    return {};
  }
  std::vector<std::string> names;
  for (const diagnosis::Effect* name : d.instead->names) {
    names.push_back(effect_words(name->id));
  }
  const char* before = d.instead->odds > 1.0 ? "; more likely" : "; or";
  return in_place_of_some(d)
             ? fmt::format("{}, in the place of {}, that {}", before, fmt::join(names, " and "), laws_words(*d.instead))
             : fmt::format("{} that {}", before, laws_words(*d.instead));
}

// With the equations that the names leave, or with the word that they leave something.
std::string named(const Diagnosis& d, const discovery::Discovery* beyond) {
  constexpr std::size_t most = 2;
  const std::vector<std::string> kinds = kinds_of(d);
  const auto told = std::span(kinds).first(std::min(most, kinds.size()));
  std::string text = fmt::format("{}", fmt::join(told, "; and "));
  if (kinds.size() > most) {
    text += fmt::format("; and {} more", kinds.size() - most);
  }
  if (d.unexplained && explains(beyond)) {
    return text + "; and that " + discovered_words(*beyond) + left_words(*beyond);
  }
  return text + (d.unexplained ? "; and what none of these explains" : or_laws(d));
}

// What shows it: the strongest coefficient, what the fit makes of the misfit, and what it does to the 24.
std::string named_cause(const Diagnosis& d, const discovery::Discovery* beyond) {
  const bool with_laws = d.unexplained && explains(beyond);
  std::string text;
  if (!d.findings.empty()) {
    const Finding& first = d.findings.front();
    text =
        fmt::format("{}: {};{} NIS {:.3g} becomes {:.3g}", first.effect, figures_with_significance(first),
                    with_laws ? fmt::format(" {};", law_figures(*beyond)) : std::string(), d.before.nis, d.after.nis);
  }
  const std::string moved = largest_correction(d);
  text += moved.empty() ? std::string() : fmt::format("; {}", moved);
  if (d.unexplained && !with_laws && !d.remaining.empty()) {
    text += fmt::format("; {:.1f} sigma remain in {}", d.remaining.front().significance, d.remaining.front().words);
  }
  if (d.instead) {
    text += "; " + in_place_words(d);
  }
  return text + ".";
}

// An equation that is only described, for none of its class holds elsewhere more probably than not; null: there is none.
const discovery::DiscoveredLaw* unsure_law(const discovery::Discovery* beyond) {
  const bool any = beyond != nullptr && !beyond->described.empty() && beyond->described.front().unsure;
  return any ? &beyond->described.front() : nullptr;
}

// What is only described, as the end of a sentence.
std::string described_clause(const discovery::Discovery& beyond) {
  if (const discovery::DiscoveredLaw* law = unsure_law(&beyond)) {
    return fmt::format("; {} follows one of {} equations, none of which holds elsewhere more probably than not",
                       name_of_axis(law->term.axis), std::max<std::size_t>(2, law->ambiguous.size()));
  }
  if (beyond.described.empty()) {
    return {};
  }
  const discovery::DiscoveredLaw& first = beyond.described.front();
  return fmt::format("; {} follows no equation that was tried, {}", name_of_axis(first.term.axis),
                     beyond.described.size() > 1 ? "only a sum of several" : first.expression + " comes nearest");
}

// What laws explain of the misfit where they do not explain the recording; empty where that is less than half.
std::string most_of_it(const discovery::Discovery* beyond) {
  constexpr double half = 0.5, nearly_all = 0.99;
  if (beyond == nullptr || beyond->laws.empty() || explained_share(*beyond) < half) {
    return {};
  }
  const double share = explained_share(*beyond);
  return fmt::format("{}{:.0f} % of the misfit is that {}", share > nearly_all ? "more than " : "",
                     100.0 * std::min(share, nearly_all), discovered_words(*beyond));
}

std::string unexplained_cause(const Diagnosis& d, const discovery::Discovery* beyond) {
  if (beyond != nullptr && explains(beyond)) {
    return discovered_figures(*beyond) + described_clause(*beyond) + ".";
  }
  if (!most_of_it(beyond).empty()) {
    return law_figures(*beyond) + described_clause(*beyond) + ".";
  }
  std::string text;
  // The mean over all hides what few places hold.
  const bool hidden = std::abs(d.after.nis - 1.0) < 0.1;
  if (!d.remaining.empty()) {
    text = hidden ? fmt::format("NIS {:.3g} is as expected over all, but ", d.after.nis) : std::string();
    text += fmt::format("{:.1f} sigma remain in {}", d.remaining.front().significance, d.remaining.front().words);
  } else if (!d.after.coloured && d.after.log_p_white < std::log(1e-3)) {
    text = fmt::format("what remains is {}", whiteness_text(d.after.log_p_white));
  } else {
    text = fmt::format("NIS {:.3g}", d.after.nis);
  }
  if (!d.rejected.empty()) {
    const Finding& best = d.rejected.front();
    text +=
        fmt::format("; the best of the catalogue, {} ({}), leaves it", best.effect, figures_with_significance(best));
  }
  if (beyond != nullptr && explained_share(*beyond) > 0.0) {
    text += fmt::format("; found beyond it: {}, {:.0f} % of the misfit", discovered_words(*beyond),
                        100.0 * explained_share(*beyond));
  }
  if (beyond != nullptr) {
    text += described_clause(*beyond);
  }
  return text + ".";
}

std::string fault_cause(const Diagnosis& d) {
  return d.faults.empty() ? std::string() : fmt::format("{}: {}.", d.faults.front().id, d.faults.front().words);
}

// A schedule where one would do, else what else it takes.
std::string next_for_suspects(const Diagnosis& d, const Subject& subject) {
  if (d.suspected.empty()) {
    return {};
  }
  const std::string& experiment = d.suspected.front().experiment;
  return showing_schedule(experiment, {}) ? command("diagnose", subject, "--split-schedule next.toml")
                                          : fmt::format("Record again with {}.", experiment);
}

std::size_t count(const Gate& gate, ObjectionKind kind) {
  return static_cast<std::size_t>(std::count_if(gate.objections.begin(), gate.objections.end(),
                                                [&](const Objection& o) { return o.kind == kind; }));
}

std::string and_more(const Gate& gate) {
  const std::size_t same = count(gate, gate.objections.front().kind);
  const std::string& first = gate.objections.front().words;
  return same > 1 ? fmt::format("{}, and {} more.", first, same - 1) : first + ".";
}

// Recording and model agree, but some of the 24 may not be used.
Summary summary_of_parameters(const CalibrationResult& result, const Gate& gate, const Subject& subject) {
  const Objection& first = gate.objections.front();
  Summary s{SummaryStanding::bad, {}, and_more(gate), {}};
  const std::size_t same = count(gate, first.kind);
  const std::string those = same == 1 ? "1 of the 24 parameters is" : fmt::format("{} of the 24 parameters are", same);
  switch (first.kind) {
    case ObjectionKind::implausible:
      s.verdict = those + " outside what such sensors can have; the set must not be used.";
      s.next = command("diagnose", subject);
      return s;
    case ObjectionKind::beyond_limit:
      s.verdict = those + " beyond the operator's limit; the set is not written without a reason.";
      s.next = subject.run > 0 ? fmt::format(
                                     "Check the unit, or correct `limit` in the configuration; then `selfcal "
                                     "run --force REASON` writes such a set.")
                               : "Check the unit, or correct the limit.";
      return s;
    default: break;
  }
  s.verdict = same == sensor_parameter_count ? "None of the 24 parameters is determined to tolerance: none may be used."
                                             : those + " not determined to tolerance; the others may be used.";
  s.next = result.undetermined.empty() || result.undetermined.front().supply.empty()
               ? std::string("selfcal plan --optimize")
               : fmt::format(
                     "Add to the schedule: {:.0f}/{:.0f} then {:.0f}/{:.0f} deg (outer/inner); `selfcal plan "
                     "--optimize` looks for a whole one.",
                     result.undetermined.front().supply.front().from.outer_deg,
                     result.undetermined.front().supply.front().from.inner_deg,
                     result.undetermined.front().supply.front().to.outer_deg,
                     result.undetermined.front().supply.front().to.inner_deg);
  return s;
}

// Of values beside which nothing of the catalogue explains the recording.
std::string unexplained_values(const discovery::Discovery* beyond) {
  if (explains(beyond)) {
    return fmt::format("These 24 values are biased by {}: {}{}.", beyond_what(*beyond), discovered_words(*beyond),
                       left_words(*beyond));
  }
  const std::string most = most_of_it(beyond);
  return most.empty()
             ? std::string(
                   "Recording and model disagree and nothing in the catalogue explains it: do not use these 24 values.")
             : fmt::format(
                   "Recording and model disagree: {}; nothing that was tried explains the rest: do not use these 24 "
                   "values.",
                   most);
}

Summary summary_of_inconsistency(const CalibrationResult& result, const Subject& subject, const Diagnosis* d,
                                 const discovery::Discovery* beyond) {
  Summary s{SummaryStanding::bad, {}, {}, {}};
  if (d != nullptr && d->verdict == DiagnosisVerdict::data_fault) {
    s.verdict = "The recording is faulty, so none of the 24 values may be used.";
    s.cause = fault_cause(*d);
    s.next = "Mend the fault and record again.";
  } else if (d != nullptr && d->verdict == DiagnosisVerdict::named) {
    s.verdict = fmt::format("These 24 values are biased by what the model leaves out: {}.", named(*d, beyond));
    s.cause = named_cause(*d, beyond);
    s.next = subject.run > 0 ? fmt::format("selfcal amend {}", subject.run) : command("diagnose", subject);
  } else if (d != nullptr && d->unexplained) {
    s.verdict = unexplained_values(beyond);
    s.cause = unexplained_cause(*d, beyond);
    s.next = command("diagnose", subject);
  } else {
    s.verdict = "Recording and model disagree: do not use these 24 values, their sigma is too small.";
    s.cause = nis_text(result.consistency) + ".";
    s.next = command("diagnose", subject);
  }
  return s;
}

// Equations are written with the 24 beside them; where several explain the recording as well, a next rotation parts them.
Summary summary_beyond(const Diagnosis& d, const Subject& subject, const discovery::Discovery* beyond) {
  if (beyond == nullptr || !explains(beyond)) {
    const std::string most = most_of_it(beyond);
    return {SummaryStanding::bad,
            most.empty()
                ? std::string("Recording and model differ, and nothing in the catalogue explains it.")
                : fmt::format("Recording and model differ: {}; nothing that was tried explains the rest.", most),
            unexplained_cause(d, beyond),
            command("diagnose", subject,
                    unsure_law(beyond) != nullptr ? "--next-experiment next.toml" : "--split-schedule next.toml")};
  }
  const bool ambiguous = std::any_of(beyond->laws.begin(), beyond->laws.end(),
                                     [](const discovery::DiscoveredLaw& law) { return law.ambiguous.size() > 1; });
  return {SummaryStanding::bad,
          fmt::format("The model leaves out {}: {}{}.", beyond_what(*beyond), discovered_words(*beyond),
                      left_words(*beyond)),
          unexplained_cause(d, beyond),
          command("diagnose", subject, ambiguous ? "--next-experiment next.toml" : "--amended amended")};
}

Summary acceptable_summary(const CalibrationResult& result, const Subject& subject) {
  Summary s{
      SummaryStanding::good, "All 24 parameters are determined to tolerance, and recording and model agree.", {}, {}};
  s.cause = nis_text(result.consistency) + ".";
  s.next = command("report", subject, "-o report.html");
  return s;
}

}  // namespace

Summary summary_of(const CalibrationResult& result, const Gate& gate, const Subject& subject, const Diagnosis* d,
                   const discovery::Discovery* beyond) {
  if (gate.acceptable()) {
    return acceptable_summary(result, subject);
  }
  switch (gate.objections.front().kind) {
    case ObjectionKind::data_fault:
    case ObjectionKind::unexplained:
    case ObjectionKind::inconsistent: return summary_of_inconsistency(result, subject, d, beyond);
    case ObjectionKind::not_converged:
      return {SummaryStanding::bad, "The passes did not settle: none of the 24 values may be used.",
              gate.objections.front().words + ".", command("diagnose", subject)};
    default: return summary_of_parameters(result, gate, subject);
  }
}

Summary summary_of_amended(const CalibrationResult& result, const Gate& gate, const Subject& subject,
                           const Diagnosis& d, const discovery::Discovery* beyond) {
  if (gate.acceptable() && confirmed(beyond)) {
    return {SummaryStanding::good,
            fmt::format("All 24 parameters are determined to tolerance once this is fitted too: {}.",
                        discovered_words(*beyond)),
            fmt::format("{}, in {} recordings.", discovered_figures(*beyond), beyond->fit.recordings.size()),
            command("report", subject, "-o report.html")};
  }
  if (gate.acceptable()) {
    return {SummaryStanding::good,
            fmt::format("All 24 parameters are determined to tolerance once this is fitted too: {}.", named(d, beyond)),
            named_cause(d, beyond), command("report", subject, "-o report.html")};
  }
  switch (gate.objections.front().kind) {
    case ObjectionKind::nothing_to_amend:
      return {SummaryStanding::bad, "Nothing to amend: no equation was named in the recording.",
              summary_of(d, subject, beyond).verdict, command("diagnose", subject)};
    case ObjectionKind::data_fault:
    case ObjectionKind::unexplained:
    case ObjectionKind::inconsistent:
      return summary_of_inconsistency(result, {subject.recording, 0}, &d, beyond);  // amending again would not help
    default: return summary_of(result, gate, subject, &d, beyond);
  }
}

Summary summary_of(const Diagnosis& d, const Subject& subject, const discovery::Discovery* beyond) {
  if (wanders_at_rest(d) && d.verdict != DiagnosisVerdict::data_fault) {
    return {SummaryStanding::open, "Nothing turned, and what the sensors read changes by more than white noise.",
            "Position at rest does not tell by what.", command("poses", subject)};
  }
  if (d.nothing_turned && d.verdict != DiagnosisVerdict::data_fault) {
    return {SummaryStanding::open,
            d.findings.empty()
                ? std::string("Nothing turned: no sensor effect can be told from motion of the base.")
                : fmt::format("Nothing turned, so only the noise was judged: {}.", fmt::join(kinds_of(d), ", ")),
            fmt::format("NIS {:.3g}{}{}.", d.before.nis,
                        d.calibration.noise.disturbed.empty()
                            ? std::string()
                            : fmt::format(", {} s disturbed from outside", d.calibration.noise.disturbed.size()),
                        d.base_tilt ? fmt::format(", the base tilts by {:.2g} arcmin, as gyros and gravity show alike",
                                                  60.0 * d.base_tilt->range / units::degree)
                                    : std::string()),
            "selfcal plan --optimize"};
  }
  switch (d.verdict) {
    case DiagnosisVerdict::adequate:
      return {SummaryStanding::good,
              "Recording and model agree: nothing that this recording can show was left out.",
              fmt::format("NIS {:.3g}, largest misfit {:.1f} sigma, innovations {}.", d.before.nis,
                          d.before.largest_sigma, innovations_text(d.before)),
              {}};
    case DiagnosisVerdict::named:
      return {SummaryStanding::bad, fmt::format("The model leaves out: {}.", named(d, beyond)), named_cause(d, beyond),
              doubtful(d)       ? command("diagnose", subject, "--next-experiment next.toml")
              : subject.run > 0 ? fmt::format("selfcal amend {}", subject.run)
                                : command("diagnose", subject, "--amended amended")};
    case DiagnosisVerdict::none_of_the_above: return summary_beyond(d, subject, beyond);
    case DiagnosisVerdict::not_enough_information:
      return {SummaryStanding::open, "Recording and model may differ, but too little to say by what.",
              d.suspected.empty()
                  ? std::string()
                  : fmt::format("The strongest suspect is {}: {}.", effect_words(d.suspected.front().effect),
                                figures_with_significance(d.suspected.front())),
              next_for_suspects(d, subject)};
    case DiagnosisVerdict::data_fault:
      return {SummaryStanding::bad, "The recording is faulty: nothing else is concluded from it.", fault_cause(d),
              "Mend the fault and record again."};
  }
  return {};
}

std::string innovations_text(const diagnosis::Adequacy& adequacy) {
  return adequacy.coloured ? "coloured by quantum and lines" : whiteness_text(adequacy.log_p_white);
}

}  // namespace selfcal
