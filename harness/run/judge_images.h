#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "harness/model/record.h"
#include "harness/run/problem.h"
#include "harness/sampling/pixel_groups.h"

namespace nullmark {

/// What was found of a folder of images.
struct JudgedImages {
  Plan plan;
  CellRecord record;
  std::vector<std::string> warnings;
};

/// Adds pictures of a scene with these rays and so many channels, and perhaps warnings.  Returns a hash of what the pictures
/// hold.
using AddPictures = std::function<std::uint64_t(const BuiltRays&, int, PixelGroups&, std::vector<std::string>&)>;

/// Adds the *.exr images of a folder.  Throws InputError for an image that has another size, other channels, or cannot be read.
AddPictures images_in(const std::string& folder);

/// Judges pictures of a scene.  `samples` is where they are from, for messages; `estimator` what records say of them, as in a
/// configuration.  Nothing if `stop` said so.  Throws InputError.
std::optional<JudgedImages> judge_images(const ProblemScene& scene, const std::string& samples, const std::string& estimator,
                                         SampleRange range, const AddPictures& add, const std::function<bool()>& stop);

/// Judges pictures of the plan's only cell; `whole` is a cell whose scene is built.  Each group of pixels is a series of as many
/// values as there are pictures, judged by itself.  The record has the tests of all groups, at the level of them all, and the
/// figures of the mean of all pixels.
std::optional<CellRecord> judge_pictures(const Plan& plan, const PreparedCell& whole, const PixelGroups& pictures,
                                         const PictureSource& source, const std::function<bool()>& stop);

}  // namespace nullmark
