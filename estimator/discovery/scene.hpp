// A recording with what laws are evaluated and fitted on.
#pragma once

#include <memory>
#include <span>
#include <vector>

#include "estimator/diagnosis/regression/recording_context.hpp"
#include "estimator/diagnosis/still_calibration.hpp"
#include "estimator/discovery/discovery.hpp"
#include "estimator/discovery/law_fit.hpp"

namespace selfcal::discovery {

// Stays where it is, for its parts point to each other. Whoever fits laws on it fills the table first.
struct Scene {
  explicit Scene(const UnitRecording& recording)
      : context(recording.data),
        motion(context),
        input(diagnosis::forward_pass(recording.data, recording.calibration)),
        trace(trace_pass(input)),
        beside(recording.beside) {}
  Scene(const Scene&) = delete;
  Scene& operator=(const Scene&) = delete;

  diagnosis::RecordingContext context;
  LawMotion motion;
  PassInput input;
  PassTrace trace;
  std::span<const EffectTerm> beside;
  NodeTable table;
};

inline std::vector<std::unique_ptr<Scene>> scenes_of(std::span<const UnitRecording> recordings) {
  std::vector<std::unique_ptr<Scene>> scenes;
  for (const UnitRecording& recording : recordings) {
    scenes.push_back(std::make_unique<Scene>(recording));
  }
  return scenes;
}

// For fits of laws.
inline std::vector<std::unique_ptr<Scene>> scenes_with_tables(std::span<const UnitRecording> recordings) {
  std::vector<std::unique_ptr<Scene>> scenes = scenes_of(recordings);
  for (const auto& scene : scenes) {
    scene->table = collect_nodes(scene->motion, scene->input);
  }
  return scenes;
}

inline std::vector<LawRecording> laws_on(const std::vector<std::unique_ptr<Scene>>& scenes) {
  std::vector<LawRecording> all;
  all.reserve(scenes.size());
  for (const auto& scene : scenes) {
    all.push_back({scene->motion, scene->table, scene->input, scene->trace, scene->beside});
  }
  return all;
}

}  // namespace selfcal::discovery
