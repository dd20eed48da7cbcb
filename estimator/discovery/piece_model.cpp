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

// Products with all functions of a dictionary are made of so many at a time, so that they stay in the cache. A wave's partner follows it and
// is of its block.
struct Block {
  Eigen::Index first, count;
};

int partner_of(const Dictionary& dictionary, Eigen::Index k) {
  return dictionary.functions[static_cast<std::size_t>(k)].partner;
}

std::vector<Block> blocks_of(const Dictionary& dictionary) {
  constexpr Eigen::Index most = 1024;
  std::vector<Block> all;
  for (Eigen::Index first = 0; first < dictionary.means.cols(); first += all.back().count) {
    const Eigen::Index count = std::min(most, dictionary.means.cols() - first);
    const bool parts = partner_of(dictionary, first + count - 1) == first + count;
    all.push_back({first, count + (parts ? 1 : 0)});
  }
  return all;
}

// Columns over pieces and axes, [pieces x columns] of each axis beside those of the one before.
Eigen::MatrixXf axis_by_axis(const Eigen::MatrixXd& columns) {
  const Eigen::Index pieces = columns.rows() / axis_count;
  Eigen::MatrixXf all(pieces, axis_count * columns.cols());
  for (int axis = 0; axis < axis_count; ++axis) {
    all.middleCols(axis * columns.cols(), columns.cols()) =
        columns(Eigen::seqN(axis, pieces, axis_count), Eigen::all).cast<float>();
  }
  return all;
}

// Dot products of a block's columns, one of each function, with those of their partners; 0 where there is none.
Eigen::VectorXd beside_partner(const Dictionary& dictionary, const Block& block, const Eigen::MatrixXf& image) {
  Eigen::VectorXd products = Eigen::VectorXd::Zero(block.count);
  for (Eigen::Index k = 0; k < block.count; ++k) {
    const int p = partner_of(dictionary, block.first + k);
    if (p >= 0) {
      products(k) = static_cast<double>(image.col(k).dot(image.col(p - block.first)));
    }
  }
  return products;
}

}  // namespace

double cost_of_phase(double gain) { return 0.5 * std::log(2.0 * std::numbers::pi * std::max(1.0, gain)); }

PieceInformation::PieceInformation(Eigen::MatrixXd information, const Dictionary& dictionary)
    : all(std::move(information)) {
  for (int axis = 0; axis < axis_count; ++axis) {
    of_axis(axis, dictionary);
  }
}

// f'G f as the square of a root of G times f: in single precision still right to 1e-3 where a function has 1e-8 of the information of the
// largest.
void PieceInformation::of_axis(int axis, const Dictionary& dictionary) {
  const auto rows = Eigen::seqN(axis, all.rows() / axis_count, axis_count);
  const auto f = static_cast<std::size_t>(axis);
  own[f] = all(rows, rows);
  const Eigen::LDLT<Eigen::MatrixXd> root(own[f]);
  const Eigen::VectorXd size = root.vectorD().cwiseMax(0.0).cwiseSqrt();
  const Eigen::MatrixXd upper = root.matrixU();
  const Eigen::MatrixXf triangle = (size.asDiagonal() * upper).cast<float>();
  function[f].resize(dictionary.means.cols());
  partner[f] = Eigen::VectorXd::Zero(dictionary.means.cols());
  for (const Block& block : blocks_of(dictionary)) {
    Eigen::MatrixXf image = root.transpositionsP() * dictionary.means.middleCols(block.first, block.count);
    image = triangle.triangularView<Eigen::Upper>() * image;
    function[f].segment(block.first, block.count) = image.colwise().squaredNorm().transpose().cast<double>();
    partner[f].segment(block.first, block.count) = beside_partner(dictionary, block, image);
  }
}

std::shared_ptr<PieceInformation> PieceInformation::less(const Eigen::MatrixXd& W, const Dictionary& dictionary) const {
  auto lower = std::make_shared<PieceInformation>(*this);
  lower->all.selfadjointView<Eigen::Lower>().rankUpdate(W, -1.0);
  lower->all.triangularView<Eigen::StrictlyUpper>() = lower->all.transpose();
  const Eigen::Index pieces = all.rows() / axis_count;
  if (W.cols() >= pieces / 2) {
    for (int axis = 0; axis < axis_count; ++axis) {
      lower->of_axis(axis, dictionary);
    }
    return lower;
  }
  for (int axis = 0; axis < axis_count; ++axis) {
    const auto rows = Eigen::seqN(axis, pieces, axis_count);
    lower->own[static_cast<std::size_t>(axis)] = lower->all(rows, rows);
  }
  const Eigen::MatrixXf all_axes = axis_by_axis(W);
  for (const Block& block : blocks_of(dictionary)) {
    const Eigen::MatrixXf taken = all_axes.transpose() * dictionary.means.middleCols(block.first, block.count);
    for (std::size_t f = 0; f < axis_count; ++f) {
      const Eigen::MatrixXf of_axis = taken.middleRows(static_cast<Eigen::Index>(f) * W.cols(), W.cols());
      lower->function[f].segment(block.first, block.count) -=
          of_axis.colwise().squaredNorm().transpose().cast<double>();
      lower->partner[f].segment(block.first, block.count) -= beside_partner(dictionary, block, of_axis);
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
  choose({});
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
  square_ = raw_square_;
  if (chosen_score_.size() > 0) {
    Eigen::MatrixXd solved = chosen_information_;
    solved.diagonal() *= 1.0 + rounding;
    chosen_solver_.compute(solved);
    square_ -= chosen_score_.dot(chosen_solver_.solve(chosen_score_));
  }
}

void PieceModel::look_at(Eigen::VectorXd score, double square) {
  score_ = std::move(score);
  raw_square_ = square;
  choose({});
}

PieceModel PieceModel::beside(const PieceProjection& columns) const {
  PieceModel model = *this;
  const Eigen::VectorXd b = columns.root.matrixL().solve(columns.X.transpose() * score_);
  model.information_ = columns.left;
  model.score_ -= columns.W * b;
  model.raw_square_ -= b.squaredNorm();
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

Eigen::MatrixXd PieceModel::chosen_root() const {
  const Eigen::VectorXd size = chosen_solver_.vectorD().cwiseMax(0.0).cwiseSqrt();
  const Eigen::MatrixXd image = chosen_solver_.transpositionsP() * Eigen::MatrixXd(chosen_image_.transpose());
  const Eigen::MatrixXd root = chosen_solver_.matrixL().solve(image);
  return ((size.array() > 0.0).select(size.cwiseInverse(), 0.0).asDiagonal() * root).transpose();
}

std::vector<Ranked> PieceModel::rank(std::size_t most) const {
  std::vector<Ranked> all;
  const Eigen::Index chosen = chosen_image_.cols();
  // The chosen ones are taken off in double precision; what is single is the product of a function with what is left.
  Eigen::MatrixXd columns(score_.size(), chosen + 1);
  columns.col(chosen) = score_;
  if (chosen > 0) {
    columns.leftCols(chosen) = chosen_root();
    columns.col(chosen) -= chosen_image_ * chosen_solver_.solve(chosen_score_);
  }
  const Eigen::MatrixXf all_axes = axis_by_axis(columns);
  for (const Block& block : blocks_of(dictionary_)) {
    const Eigen::MatrixXf products = all_axes.transpose() * dictionary_.means.middleCols(block.first, block.count);
    for (int axis = 0; axis < axis_count; ++axis) {
      const Eigen::MatrixXf taken = products.middleRows(axis * (chosen + 1), chosen);
      const auto f = static_cast<std::size_t>(axis);
      const BlockSums sums{
          products.row(axis * (chosen + 1) + chosen).transpose().cast<double>(),
          information_->function[f].segment(block.first, block.count) -
              taken.colwise().squaredNorm().transpose().cast<double>(),
          information_->partner[f].segment(block.first, block.count) - beside_partner(dictionary_, block, taken)};
      rank_block(axis, block.first, sums, all);
    }
  }
  most = std::min(most, all.size());
  std::partial_sort(all.begin(), all.begin() + static_cast<std::ptrdiff_t>(most), all.end(),
                    [](const Ranked& a, const Ranked& b) { return a.merit > b.merit; });
  all.resize(most);
  return all;
}

void PieceModel::rank_block(int axis, Eigen::Index first, const BlockSums& sums, std::vector<Ranked>& all) const {
  const Eigen::VectorXd& before = whole().function[static_cast<std::size_t>(axis)];
  const auto seen = [&](Eigen::Index k) { return sums.information(k) > least_left * before(first + k); };
  for (Eigen::Index k = 0; k < sums.score.size(); ++k) {
    const Function& function = dictionary_.functions[static_cast<std::size_t>(first + k)];
    if (function.second || !seen(k)) {
      continue;
    }
    Ranked r{axis, static_cast<int>(first + k), sums.score(k) * sums.score(k) / sums.information(k), 0.0};
    const Eigen::Index other = function.partner - first;
    if (function.partner >= 0 && seen(other)) {
      const double a = sums.information(k), c = sums.information(other), x = sums.partner(k);
      const double determinant = a * c - x * x;
      if (determinant > least_left * a * c) {
        const double u = sums.score(k), v = sums.score(other);
        r.gain = (c * u * u - 2.0 * x * u * v + a * v * v) / determinant;
      }
    }
    r.merit = 0.5 * r.gain - function.cost - (function.partner >= 0 ? cost_of_phase(r.gain) : 0.0);
    all.push_back(r);
  }
}

}  // namespace selfcal::discovery
