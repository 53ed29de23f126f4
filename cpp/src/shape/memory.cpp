#include "shape/memory.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstring>

#include "base/checks.hpp"
#include "base/stored_numbers.hpp"

namespace dynmesh {

// The checksum of a state detects damage but not bytes that were made up. This refuses all values
// that later frames cannot handle, wherever the bytes come from.
void check_memory(const Memory& memory, double largest) {
  check_stored_frame(memory.last, largest);
  for (const auto* frame : {&memory.tracking.before, &memory.tracking.good}) {
    check_stored_frame(*frame, largest_coordinate<double>);
  }
  for (std::size_t v = 0; v < memory.age.size(); ++v) {
    if (memory.age[v] >= 0 && memory.known[v] <= 1) continue;
    refuse_state(joined("vertex ", v, " has the age ", memory.age[v], " and the mask ",
                        memory.known[v], ", which is not possible"));
  }
  constexpr double rounding = 1e-6;
  for (const auto& [w, x, y, z] : memory.q) {
    if (std::abs(w * w + x * x + y * y + z * z - 1) <= rounding) continue;
    refuse_state("holds a rotation that is none");
  }
  const double range = detail_constants.range_of_lambda;
  if (memory.completion.lambda < detail_constants.first_lambda / range ||
      memory.completion.lambda > detail_constants.first_lambda * range) {
    refuse_state("weighs anchors as no frame can");
  }
  const auto is_size = [most = growth_constants.largest_size](double size) {
    return size >= 1 / most && size <= most;
  };
  if (!std::ranges::all_of(memory.sizes, is_size)) {
    refuse_state("holds sizes that no component can have");
  }
  for (const Gains& gains : memory.completion.gains.components) {
    const auto is_square_sum = [](double x) { return x >= 0; };
    if (gains.count >= 0 && gains.rings >= gains.count * (1 - rounding) &&
        std::ranges::all_of(gains.squares, is_square_sum)) {
      continue;
    }
    refuse_state("holds tests that no frame can have made");
  }
  const FirstFrameCheck& check = memory.completion.first_frame;
  const StepCheck& step = memory.completion.step;
  if (check.n_judged < 0 || memory.completion.n_ruined < 0 || check.sum_of_steps < 0 ||
      check.result > FirstFrameCheck::is_reordered || step.change < 0 || step.scatter < 0 ||
      step.turned < 0 || step.n_changes < 0 || step.n_turns < 0 ||
      step.result > StepCheck::is_mirrored) {
    refuse_state("holds a verdict that no frames can have left");
  }
  // A frame that is not ruined leaves no other one.
  const auto& ruined = memory.completion.ruined;
  if (!ruined.empty()) check_stored_frame(ruined, largest);
  const bool is_last = ruined.empty() || std::memcmp(ruined.data(), memory.last.data(),
                                                     ruined.size() * sizeof(Vector3)) == 0;
  if (memory.completion.n_ruined == 0 && !is_last) {
    refuse_state("holds a ruined frame that no frames can have left");
  }
  const ErrorMemory& errors = memory.errors;
  const auto is_error = [](double x) { return x >= 0; };
  const auto are_energies = [](const Energy& e) { return e.x >= 0 && e.y >= 0; };
  if (!std::ranges::all_of(errors.standard_errors, is_error) || !are_energies(errors.energy) ||
      !are_energies(errors.of_noise) || !are_energies(errors.turns_of_all) ||
      !are_energies(errors.of_shape) ||
      !std::ranges::all_of(errors.turns, are_energies, &TurnMemory::found)) {
    refuse_state("holds standard errors that are none");
  }
  const auto is_square = [](double x) { return x >= 0; };
  if (!std::ranges::all_of(memory.departures, is_square) ||
      !std::ranges::all_of(memory.tracking.coarse_departures, is_square)) {
    refuse_state("holds negative squares");
  }
  if (!(memory.tracking.times_weight > 0 && memory.tracking.times_weight <= 1)) {
    refuse_state("has no weight of points");
  }
  if (!(memory.tracking.noise >= 0)) refuse_state("holds a noise of points that is none");
  const double share = memory.tracking.correction_share;
  if (!(share >= 0 && share < 1)) {
    refuse_state("holds a share of the last correction that is not from 0 to 1");
  }
  const auto is_mask = [](std::uint8_t value) { return value <= 1; };
  if (!std::ranges::all_of(memory.tracking.colours.is_known, is_mask)) {
    refuse_state("does not tell which colours are known");
  }
  if (memory.tracking.is_start > 1) refuse_state("does not tell whether a frame was good");
  if (memory.tracking.good_in_a_row < 0 || !(memory.tracking.recent.growth > 0)) {
    refuse_state("holds recent frames that no tracker can have left");
  }
  const auto is_share = [](double x) { return x >= 0 && x <= 1; };
  const auto is_plausible = [](double a) {
    return std::abs(a) <= training_constants.largest_coefficient;
  };
  for (const FitMemory& fit : {memory.fit, memory.tracking.coarse_fit}) {
    if (is_share(fit.prior_weight) && is_share(fit.prior_share) &&
        std::ranges::all_of(fit.coefficients, is_plausible)) {
      continue;
    }
    refuse_state("holds a pose far out of any range");
  }
}

}  // namespace dynmesh
