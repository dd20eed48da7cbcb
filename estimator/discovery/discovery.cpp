#include "estimator/discovery/discovery.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <type_traits>
#include <utility>

#include "estimator/discovery/class_average.hpp"
#include "estimator/discovery/constant_spread.hpp"
#include "estimator/discovery/departure.hpp"
#include "estimator/discovery/explanation_cost.hpp"
#include "estimator/discovery/known_form.hpp"
#include "estimator/discovery/lack_of_fit.hpp"
#include "estimator/discovery/law_class.hpp"
#include "estimator/discovery/laws_leave.hpp"
#include "estimator/discovery/piece_residual.hpp"
#include "estimator/discovery/scene.hpp"
#include "estimator/discovery/search_state.hpp"
#include "estimator/discovery/shortlist.hpp"
#include "estimator/discovery/stability.hpp"
#include "estimator/discovery/step_with_turns.hpp"
#include "estimator/discovery/two_laws.hpp"
#include "estimator/statistics/distributions.hpp"

namespace selfcal::discovery {
namespace {

constexpr std::size_t shortlist_size = 12;  // refined exactly in each step
constexpr std::size_t class_size = 40;      // looked at exactly for the class
constexpr std::size_t members_averaged = 8;

double log_p(const Candidate& c) { return log_p_of_law(c.gain, c.term.constants.size(), c.cost); }

// The 24 where no law is.
FittedRecording without_any_law(const CalibrationResult& calibration) {
  return {calibration.value, calibration.covariance, calibration.covariance,
          Eigen::MatrixXd::Zero(sensor_parameter_count, 0)};
}

}  // namespace

class LawSearch::Search {
 public:
  Search(std::span<const UnitRecording> recordings, const DiscoveryOptions& options, const Progress& progress)
      : recordings_(recordings),
        options_(options),
        progress_(progress),
        scenes_(scenes_of(recordings)),
        residual_(scenes_, options.stop, progress),
        shortlist_(residual_.sums(), residual_.dictionary()) {
    laws_on_ = laws_on(scenes_);
    const ColumnSums& sums = residual_.sums().sums;
    result_.misfit_before = sums.square - sums.rows;
    result_.rows = sums.rows;
    result_.log_determinant = sums.log_determinant;
    result_.functions_tried = residual_.dictionary().functions.size() * axis_count;
    for (const UnitRecording& recording : recordings) {
      empty_.fit.recordings.push_back(without_any_law(recording.calibration));
    }
    empty_.fit.square_after = sums.square;
    state_ = empty_;
  }

  // Laws first, and beside them what a random process takes up; then processes first. The way of the greater posterior
  // probability is reported: a process can stand for any law, and laws added up can stand for a process.
  void fit() {
    const ProcessFit alone = best_process();
    const bool may_stand_alone = significant(alone);
    take_laws();
    settle();
    take_more_laws();
    bool process_left = significant(best_process());
    if (state_.terms.size() > 1 || process_left) {
      begin_with_two();
      process_left = significant(best_process());
    }
    if (process_left || (may_stand_alone && !laws_are_likelier(alone))) {
      processes_too();
    }
    if (state_.processes.empty()) {
      drop_weak();
    }
    write_down();
  }

  // Classes, stability and what else is told of the laws as fitted.
  void tell() {
    std::vector<DiscoveredLaw> laws(state_.terms.size());
    for (std::size_t k = 0; k < laws.size(); ++k) {
      settle_class(k, laws[k]);  // which may put another equation in the place of one
    }
    write_down();
    for (std::size_t k = 0; k < state_.terms.size(); ++k) {
      DiscoveredLaw& law = laws[k];
      write_numbers(law, state_, k, shortlist_.constants(state_.terms[k]));
      law.share = std::min(1.0, law.gain / std::max(1.0, result_.misfit_before));
      if (const auto spread = spread_over_constant(laws_on_, state_.fit, k, options_.stop)) {
        // Where the range of the search cuts off probable values, the spread is too small.
        law.sigma = std::max(law.sigma, spread->coefficient);
        law.constants.front().sigma = std::max(law.constants.front().sigma, spread->constant);
      }
      law.carries_over /= result_.instead ? 1.0 + result_.instead->odds : 1.0;
      const Departed far = departed(laws_on_, state_.fit, k, residual_.available(), options_.stop);
      law.departure_log_p = far.log_p;
      law.departs_with = far.quantity;
      law.in_step = in_step_with_turns(laws_on_, state_.terms[k]);
    }
    ask_axes(laws);
    std::stable_sort(laws.begin(), laws.end(),
                     [](const DiscoveredLaw& a, const DiscoveredLaw& b) { return a.gain > b.gain; });
    TellingLaws telling = tell_laws(std::move(laws), state_.processes, options_.departure_rate);
    result_.laws = std::move(telling.told);
    result_.described = std::move(telling.described);
  }

  Discovery& result() { return result_; }
  std::span<const UnitRecording> recordings() const { return recordings_; }
  const DiscoveryOptions& options() const { return options_; }

 private:
  template <typename F>
  std::invoke_result_t<F> said(const char* words, F&& work) {
    if (progress_) {
      progress_(words);
    }
    return work();
  }

  bool room() const {
    return static_cast<int>(state_.terms.size() + state_.processes.size()) < options_.most_terms &&
           !options_.stop.stop_requested();
  }

  // Laws that were found one by one against the best two together, and what these leave.
  void begin_with_two() {
    const std::optional<SearchState> two = said("two laws at once", [&] {
      return two_laws(laws_on_, residual_.whole_model(), residual_.dictionary(), shortlist_, options_.false_alarm_rate,
                      options_.stop);
    });
    if (!two) {
      choose(state_.terms.size());
      return;
    }
    const SearchState one_by_one = std::exchange(state_, *two);
    choose(state_.terms.size());
    exchange(state_.terms.size());
    settle();
    take_more_laws();
    if (log_posterior_of_laws(state_) < log_posterior_of_laws(one_by_one)) {
      state_ = one_by_one;
      settle();
    }
  }

  // About what the laws leave, exactly; beside the processes.
  void settle() {
    if (state_.terms.empty()) {
      residual_.put_back();
    } else {
      said("what the laws leave", [&] { residual_.take_out(state_.fit); });
      choose(state_.terms.size());
    }
    for (const ProcessFit& process : integrated_out_) {
      residual_.model().integrate_out(process.columns, process.size * process.size);
    }
  }

  // Beside those that are settled already: of one that is taken in addition the means of the pieces leave what a process could take up.
  void take_more_laws() {
    const std::size_t settled = state_.terms.size();
    take_laws();
    if (state_.terms.size() != settled) {
      settle();
    }
  }

  void processes_too() {
    take_processes();
    const SearchState laws_first = state_;
    const std::vector<ProcessFit> beside_laws = std::exchange(integrated_out_, {});
    const double laws_first_posterior = log_posterior();
    state_ = empty_;
    residual_.put_back();
    take_processes();
    take_more_laws();
    const double ahead = state_.processes.empty() ? -1.0 : log_posterior() - laws_first_posterior;
    if (!state_.processes.empty()) {
      result_.instead = ahead < 0.0 ? other_explanation(laws_first, state_, -ahead, options_.least_odds)
                                    : other_explanation(state_, laws_first, ahead, options_.least_odds);
    }
    if (ahead < 0.0) {
      state_ = laws_first;
      integrated_out_ = beside_laws;
      // What may stand in a law's place is asked of the recording without the other way's processes.
      residual_.put_back();
      settle();
    }
  }

  // Logarithm of the posterior probability, but for a constant.
  double log_posterior() const {
    return -0.5 * residual_.model().square() - cost_of_processes() - cost_of_laws(state_) - cost_of_sizes();
  }

  // Of each law's coefficient, which the rows show, and each process' size, which the dwells do.
  double cost_of_sizes() const { return 0.5 * (sizes_of_laws() + sizes_of_processes(state_.processes.size())); }
  double sizes_of_laws() const {
    return cost_of_a_size(residual_.sums().sums.rows) * static_cast<double>(state_.terms.size());
  }
  double sizes_of_processes(std::size_t processes) const {
    return cost_of_a_size(residual_.sums().dwells()) * static_cast<double>(processes);
  }

  double cost_of_processes() const {
    return state_.half_log_determinant + std::log(process_count) * static_cast<double>(state_.processes.size());
  }

  bool significant(const ProcessFit& process) const {
    // What is less than this share of a strong law is the error of its linearisation as likely as anything else.
    constexpr double least_share = 0.005;
    return 2.0 * process.log_likelihood_gain > least_share * gained() &&
           log_chi_squared_tail(2.0 * process.log_likelihood_gain, 1.0) + std::log(process_count * shares) <
               std::log(options_.false_alarm_rate);
  }

  // Whether the process costs more than all laws do, were the rest as they leave it: then no way that begins with it is the likelier
  // one, nor one with odds that are worth a word.
  bool laws_are_likelier(const ProcessFit& alone) const {
    const double saved =
        cost_of_laws(state_) + 0.5 * (sizes_of_laws() - sizes_of_processes(1)) - std::log(options_.least_odds);
    return !state_.terms.empty() &&
           alone.half_log_determinant + std::log(process_count) - 0.5 * absorbed(residual_.model(), alone) > saved;
  }

  void take_processes() {
    for (ProcessFit process = best_process(); significant(process) && room(); process = best_process()) {
      const double before = residual_.model().square();
      residual_.model().integrate_out(process.columns, process.size * process.size);
      state_.half_log_determinant += 0.5 * (before - residual_.model().square()) - process.log_likelihood_gain;
      state_.processes.push_back(
          {process.kind, process.axis, process.size, process.sigma, process.log_likelihood_gain, process.ahead});
      integrated_out_.push_back(std::move(process));
    }
  }

  ProcessFit best_process() const {
    ProcessFit best;
    for (int axis = 0; axis < axis_count; ++axis) {
      const bool there = std::any_of(state_.processes.begin(), state_.processes.end(),
                                     [&](const DiscoveredProcess& p) { return p.axis == axis; });
      if (!there) {
        ProcessFit fit = likelier_process(residual_.model(), residual_.sums(), axis);
        best = fit.log_likelihood_gain > best.log_likelihood_gain ? std::move(fit) : best;
      }
    }
    return best;
  }

  void take_laws() {
    while (room() && take_law()) {
    }
  }

  // Adds the best law that predicts what was left out; false when none pays.
  bool take_law() {
    if (progress_) {
      progress_("law " + std::to_string(state_.terms.size() + 1));
    }
    const double limit = std::log(options_.false_alarm_rate);
    std::vector<Candidate> candidates = shortlist_.best(residual_.model(), shortlist_size);
    if (candidates.empty() || log_p(candidates.front()) > limit) {
      state_.log_p_remaining = candidates.empty() ? 0.0 : std::min(0.0, log_p(candidates.front()));
      return false;
    }
    if (state_.processes.empty()) {  // with a process in play the pieces stand
      candidates = best_of(exact_alternatives(laws_on_, state_.terms, candidates, options_.stop));
    }
    for (const Candidate& candidate : candidates) {
      state_.log_p_remaining = std::min(0.0, log_p(candidate));
      if (log_p(candidate) > limit) {
        return false;
      }
      if (accept(candidate)) {
        exchange(state_.terms.size() - 1);
        return true;
      }
      state_.refused = state_.refused.empty() ? candidate.text() : state_.refused;
    }
    return false;
  }

  bool accept(const Candidate& candidate) {
    std::vector<LawTerm> terms = state_.terms;
    terms.push_back(candidate.term);
    const LawFit fit = fit_laws(laws_on_, terms, constant_rounds, options_.stop);
    if (fit.terms.size() != terms.size() || !stands(fit, terms.size() - 1)) {
      return false;
    }
    state_.costs.push_back(candidate.cost);
    adopt(fit);
    return true;
  }

  void adopt(const LawFit& fit) {
    state_.fit = fit;
    state_.terms = fit.terms;
    choose(state_.terms.size());
  }

  // Projects out all terms but one, with the derivatives by their constants.
  void project_out(PieceModel& model, std::size_t left_out) const {
    std::vector<Eigen::VectorXd> columns;
    for (std::size_t k = 0; k < state_.terms.size(); ++k) {
      if (k != left_out) {
        shortlist_.add_columns(model, state_.terms[k], columns);
      }
    }
    model.choose(columns);
  }
  void choose(std::size_t left_out) { project_out(residual_.model(), left_out); }

  // What explains the recording in the place of term k, exactly, with other values of its constant; `own`: the term as it stands.
  std::vector<std::vector<Candidate>> rivals(std::size_t k, std::size_t most, Candidate& own) {
    PieceModel& model = residual_.whole_model();  // what settle() took out is what the rivals are to explain
    project_out(model, k);
    const std::vector<Candidate> candidates = shortlist_.best(model, most);
    project_out(model, state_.terms.size());
    const std::vector<LawTerm> others = all_but(state_.terms, k);
    const SingleFit alone = fit_each(laws_on_, others, {state_.terms[k]}, options_.stop).front();
    own = {state_.terms[k], alone.gain, state_.costs[k], false, alone.coefficient};
    return exact_alternatives(laws_on_, others, candidates, options_.stop);
  }

  // Each of the first `count` terms in turn against all functions, the others staying: what was taken first may have stood for two.
  // What is then left with less than significance is dropped.
  void exchange(std::size_t count) {
    if (state_.terms.size() < 2 || !state_.processes.empty()) {
      return;
    }
    for (std::size_t k = 0; k < count; ++k) {
      Candidate own;
      const std::vector<Candidate> candidates = best_of(rivals(k, shortlist_size, own));
      if (!candidates.empty() && candidates.front().merit() > own.merit() + 1.0) {
        put_in_place(k, candidates.front(), true);
      }
    }
    drop_weak();
  }

  bool put_in_place(std::size_t k, const Candidate& candidate, bool must_gain) {
    std::vector<LawTerm> terms = state_.terms;
    terms[k] = candidate.term;
    const LawFit fit = fit_laws(laws_on_, terms, constant_rounds, options_.stop);
    if (fit.terms.size() != terms.size() || (must_gain && fit.square_after >= state_.fit.square_after) ||
        !stands(fit, k)) {
      return false;
    }
    state_.costs[k] = candidate.cost;
    adopt(fit);
    return true;
  }

  void drop_weak() {
    for (std::size_t k = 0; k < state_.terms.size() && state_.terms.size() > 1; ++k) {
      const Candidate here{state_.terms[k], state_.fit.gain[k], state_.costs[k], false};
      if (log_p(here) > std::log(options_.false_alarm_rate)) {
        const LawFit fit = fit_laws(laws_on_, all_but(state_.terms, k), constant_rounds, options_.stop);
        state_.costs.erase(state_.costs.begin() + static_cast<std::ptrdiff_t>(k));
        adopt(fit);
        k = static_cast<std::size_t>(-1);  // from the start: the others' gains have changed
      }
    }
  }

  LawClass class_of(std::size_t k) {
    Candidate own;
    const std::vector<std::vector<Candidate>> others = rivals(k, class_size, own);
    PieceModel& model = residual_.whole_model();
    project_out(model, k);
    const std::vector<Candidate> own_values = shortlist_.values_of_wave(model, own);
    project_out(model, state_.terms.size());
    return {recordings_.back(), std::move(own), others, own_values, options_.least_odds, options_.stop};
  }

  // Of the class of term k the equation that holds on another plan with the greatest probability takes its place. Fills the
  // class, its stability and that probability. What is only described has no class: that takes most of the time.
  void settle_class(std::size_t k, DiscoveredLaw& law) {
    if (is_crowded(state_.terms[k].axis, state_.terms, state_.fit.gain, state_.processes)) {
      law.ambiguous = {{state_.terms[k].expression.text(state_.terms[k].constants), state_.terms[k].axis, 1.0, {}}};
      return;
    }
    constexpr double worth_a_change = 0.02;  // of the probability
    LawClass all = class_of(k);
    const std::size_t best = all.best_elsewhere();
    const double more = all.elsewhere().merit[best] - all.elsewhere().merit.front();
    if (more > worth_a_change && put_in_place(k, all.possible()[best], false)) {
      all = class_of(k);
    }
    law.carries_over = all.elsewhere().probability.front();
    law.ambiguous = all.functions();
    std::vector<Candidate> tried = all.members();
    const std::size_t members = tried.size();
    const std::vector<Candidate> beside = all.tried_beside();
    tried.insert(tried.end(), beside.begin(), beside.end());
    law.stability = stability(laws_on_, all_but(state_.terms, k), tried, members, options_.stop);
  }

  double gained() const { return state_.fit.square_before - state_.fit.square_after; }

  // What all laws of an axis together do, of axes whose form these do not rule out to be known already.
  void ask_axes(std::vector<DiscoveredLaw>& laws) {
    const bool laws_alone = state_.processes.empty();  // or what is left is no matter of the laws
    if (laws_alone) {
      settle();
    }
    for (int axis = 0; axis < axis_count; ++axis) {
      const bool any = std::any_of(laws.begin(), laws.end(), [&](const auto& law) { return law.term.axis == axis; });
      if (!any || is_crowded(axis, state_.terms, state_.fit.gain, state_.processes)) {
        continue;
      }
      const double overlap = overlap_on_axis(laws_on_, state_.fit, axis, options_.stop);
      const double lack = laws_alone ? log_p_of_lack(residual_.model(), residual_.sums(), axis, gained()) : 0.0;
      for (DiscoveredLaw& law : laws) {
        if (law.term.axis == axis) {
          law.overlap = overlap;
          law.lack_log_p = lack;
        }
      }
    }
  }

  void write_down() {
    result_.processes = state_.processes;
    result_.cost_of_processes = 2.0 * cost_of_processes();
    result_.log_p_remaining = state_.log_p_remaining;
    result_.refused = state_.refused;
    result_.fit = state_.fit;
    result_.misfit_after =
        (state_.processes.empty() ? state_.fit.square_after : residual_.model().square()) - result_.rows;
  }

  std::span<const UnitRecording> recordings_;
  DiscoveryOptions options_;
  Progress progress_;
  std::vector<std::unique_ptr<Scene>> scenes_;
  std::vector<LawRecording> laws_on_;  // the same, for fits
  PieceResidual residual_;
  Shortlist shortlist_;
  Discovery result_;
  SearchState empty_, state_;
  std::vector<ProcessFit> integrated_out_;  // the processes of state_
};

LawSearch::LawSearch(std::span<const UnitRecording> recordings, const DiscoveryOptions& options,
                     const Progress& progress)
    : search_(std::make_unique<Search>(recordings, options, progress)) {
  search_->fit();
}
LawSearch::LawSearch(LawSearch&&) noexcept = default;
LawSearch::~LawSearch() = default;

const Discovery& LawSearch::fitted() const { return search_->result(); }

Discovery LawSearch::told() {
  search_->tell();
  Discovery found = std::move(search_->result());
  const std::span<const UnitRecording> recordings = search_->recordings();
  const DiscoveryOptions options = search_->options();
  search_.reset();  // what follows has passes and memory of its own
  if (found.laws.empty() && found.described.empty() && found.processes.empty()) {
    return found;
  }
  const LawFit told = fit_of_told(recordings, found, options.stop);
  found.average = average_over_classes(recordings, found, told, members_averaged, options.stop);
  if (found.processes.empty() ? !found.laws.empty() : found.described.empty()) {
    found.left = left_by(recordings.front(), told, found.processes, options.coloured);
  }
  return found;
}

Discovery discover(std::span<const UnitRecording> recordings, const DiscoveryOptions& options,
                   const Progress& progress) {
  return LawSearch(recordings, options, progress).told();
}

}  // namespace selfcal::discovery
