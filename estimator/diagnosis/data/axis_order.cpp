#include "estimator/diagnosis/data/axis_order.hpp"

#include <algorithm>
#include <utility>

namespace selfcal::diagnosis {
namespace {

std::string signed_axis(int sign, std::size_t axis) { return std::string(sign < 0 ? "-" : "") + "xyz"[axis]; }

void append(std::string& list, const std::string& one) { list += (list.empty() ? "" : ", ") + one; }

}  // namespace

Matrix3 AxisOrder::matrix() const {
  Matrix3 m = Matrix3::Zero();
  for (std::size_t i = 0; i < 3; ++i) {
    m(static_cast<Eigen::Index>(i), of[i]) = sign[i];
  }
  return m;
}

int AxisOrder::changed() const {
  int count = 0;
  for (std::size_t i = 0; i < 3; ++i) {
    count += of[i] != static_cast<int>(i) || sign[i] < 0 ? 1 : 0;
  }
  return count;
}

std::string AxisOrder::words() const {
  std::string text;
  for (std::size_t i = 0; i < 3; ++i) {
    if (of[i] != static_cast<int>(i) || sign[i] < 0) {
      append(text, std::string(1, "xyz"[i]) + " gives " + signed_axis(sign[i], static_cast<std::size_t>(of[i])));
    }
  }
  return text;
}

std::string AxisOrder::mend() const {
  std::string text;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const auto from = std::find(of.begin(), of.end(), static_cast<int>(axis));
    const auto i = static_cast<std::size_t>(from - of.begin());
    if (ordered() && sign[i] < 0) {
      append(text, std::string(1, "xyz"[axis]));
    } else if (i != axis || sign[i] < 0) {
      append(text, std::string(1, "xyz"[axis]) + " = " + signed_axis(sign[i], i));
    }
  }
  return (ordered() ? "negate " : "take ") + text;
}

std::string AxisOrder::name() const {
  const std::pair<AxisOrder, const char*> usual[] = {
      {{{0, 2, 1}, {1, 1, -1}}, "forward-right-down"}, {{{0, 2, 1}, {1, -1, 1}}, "forward-left-up"},
      {{{2, 0, 1}, {1, 1, 1}}, "right-forward-up"},    {{{0, 1, 2}, {1, -1, -1}}, "forward-down-left"},
      {{{2, 1, 0}, {-1, 1, 1}}, "left-up-forward"},    {{{2, 1, 0}, {1, 1, -1}}, "right-up-back"}};
  for (const auto& [order, words] : usual) {
    if (order == *this) {
      return words;
    }
  }
  return {};
}

const std::vector<AxisOrder>& all_axis_orders() {
  static const std::vector<AxisOrder> all = [] {
    std::vector<AxisOrder> orders;
    AxisOrder order;
    do {
      for (int signs = 0; signs < 8; ++signs) {
        for (std::size_t i = 0; i < 3; ++i) {
          order.sign[i] = ((signs >> i) & 1) != 0 ? -1 : 1;
        }
        orders.push_back(order);
      }
    } while (std::next_permutation(order.of.begin(), order.of.end()));
    return orders;
  }();
  return all;
}

}  // namespace selfcal::diagnosis
