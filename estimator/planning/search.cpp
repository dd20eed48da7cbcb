// Beam search for the shortest schedule that meets the tolerances.
#include <algorithm>
#include <cmath>
#include <limits>

#include "estimator/planning/plan.hpp"
#include "estimator/planning/schedule_model.hpp"

namespace selfcal {
namespace {

struct Candidate {
  std::vector<GimbalPosition> positions;
  UdFilter filter;
  double shortfall;  // 0 where every tolerance is met
};

// Sum over the parameters of ln(sigma/tolerance) where positive, and a little of the rest, so that of two equal
// candidates the more precise one is kept.
double shortfall_of(const UdFilter& filter, const ParameterVector& tolerance) {
  double sum = 0.0;
  const ParameterVector sigma = ScheduleModel::sigma(filter);
  for (int i = 0; i < sensor_parameter_count; ++i) {
    if (std::isfinite(tolerance(i))) {
      sum += std::max(0.0, std::log(sigma(i) / tolerance(i)));
    }
  }
  return sum;
}

bool met(const UdFilter& filter, const ParameterVector& tolerance) { return shortfall_of(filter, tolerance) == 0.0; }

// The four moves of one axis by 90 deg; no axis beyond a full turn, so that cables do not wind up.
std::vector<GimbalPosition> moves_from(const GimbalPosition& p) {
  std::vector<GimbalPosition> next;
  for (const GimbalPosition& step : {GimbalPosition{90, 0}, {-90, 0}, {0, 90}, {0, -90}}) {
    const GimbalPosition to{p.outer_deg + step.outer_deg, p.inner_deg + step.inner_deg};
    if (to.outer_deg >= 0 && to.outer_deg <= 270 && to.inner_deg >= 0 && to.inner_deg <= 270) {
      next.push_back(to);
    }
  }
  return next;
}

Schedule as_schedule(const std::vector<GimbalPosition>& positions, double dwell_s, double rotation_s) {
  return {positions, std::vector<double>(positions.size(), dwell_s), rotation_s};
}

class Search {
 public:
  Search(const Installation& installation, const SearchOptions& options)
      : installation_(installation), options_(options), model_(installation) {}

  // The shortest found with this dwell time everywhere, within `longest_s`.
  void with_dwell(double dwell_s, double longest_s, SearchResult& best);
  int evaluated = 0;

 private:
  void consider(const std::vector<GimbalPosition>& positions, double dwell_s, double longest_s, SearchResult& best);
  void trim(Schedule& schedule);
  bool feasible(const Schedule& schedule);

  const Installation& installation_;
  const SearchOptions& options_;
  ScheduleModel model_;
};

bool Search::feasible(const Schedule& schedule) {
  UdFilter filter = model_.start();
  for (std::size_t i = 0; i < schedule.positions.size(); ++i) {
    if (i > 0) {
      model_.move(filter, schedule.positions[i - 1], schedule.positions[i], schedule.rotation_s);
    }
    model_.dwell(filter, schedule.positions[i], schedule.dwell_s[i]);
  }
  ++evaluated;
  return met(filter, installation_.tolerance);
}

// Shortens the dwells one after the other, by halves and then by quarters, while the tolerances hold.
void Search::trim(Schedule& schedule) {
  for (const double factor : {0.5, 0.75, 0.9}) {
    for (std::size_t i = 0; i < schedule.dwell_s.size(); ++i) {
      const double before = schedule.dwell_s[i];
      schedule.dwell_s[i] = std::max(5.0, std::floor(before * factor));
      if (schedule.dwell_s[i] < before && !feasible(schedule)) {
        schedule.dwell_s[i] = before;
      }
    }
  }
}

void Search::consider(const std::vector<GimbalPosition>& positions, double dwell_s, double longest_s,
                      SearchResult& best) {
  Schedule schedule = as_schedule(positions, dwell_s, options_.rotation_s);
  trim(schedule);
  if (schedule.duration_s() <= longest_s && (!best.found || schedule.duration_s() < best.schedule.duration_s())) {
    best.schedule = schedule;
    best.found = true;
  }
}

void Search::with_dwell(double dwell_s, double longest_s, SearchResult& best) {
  const GimbalPosition home{0, 0};
  std::vector<Candidate> beam;
  beam.push_back({{home}, model_.start(), 0.0});
  model_.dwell(beam[0].filter, home, dwell_s);
  double duration = dwell_s;
  double least_shortfall = std::numeric_limits<double>::infinity();
  while (duration + options_.rotation_s + dwell_s <= longest_s) {
    duration += options_.rotation_s + dwell_s;
    std::vector<Candidate> next;
    for (const Candidate& c : beam) {
      for (const GimbalPosition& to : moves_from(c.positions.back())) {
        Candidate grown = c;
        model_.move(grown.filter, c.positions.back(), to, options_.rotation_s);
        model_.dwell(grown.filter, to, dwell_s);
        grown.positions.push_back(to);
        grown.shortfall = shortfall_of(grown.filter, installation_.tolerance);
        ++evaluated;
        next.push_back(std::move(grown));
      }
    }
    std::sort(next.begin(), next.end(),
              [](const Candidate& a, const Candidate& b) { return a.shortfall < b.shortfall; });
    if (next.size() > static_cast<std::size_t>(options_.beam)) {
      next.erase(next.begin() + options_.beam, next.end());
    }
    beam = std::move(next);
    if (beam[0].shortfall == 0.0) {
      consider(beam[0].positions, dwell_s, longest_s, best);
      return;
    }
    if (!best.found && beam[0].shortfall < least_shortfall) {  // the best so far, should none meet the tolerances
      least_shortfall = beam[0].shortfall;
      best.schedule = as_schedule(beam[0].positions, dwell_s, options_.rotation_s);
    }
  }
}

}  // namespace

SearchResult search_schedule(const Installation& installation, const SearchOptions& options,
                             const std::function<void(double)>& progress) {
  SearchResult best;
  Search search(installation, options);
  // Long dwells first: they need few positions, are soon done, and bound what short ones may take.
  std::vector<double> dwells = options.dwells_s;
  std::sort(dwells.rbegin(), dwells.rend());
  double shortfall = std::numeric_limits<double>::infinity();
  Schedule nearest;
  for (std::size_t i = 0; i < dwells.size(); ++i) {
    const double longest = best.found ? best.schedule.duration_s() : options.longest_s;
    search.with_dwell(dwells[i], longest, best);
    if (!best.found && !best.schedule.positions.empty()) {
      const Plan plan = predict(best.schedule, installation);
      double sum = 0.0;
      for (int k = 0; k < sensor_parameter_count; ++k) {
        if (std::isfinite(installation.tolerance(k))) {
          sum += std::max(0.0, std::log(plan.sigma(k) / installation.tolerance(k)));
        }
      }
      if (sum < shortfall) {
        shortfall = sum;
        nearest = best.schedule;
      }
    }
    if (progress) {
      progress(static_cast<double>(i + 1) / static_cast<double>(dwells.size()));
    }
  }
  if (!best.found) {
    best.schedule = nearest;
  }
  best.plan = predict(best.schedule, installation);
  best.evaluated = search.evaluated;
  return best;
}

}  // namespace selfcal
