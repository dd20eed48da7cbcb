#include "estimator/discovery/piece_residual.hpp"

#include <algorithm>
#include <utility>

namespace selfcal::discovery {
namespace {

bool same(const LawTerm& a, const LawTerm& b) { return same_law(a, b) && a.constants == b.constants; }

void say(const Progress& progress, const char* words) {
  if (progress) {
    progress(words);
  }
}

}  // namespace

PieceResidual::PieceResidual(const Scenes& scenes, std::stop_token stop, const Progress& progress)
    : scenes_(scenes), stop_(std::move(stop)) {
  say(progress, "pieces of the recording");
  sums_ = sum_whole();
  say(progress, "functions");
  dictionary_ = make_dictionary(sums_, available());
  information_ = std::make_shared<const PieceInformation>(sums_.sums.information, dictionary_);
  renew();
}

laws::VariableSet PieceResidual::available() const {
  laws::VariableSet available = scenes_.front()->motion.available();
  for (const auto& scene : scenes_) {
    available &= scene->motion.available();
  }
  return available;
}

void PieceResidual::renew() { model_ = std::make_unique<PieceModel>(sums_, dictionary_, information_); }

PieceSums PieceResidual::sum_whole() {
  std::vector<PieceSums> all;
  for (const auto& scene : scenes_) {
    all.push_back(sum_over_pieces(scene->motion, scene->input, scene->trace, scene->beside, stop_,
                                  pieces_of_each(scenes_.size())));
    scene->table = all.back();
  }
  return join(std::move(all));
}

PieceSums PieceResidual::sum_without(const LawFit& fit) const {
  std::vector<PieceSums> all;
  for (std::size_t r = 0; r < scenes_.size(); ++r) {
    const auto& scene = scenes_[r];
    const diagnosis::CorrectedRecording rest =
        without_laws(scene->motion, scene->table, scene->input, fit.terms, fit.coefficient);
    PassInput input = scene->input;
    input.data = &rest.data();
    // Of a law that moves a scale factor by hundreds of ppm the second order would be left, which a process could take up.
    input.parameters = fit.recordings[r].parameters;
    all.push_back(sum_over_pieces(scene->motion, input, trace_pass(input, stop_), scene->beside, stop_,
                                  pieces_of_each(scenes_.size())));
  }
  return join(std::move(all));
}

void PieceResidual::take_out(const LawFit& fit) {
  const bool out_already = whole_model_ && coefficient_ == fit.coefficient &&
                           std::equal(out_.begin(), out_.end(), fit.terms.begin(), fit.terms.end(), same);
  if (!out_already) {
    const PieceSums left = sum_without(fit);
    if (!whole_model_) {
      whole_score_ = sums_.sums.score;
      whole_square_ = sums_.sums.square;
      whole_model_ = std::move(model_);
    }
    sums_.sums.score = left.sums.score;
    sums_.sums.square = left.sums.square;
    out_ = fit.terms;
    coefficient_ = fit.coefficient;
  }
  renew();
}

void PieceResidual::put_back() {
  if (whole_model_) {
    sums_.sums.score = whole_score_;
    sums_.sums.square = whole_square_;
    whole_model_.reset();
  }
  renew();
}

}  // namespace selfcal::discovery
