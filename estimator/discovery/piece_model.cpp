#include "estimator/discovery/piece_model.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

namespace selfcal::discovery {
namespace {

// Of a column's information this much must be left after projection: the rest of a function that lies in the span of the
// chosen ones is rounding and the error of the pieces.
constexpr double least_left = 1e-4;
constexpr double rounding = 1e-9;

}  // namespace

double cost_of_phase(double gain) { return 0.5 * std::log(2.0 * std::numbers::pi * std::max(1.0, gain)); }

PieceInformation::PieceInformation(Eigen::MatrixXd information, const Dictionary& dictionary)
    : all(std::move(information)) {
  for (int axis = 0; axis < axis_count; ++axis) {
    of_axis(axis, dictionary);
  }
}

// f'G f as the square of a root of G times f: half of the products, and in single precision still right to 1e-3 where a function has 1e-8
// of the information of the largest.
void PieceInformation::of_axis(int axis, const Dictionary& dictionary) {
  const auto rows = Eigen::seqN(axis, all.rows() / axis_count, axis_count);
  const Eigen::MatrixXd& D = dictionary.means;
  const auto f = static_cast<std::size_t>(axis);
  own[f] = all(rows, rows);
  const Eigen::LDLT<Eigen::MatrixXd> root(own[f]);
  const Eigen::VectorXd size = root.vectorD().cwiseMax(0.0).cwiseSqrt();
  const Eigen::MatrixXd upper = root.matrixU();
  const Eigen::MatrixXf triangle = (size.asDiagonal() * upper).cast<float>();
  function[f].resize(D.cols());
  partner[f] = Eigen::VectorXd::Zero(D.cols());
  Eigen::Index count = 0;
  for (Eigen::Index first = 0; first < D.cols(); first += count) {
    constexpr Eigen::Index most = 1024;  // that the image stays small
    count = std::min(most, D.cols() - first);
    const auto partner_of = [&](Eigen::Index k) { return dictionary.functions[static_cast<std::size_t>(k)].partner; };
    count += partner_of(first + count - 1) == first + count ? 1 : 0;  // a wave's partner follows it
    Eigen::MatrixXf image = D.middleCols(first, count).cast<float>();
    image = root.transpositionsP() * image;
    image = triangle.triangularView<Eigen::Upper>() * image;
    function[f].segment(first, count) = image.colwise().squaredNorm().transpose().cast<double>();
    for (Eigen::Index k = 0; k < count; ++k) {
      const int p = partner_of(first + k);
      if (p >= 0) {
        partner[f](first + k) = static_cast<double>(image.col(k).dot(image.col(p - first)));
      }
    }
  }
}

std::shared_ptr<PieceInformation> PieceInformation::less(const Eigen::MatrixXd& W, const Dictionary& dictionary) const {
  auto lower = std::make_shared<PieceInformation>(*this);
  lower->all.selfadjointView<Eigen::Lower>().rankUpdate(W, -1.0);
  lower->all.triangularView<Eigen::StrictlyUpper>() = lower->all.transpose();
  const Eigen::Index pieces = all.rows() / axis_count;
  for (int axis = 0; axis < axis_count; ++axis) {
    if (W.cols() >= pieces / 2) {
      lower->of_axis(axis, dictionary);
      continue;
    }
    const auto rows = Eigen::seqN(axis, pieces, axis_count);
    const auto f = static_cast<std::size_t>(axis);
    lower->own[f] = lower->all(rows, rows);
    const Eigen::MatrixXd of_own = W(rows, Eigen::all);
    const Eigen::MatrixXd taken = of_own.transpose() * dictionary.means;
    lower->function[f] -= taken.colwise().squaredNorm().transpose();
    for (Eigen::Index k = 0; k < taken.cols(); ++k) {
      const int p = dictionary.functions[static_cast<std::size_t>(k)].partner;
      lower->partner[f](k) -= p >= 0 ? taken.col(k).dot(taken.col(p)) : 0.0;
    }
  }
  return lower;
}

PieceProjection::PieceProjection(std::shared_ptr<const PieceInformation> information, Eigen::MatrixXd columns,
                                 const Dictionary& dictionary)
    : of(std::move(information)), X(std::move(columns)) {
  const Eigen::MatrixXd image = of->all * X;
  Eigen::MatrixXd A = X.transpose() * image;
  A.diagonal() *= 1.0 + rounding;
  root.compute(A);
  W = root.matrixL().solve(image.transpose()).transpose();
  auto lower = of->less(W, dictionary);
  lower->whole = of;
  left = std::move(lower);
}

PieceModel::PieceModel(const PieceSums& sums, const Dictionary& dictionary)
    : PieceModel(sums, dictionary, std::make_shared<const PieceInformation>(sums.sums.information, dictionary)) {}

PieceModel::PieceModel(const PieceSums& sums, const Dictionary& dictionary,
                       std::shared_ptr<const PieceInformation> information)
    : sums_(sums),
      dictionary_(dictionary),
      information_(std::move(information)),
      score_(sums.sums.score),
      square_(sums.sums.square),
      raw_square_(sums.sums.square) {
  score_functions();
}

void PieceModel::score_functions() {
  for (int axis = 0; axis < axis_count; ++axis) {
    function_score_[static_cast<std::size_t>(axis)] = dictionary_.means.transpose() * own_score(axis);
  }
}

Eigen::VectorXd PieceModel::column(int axis, const Eigen::Ref<const Eigen::VectorXd>& means) const {
  Eigen::VectorXd all = Eigen::VectorXd::Zero(score_.size());
  all(Eigen::seqN(axis, means.size(), axis_count)) = means;
  return all;
}

void PieceModel::choose(const std::vector<Eigen::VectorXd>& columns) {
  chosen_.resize(score_.size(), static_cast<Eigen::Index>(columns.size()));
  for (std::size_t k = 0; k < columns.size(); ++k) {
    chosen_.col(static_cast<Eigen::Index>(k)) = columns[k];
  }
  Eigen::MatrixXd image = information_->all * chosen_;
  Eigen::MatrixXd A = chosen_.transpose() * image;
  take_off(std::move(image), std::move(A), chosen_.transpose() * score_);
}

void PieceModel::choose(Eigen::MatrixXd with_pieces, Eigen::MatrixXd information, Eigen::VectorXd score) {
  chosen_.resize(score_.size(), 0);
  take_off(std::move(with_pieces), std::move(information), std::move(score));
}

void PieceModel::take_off(Eigen::MatrixXd image, Eigen::MatrixXd A, Eigen::VectorXd score) {
  chosen_image_ = std::move(image);
  chosen_score_ = std::move(score);
  chosen_information_ = std::move(A);
  Eigen::MatrixXd solved = chosen_information_;
  solved.diagonal() *= 1.0 + rounding;
  chosen_solver_.compute(solved);
  square_ = raw_square_;
  if (chosen_score_.size() > 0) {
    square_ -= chosen_score_.dot(chosen_solver_.solve(chosen_score_));
  }
}

void PieceModel::look_at(Eigen::VectorXd score, double square) {
  score_ = std::move(score);
  raw_square_ = square;
  score_functions();
  choose({});
}

PieceModel PieceModel::beside(const PieceProjection& columns) const {
  PieceModel model = *this;
  const Eigen::VectorXd b = columns.root.matrixL().solve(columns.X.transpose() * score_);
  model.information_ = columns.left;
  model.score_ -= columns.W * b;
  model.raw_square_ -= b.squaredNorm();
  model.score_functions();
  const Eigen::MatrixXd c = columns.root.matrixL().solve(columns.X.transpose() * chosen_image_);
  Eigen::MatrixXd A = chosen_information_ - c.transpose() * c;
  A.diagonal() += rounding * chosen_information_.diagonal();
  model.take_off(chosen_image_ - columns.W * c, std::move(A), chosen_score_ - c.transpose() * b);
  return model;
}

void PieceModel::integrate_out(const Eigen::MatrixXd& X, double q) {
  const Eigen::MatrixXd image = information_->all * X;
  Eigen::MatrixXd A = X.transpose() * image;
  A.diagonal().array() += 1.0 / q;
  const Eigen::LLT<Eigen::MatrixXd> root(A);
  const Eigen::MatrixXd W = root.matrixL().solve(image.transpose()).transpose();
  const Eigen::VectorXd b = root.matrixL().solve(X.transpose() * score_);
  information_ = information_->less(W, dictionary_);
  score_ -= W * b;
  raw_square_ -= b.squaredNorm();
  score_functions();
  std::vector<Eigen::VectorXd> again;
  for (Eigen::Index k = 0; k < chosen_.cols(); ++k) {
    again.emplace_back(chosen_.col(k));
  }
  choose(again);
}

void PieceModel::project_out_chosen(const Eigen::MatrixXd& cross, Eigen::MatrixXd& G, Eigen::VectorXd& b) const {
  if (cross.rows() > 0) {
    G -= cross.transpose() * chosen_solver_.solve(cross);
    b -= cross.transpose() * chosen_solver_.solve(chosen_score_);
  }
}

std::pair<Eigen::MatrixXd, Eigen::VectorXd> PieceModel::project(int axis, const Eigen::MatrixXd& means) const {
  Eigen::MatrixXd G = means.transpose() * (information_->own[static_cast<std::size_t>(axis)] * means);
  Eigen::VectorXd b = means.transpose() * own_score(axis);
  project_out_chosen(own_image(axis).transpose() * means, G, b);
  return {G, b};
}

std::pair<Eigen::MatrixXd, Eigen::VectorXd> PieceModel::project(
    const std::array<Eigen::MatrixXd, axis_count>& means) const {
  const Eigen::Index pieces = sums_.piece_dt.size();
  Eigen::Index count = 0;
  std::array<Eigen::Index, axis_count> first{};
  for (std::size_t axis = 0; axis < axis_count; ++axis) {
    first[axis] = count;
    count += means[axis].cols();
  }
  Eigen::MatrixXd G(count, count), cross(chosen_image_.cols(), count);
  Eigen::VectorXd b(count);
  for (std::size_t i = 0; i < axis_count; ++i) {
    const auto rows = Eigen::seqN(static_cast<Eigen::Index>(i), pieces, axis_count);
    for (std::size_t j = i; j < axis_count; ++j) {
      const Eigen::MatrixXd block =
          information_->all(rows, Eigen::seqN(static_cast<Eigen::Index>(j), pieces, axis_count));
      const Eigen::MatrixXd of_both = means[i].transpose() * (block * means[j]);
      G.block(first[i], first[j], of_both.rows(), of_both.cols()) = of_both;
      G.block(first[j], first[i], of_both.cols(), of_both.rows()) = of_both.transpose();
    }
    b.segment(first[i], means[i].cols()) = means[i].transpose() * own_score(static_cast<int>(i));
    cross.middleCols(first[i], means[i].cols()) = own_image(static_cast<int>(i)).transpose() * means[i];
  }
  project_out_chosen(cross, G, b);
  return {G, b};
}

double PieceModel::gain(int axis, const Eigen::MatrixXd& means) const {
  const auto [G, b] = project(axis, means);
  for (Eigen::Index k = 0; k < b.size(); ++k) {
    const auto column = means.col(k);
    const double before = column.dot(whole().own[static_cast<std::size_t>(axis)] * column);
    if (G(k, k) < least_left * before || G(k, k) <= 0.0) {
      return 0.0;
    }
  }
  const double gained = b.dot(G.ldlt().solve(b));
  return std::isfinite(gained) && gained > 0.0 ? gained : 0.0;
}

std::vector<Ranked> PieceModel::rank(std::size_t most) const {
  std::vector<Ranked> all;
  const Eigen::MatrixXd& D = dictionary_.means;
  for (int axis = 0; axis < axis_count; ++axis) {
    const auto f = static_cast<std::size_t>(axis);
    Eigen::VectorXd information = information_->function[f], score = function_score_[f],
                    partner = information_->partner[f];
    if (chosen_image_.cols() > 0) {
      const Eigen::MatrixXd cross = own_image(axis).transpose() * D;
      const Eigen::MatrixXd solved = chosen_solver_.solve(cross);
      information -= (cross.array() * solved.array()).colwise().sum().matrix().transpose();
      score -= solved.transpose() * chosen_score_;
      for (Eigen::Index k = 0; k < D.cols(); ++k) {
        const int p = dictionary_.functions[static_cast<std::size_t>(k)].partner;
        partner(k) -= p >= 0 ? cross.col(k).dot(solved.col(p)) : 0.0;
      }
    }
    const auto seen = [&](Eigen::Index k) { return information(k) > least_left * whole().function[f](k); };
    for (Eigen::Index k = 0; k < D.cols(); ++k) {
      const Function& function = dictionary_.functions[static_cast<std::size_t>(k)];
      if (function.second || !seen(k)) {
        continue;
      }
      Ranked r{axis, static_cast<int>(k), score(k) * score(k) / information(k), 0.0};
      if (function.partner >= 0 && seen(function.partner)) {
        const double a = information(k), c = information(function.partner), x = partner(k);
        const double determinant = a * c - x * x;
        if (determinant > least_left * a * c) {
          const double u = score(k), v = score(function.partner);
          r.gain = (c * u * u - 2.0 * x * u * v + a * v * v) / determinant;
        }
      }
      r.merit = 0.5 * r.gain - function.cost - (function.partner >= 0 ? cost_of_phase(r.gain) : 0.0);
      all.push_back(r);
    }
  }
  most = std::min(most, all.size());
  std::partial_sort(all.begin(), all.begin() + static_cast<std::ptrdiff_t>(most), all.end(),
                    [](const Ranked& a, const Ranked& b) { return a.merit > b.merit; });
  all.resize(most);
  return all;
}

}  // namespace selfcal::discovery
