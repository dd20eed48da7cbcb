#include "tools/report/misfit_map.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <nlohmann/json.hpp>

#include "estimator/diagnosis/regression/signature_pass.hpp"
#include "estimator/diagnosis/still_calibration.hpp"
#include "estimator/geometry/units.hpp"
#include "tools/report/page.hpp"

namespace selfcal::report {
namespace {

using diagnosis::Candidate;
using diagnosis::Columns;
using diagnosis::Effect;
using diagnosis::EffectContext;
using diagnosis::LocatedColumn;
using Json = nlohmann::ordered_json;

constexpr std::array<int, 6> edges_s = {0, 5, 15, 30, 60, 120};
constexpr double visible = 1e-6;  // information below which a bias in the cell would not be seen

// A bias of each axis from `constant` (since the start of the recording) for Length seconds.
template <int Length>
void bias_in_cell(const EffectContext& c, double constant, Columns velocity, Columns angle) {
  const double dt = std::min(c.end_s, constant + Length) - std::max(c.start_s, constant);
  if (dt > 0.0) {
    angle.leftCols<3>().diagonal().array() += dt;
    velocity.rightCols<3>().diagonal().array() += dt;
  }
}

template <int Length>
Effect cell_effect() {
  Effect effect;
  effect.id = "bias_in_cell";
  effect.sensor = bias_in_cell<Length>;
  for (int axis = 0; axis < 6; ++axis) {
    effect.parameters.push_back(
        {"", axis < 3 ? "deg/h" : "ug", axis < 3 ? units::degree_per_hour : units::micro_g, 1.0});
  }
  return effect;
}

const std::array<Effect, 5>& cell_effects() {
  static const std::array<Effect, 5> all = {cell_effect<5>(), cell_effect<10>(), cell_effect<15>(), cell_effect<30>(),
                                            cell_effect<60>()};
  return all;
}

struct Cell {
  int position = 0, axis = 0, bin = 0;
  double middle_s = 0.0;
  Eigen::Index column = 0;
  double unit = 1.0;  // of the column, in deg/h or ug
};

struct Layout {
  std::vector<Candidate> candidates;  // the model's equations, then the cells
  Eigen::VectorXd model_size;         // of the first columns
  std::vector<Cell> cells;
};

Layout lay_out(const diagnosis::RecordingContext& context, const std::vector<diagnosis::ModelEffect>& model) {
  Layout layout;
  int column = 0;
  const auto add = [&](const Effect& effect, double constant) {
    const auto count = static_cast<int>(effect.parameters.size());
    layout.candidates.push_back({&effect, constant, column, count});
    column += count;
  };
  for (const diagnosis::ModelEffect& effect : model) {
    add(*effect.effect, effect.constant);
    layout.model_size.conservativeResize(column);
    layout.model_size.tail(effect.size.size()) = effect.size;
  }
  const double start = context.segments().front().start_s;
  int position = 0;
  for (const Segment& segment : context.segments()) {
    if (segment.rotation) {
      continue;
    }
    ++position;
    for (std::size_t bin = 0; bin + 1 < edges_s.size(); ++bin) {
      if (segment.start_s + edges_s[bin + 1] > segment.end_s + 0.5) {
        break;
      }
      const double from = segment.start_s - start + edges_s[bin];
      for (int axis = 0; axis < 6; ++axis) {
        layout.cells.push_back({position, axis, static_cast<int>(bin), from + 0.5 * (edges_s[bin + 1] - edges_s[bin]),
                                column + axis, 1.0});
      }
      add(cell_effects()[bin], from);
    }
  }
  return layout;
}

// The turns themselves are among the columns of the map.
void add_turns(const diagnosis::SignaturePass& pass, std::vector<Cell>& cells) {
  Eigen::Index column = pass.first_map_column();
  for (const LocatedColumn& m : pass.map()) {
    if (m.kind == LocatedColumn::Kind::rotation) {
      const double unit = m.axis < 3 ? units::degree_per_hour : units::micro_g;
      cells.push_back(
          {m.index + 2, m.axis, -1, 0.5 * (m.start_s + m.end_s), column, diagnosis::map_unit(m.axis) / unit});
    }
    ++column;
  }
}

// Bias of each axis in each whole dwell.
Json dwells_json(const diagnosis::SignaturePass& pass, const diagnosis::SignatureRows& rows,
                 const Eigen::VectorXd& explained) {
  Json position = Json::array(), axis = Json::array();
  Json bias = Json::array(), sigma = Json::array(), signature = Json::array();
  Eigen::Index next = pass.first_map_column();
  for (const LocatedColumn& m : pass.map()) {
    const auto column = rows.columns.col(next++);
    const double information = column.squaredNorm();
    if (m.kind != LocatedColumn::Kind::dwell || information < visible) {
      continue;
    }
    const double unit = diagnosis::map_unit(m.axis) / (m.axis < 3 ? units::degree_per_hour : units::micro_g);
    position.push_back(m.index + 1);
    axis.push_back(m.axis);
    bias.push_back(rounded(unit * column.dot(rows.residual) / information));
    sigma.push_back(rounded(unit / std::sqrt(information)));
    signature.push_back(rounded(unit * column.dot(explained) / information));
  }
  return {{"position", position}, {"axis", axis}, {"bias", bias}, {"sigma", sigma}, {"signature", signature}};
}

}  // namespace

Json misfit_map(const ImuData& data, const diagnosis::Diagnosis& d, const ImuData* without_laws) {
  const diagnosis::RecordingContext context(data);
  Layout layout = lay_out(context, d.model);
  diagnosis::SignaturePass pass(context, layout.candidates, true);
  add_turns(pass, layout.cells);
  const diagnosis::SignatureRows rows = pass.run(diagnosis::forward_pass(data, d.calibration));
  Eigen::VectorXd explained = rows.columns.leftCols(layout.model_size.size()) * layout.model_size;
  if (without_laws != nullptr) {
    explained += rows.residual - pass.run(diagnosis::forward_pass(*without_laws, d.calibration)).residual;
  }

  Json position = Json::array(), axis = Json::array(), bin = Json::array(), middle = Json::array();
  Json bias = Json::array(), sigma = Json::array(), signature = Json::array();
  for (const Cell& cell : layout.cells) {
    const auto column = rows.columns.col(cell.column);
    const double information = column.squaredNorm();
    if (information < visible) {
      continue;
    }
    position.push_back(cell.position);
    axis.push_back(cell.axis);
    bin.push_back(cell.bin);
    middle.push_back(rounded(cell.middle_s));
    bias.push_back(rounded(cell.unit * column.dot(rows.residual) / information));
    sigma.push_back(rounded(cell.unit / std::sqrt(information)));
    signature.push_back(rounded(cell.unit * column.dot(explained) / information));
  }
  return {{"edges_s", edges_s},
          {"dwells", dwells_json(pass, rows, explained)},
          {"cells",
           {{"position", position},
            {"axis", axis},
            {"bin", bin},
            {"middle_s", middle},
            {"bias", bias},
            {"sigma", sigma},
            {"signature", signature}}}};
}

}  // namespace selfcal::report
