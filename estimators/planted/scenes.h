#pragma once

#include "media/base/types.h"

namespace nullmark {

/// A scene on which a planted bug shows, as text for a configuration's matrix.
struct PlantedScene {
  const char* name;
  const char* estimator;  ///< JSON
  const char* medium;
  const char* majorant;
  const char* rays;
  Real relative_bias;  ///< (mean - T)/T of output 0, averaged over the rays; 0 where the bug leaves the mean alone
  Real fresh = 1;      ///< share of 300000 samples a ray that do not repeat the random numbers of another
  const char* quantity = "transmittance";
  int samples_per_ray = 4096;  ///< at which the check that is named must catch it, or more where the plan allows
};

inline constexpr const char* kThroughTheBox = R"({"type":"single"})";
inline constexpr const char* kSixteenPixels = R"({"type":"orthographic","width":16,"height":1})";
inline constexpr const char* kBound = R"("global")";
inline constexpr const char* kTwice = R"({"type":"global","looseness":2})";
inline constexpr const char* kFiveTimes = R"({"type":"global","looseness":5})";
inline constexpr const char* kTooLow = R"({"type":"global","looseness":0.9})";
inline constexpr const char* kFourCells = R"({"type":"grid","resolution":4,"resolution_y":1,"resolution_z":1})";
inline constexpr const char* kConstant = R"({"type":"homogeneous","extinction":1})";
inline constexpr const char* kRising = R"({"type":"linear","begin":0.5,"end":1.5})";
inline constexpr const char* kFalling = R"({"type":"exponential","amplitude":3,"rate":-3})";
inline constexpr const char* kThreeChannels = R"({"type":"homogeneous","extinction":0.5,"spectrum":[1,2,4]})";
/// Constant along each ray of kSixteenPixels, one period over the image, the same at both its ends.
inline constexpr const char* kStripes = R"({"type":"cosine","frequency":6.283185307179586,"phase":0})";

/// Every planted bug once.  Biases are closed forms, or sums and integral equations solved to the digits given.
inline constexpr PlantedScene kPlantedScenes[] = {
    // e^{.01 tau} - 1, tau = 2
    {"planted_flight_rate", R"("planted_flight_rate")", R"({"type":"homogeneous","extinction":2})", kFiveTimes, kThroughTheBox,
     0.0202013},
    // e^{11/32} - 1
    {"planted_last_segment", R"("planted_last_segment")", kRising, kFourCells, kThroughTheBox, 0.410226},
    // e^{5/32} - 1
    {"planted_first_segment", R"("planted_first_segment")", kRising, kFourCells, kThroughTheBox, 0.169118},
    // mub = mu, so T is the chance of no collision: e^{-1/4 - 2/4 - 3/4 - 1} in place of e^{-1}
    {"planted_no_rewind", R"("planted_no_rewind")", kConstant, kFourCells, kThroughTheBox, -0.776870},
    // E_i = e^{-(1 - i/4)} + (e^{-1/4} - e^{-(1 - i/4)}) E_{i+1} from cell i on; E_0/T - 1
    {"planted_early_surface", R"("planted_early_surface")", kConstant, kFourCells, kThroughTheBox, 0.781164},
    // W(x) = e^{-b(x)(1-x)} + int_x^1 b(x) e^{-b(x)(y-x)} (1 - mu(y)/b(y)) W(y) dy, b the bound of the cell
    {"planted_carried_distance", R"("planted_carried_distance")", kRising, kFourCells, kThroughTheBox, 0.392205},
    // 1 - e^{-1}: the first collision never counts
    {"planted_previous_extinction", R"("planted_previous_extinction")", kConstant, kTwice, kThroughTheBox, 0.632121},
    // W(x) = e^{-(1-x)} + (1 - mu(x)) int_x^1 e^{-(y-x)} W(y) dy
    {"planted_path_start", R"("planted_path_start")", R"({"type":"linear","begin":0,"end":1})", kBound, kThroughTheBox, 0.462155},
    // sum_k Poisson(4; k) 2^{-max(0, k - 6)} - 1: 0.8^7 is the first weight below 1/4
    {"planted_roulette", R"("planted_roulette")", kConstant, kFiveTimes, kThroughTheBox, -0.0714046},
    // e^{.1} cosh(.1) - 1: even powers of 1 - 1/.9 survive
    {"planted_clamped_ratio", R"("planted_clamped_ratio")", kConstant, kTooLow, kThroughTheBox, 0.110701},
    // factors uniform in [0,2], Poisson(.2) of them, T_c = e^{-.2}
    {"planted_clamped_residual", R"({"type":"planted_clamped_residual","control":"average"})",
     R"({"type":"linear","begin":0,"end":0.4})", kBound, kThroughTheBox, -0.0298218},
    // e^{.1} - 1
    {"planted_capped_extinction", R"("planted_capped_extinction")", kConstant, kTooLow, kThroughTheBox, 0.105171},
    {"planted_zero", R"("planted_zero")", kConstant, kFiveTimes, kThroughTheBox, -1},
    {"planted_reference", R"("planted_reference")", kConstant, kFiveTimes, kThroughTheBox, 0},
    {"planted_nan", R"({"type":"planted_nan","chance":1e-4})", kConstant, kFiveTimes, kThroughTheBox, 0},
    {"planted_coin", R"("planted_coin")", kConstant, kFiveTimes, kThroughTheBox, 0},
    {"planted_second_lookup", R"("planted_second_lookup")", kConstant, kFiveTimes, kThroughTheBox, 0},
    // 2 e^{-1}/(1 - e^{-2}) - 1: each turn escapes with e^{-2} or is killed with (1 - 3 e^{-2})/2
    {"planted_decomposition_reset", R"("planted_decomposition_reset")", R"({"type":"linear","begin":0.5,"end":2.5})", kBound,
     kThroughTheBox, -0.149082},
    // e^{1/2} - 1: the residual is 0 where paths begin
    {"planted_decomposition_start", R"("planted_decomposition_start")", kRising, kBound, kThroughTheBox, 0.648721},
    // cosh(1/2) - 1: after a first residual collision at x the rest of the walk is killed at rate 1/2 + x
    {"planted_stale_residual", R"("planted_stale_residual")", kRising, kBound, kThroughTheBox, 0.127626},
    // e^{-1/6} - 1: a factor 2/3 at each null collision
    {"planted_decomposition_marginal", R"("planted_decomposition_marginal")", kRising, kBound, kThroughTheBox, -0.153518},
    // e^{-3/2} - 1: every other collision kills all channels
    {"planted_spectral_sum", R"("planted_spectral_sum")", kThreeChannels, kTwice, kThroughTheBox, -0.776870},
    // sinh(1/2)/(1/2) - 1: two steps, whose common offset shifts the depth by up to 1/2
    {"planted_shared_offset", R"("planted_shared_offset")", R"({"type":"linear","begin":0.5,"end":2.5})",
     R"({"type":"global","looseness":0.05})", kThroughTheBox, 0.042191},
    // .35 (E e^{-mu}/T - 1): .65 of each difference is told
    {"planted_unweighted_level", R"("planted_unweighted_level")", R"({"type":"linear","begin":0.5,"end":2.5})", kBound,
     kThroughTheBox, 0.0613204},
    // e^{-1}: W(r) = e^{-r/2} (1 + r/2) from a collision on, r the depth left
    {"planted_guided_escape", R"("planted_guided_escape")", kConstant, kTwice, kThroughTheBox, 0.367879},
    // avg_h e^{4 (a_h a_0/avg a - 1)} e^{1/2} - 1, a = (7/8, 3/4, 1/2)
    {"planted_hero_history", R"("planted_hero_history")", kThreeChannels, kTwice, kThroughTheBox, 0.288118},
    // e^{1/5} - 1
    {"planted_weight_sign", R"("planted_weight_sign")", kConstant, kTooLow, kThroughTheBox, 0.221403},
    // W(x) = e^{-5(1-x)} + .9 int_0^{-log .8} 5 e^{-s} W(x + s) ds
    {"planted_step_parenthesis", R"("planted_step_parenthesis")", R"({"type":"homogeneous","extinction":0.5})",
     R"({"type":"global","looseness":10})", kThroughTheBox, 0.381547},
    // 2 e^{-1} - e^{-2} - 1
    {"planted_whole_depth", R"("planted_whole_depth")", kConstant, kTwice, kThroughTheBox, -0.399576},
    // (e + 1)/(2 e) - 1
    {"planted_terminal_term", R"("planted_terminal_term")", kConstant, kTwice, kThroughTheBox, -0.316060},
    // 1/(1 + e^{-1}) - 1: all weight is gone after the first collision
    {"planted_lost_escape", R"("planted_lost_escape")", kConstant, kBound, kThroughTheBox, -0.268941},
    // -2 E[2^{-N}/(2 + sum_gaps e^gap)] e, N uniform points in [0, 2], N of mean 2: a renewal equation for each s of e^{-s sum}
    {"planted_lost_walks", R"("planted_lost_walks")", kConstant, kTwice, kThroughTheBox, -0.227225},
    // e^{-1} sum_i P(N >= i)/(i! P(N > i)) - 1, N of mean 2
    {"planted_strict_tail", R"("planted_strict_tail")", kConstant, kTwice, kThroughTheBox, 0.433624},
    // e^{-1/2} - 1
    {"planted_control_twice", R"("planted_control_twice")", kRising, kBound, kThroughTheBox, -0.393469},
    // e^{3/8} - 1
    {"planted_channel_majorant", R"("planted_channel_majorant")", kThreeChannels, kTwice, kThroughTheBox, 0.454991},
    // e^{-1/2} - 1
    {"planted_channel_swap", R"("planted_channel_swap")", kThreeChannels, kTwice, kThroughTheBox, -0.393469},
    // recursion over lookups spent
    {"planted_budget", R"("planted_budget")", kConstant, kFiveTimes, kThroughTheBox, -0.0145815},
    {"planted_neighbour", R"("planted_neighbour")", kStripes, kTwice, kSixteenPixels, 0},
    {"planted_paired_streams", R"("planted_paired_streams")", kConstant, kFiveTimes, kThroughTheBox, 0, 1. / 2},
    {"planted_ray_streams", R"("planted_ray_streams")", kStripes, kTwice, kSixteenPixels, 0, 1. / 16},
    // calls of 16384 samples
    {"planted_batch_streams", R"("planted_batch_streams")", kConstant, kFiveTimes, kThroughTheBox, 0, 16384. / 300000},
    // every sample has mean T; it depends on those before it
    {"planted_learned_bound", R"("planted_learned_bound")", kRising, kBound, kThroughTheBox, 0},
    // bins of a free path have the right shares
    {"planted_bin_shape", R"("planted_bin_shape")", kConstant, kTwice, kThroughTheBox, 0, 1, "free_path"},
    {"planted_half_depth", R"("planted_half_depth")", kConstant, kTwice, kThroughTheBox, 0},
    // e^{-tau/2}/e^{-tau} - 1, tau = 1 over a length of 2
    {"planted_unit_length", R"("planted_unit_length")", R"({"type":"homogeneous","extinction":0.5,"hi":[2,1,1]})", kBound,
     R"({"type":"single","to":[2,0.5,0.5]})", 0.648721},
    // e^{1/2} - 1: the ray's average is 1/2, the medium's 1
    {"planted_medium_average", R"("planted_medium_average")", R"({"type":"linear","begin":0,"end":2,"axis":"y"})", kBound,
     R"({"type":"single","from":[0,0.25,0.5],"to":[1,0.25,0.5]})", 0.648721},
    // .3 of epsilon
    {"planted_slight", R"("planted_slight")", kConstant, R"({"type":"global","looseness":50})", kThroughTheBox, 0.003, 1,
     "transmittance", 262144},
    // -P(N > 5), N Poisson of mean 4
    {"planted_killed", R"("planted_killed")", kConstant, kFiveTimes, kThroughTheBox, -0.214870},
    // e^{tau (1 - x/sinh x)} - 1, x = 3/8, tau = 1 - e^{-3}
    {"planted_midpoint", R"("planted_midpoint")", kFalling, kBound, kThroughTheBox, 0.0221524},
    {"planted_variance", R"("planted_variance")", kConstant, kTwice, kThroughTheBox, 0},
    // every sample, relative
    {"planted_exact", R"("planted_exact")", kConstant, kBound, kThroughTheBox, 1e-9},
};

}  // namespace nullmark
