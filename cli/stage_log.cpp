#include "cli/stage_log.h"

#include <algorithm>
#include <utility>

#include <fmt/format.h>

namespace kinespace::cli {
namespace {

bool ran(const KernelUse& use) {
  return use.launches > 0 || use.processor_calls > 0;
}

Json kernels_json(const KernelUses& uses) {
  Json out = Json::array();
  for (std::size_t f = 0; f < uses.size(); ++f) {
    if (!ran(uses[f])) continue;
    out.push_back({{"kernel", name_of(kernel_families[f])},
                   {"launches", uses[f].launches},
                   {"processor_calls", uses[f].processor_calls}});
  }
  return out;
}

std::string kernels_text(const KernelUses& uses) {
  std::string out;
  for (std::size_t f = 0; f < uses.size(); ++f) {
    if (!ran(uses[f])) continue;
    out += fmt::format("; {}: {} launches, {} calls on the processor", name_of(kernel_families[f]), uses[f].launches,
                       uses[f].processor_calls);
  }
  return out;
}

}  // namespace

Progress StageLog::watch(Progress progress) {
  progress.report = [this, shown = std::move(progress.report)](std::string_view stage, double done) {
    begin(stage);
    if (shown) shown(stage, done);
  };
  return progress;
}

void StageLog::begin(std::string_view stage) {
  const std::scoped_lock lock(mutex_);
  if (!stages_.empty() && stages_[current_].name == stage) return;
  end();
  const auto known = std::ranges::find(stages_, stage, &Stage::name);
  current_ = static_cast<std::size_t>(known - stages_.begin());
  if (known == stages_.end()) stages_.push_back({.name = std::string(stage)});
}

void StageLog::end() {
  const auto now = std::chrono::steady_clock::now();
  const KernelUses uses = compute_.uses();
  if (!stages_.empty()) {
    Stage& stage = stages_[current_];
    const KernelUses added = since(uses_before_, uses);
    stage.seconds += std::chrono::duration<double>(now - start_).count();
    for (std::size_t f = 0; f < added.size(); ++f) {
      stage.uses[f].launches += added[f].launches;
      stage.uses[f].processor_calls += added[f].processor_calls;
    }
  }
  start_ = now;
  uses_before_ = uses;
}

void StageLog::finish(Json& object, Session& session) {
  const std::scoped_lock lock(mutex_);
  end();
  Json stages = Json::array();
  for (const Stage& stage : stages_) {
    stages.push_back({{"stage", stage.name}, {"seconds", stage.seconds}, {"kernels", kernels_json(stage.uses)}});
    session.detail(fmt::format("{}: {:.2f} s{}", stage.name, stage.seconds, kernels_text(stage.uses)));
  }
  object["device"] = compute_.describe();
  object["stages"] = std::move(stages);
}

}  // namespace kinespace::cli
