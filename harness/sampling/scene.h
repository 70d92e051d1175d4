#pragma once

#include <memory>
#include <string>
#include <vector>

#include "harness/kernel/kernel.h"
#include "harness/kernel/optical_depth.h"
#include "harness/model/plan.h"
#include "harness/registry/ray_sets.h"

namespace nullmark {

/// A built medium, with its extrema and the hash that keys its random streams.
struct BuiltMedium {
  std::shared_ptr<const Medium> medium;
  MatterBounds extrema;
  Spectrum albedo;                                  ///< mu_s / mu per channel, its most where it varies
  std::shared_ptr<const AlbedoField> albedo_field;  ///< where it varies in space
  Box world_bounds{};
  std::uint64_t hash = 0;  ///< of the specification and of the data behind it
};

/// One value for all channels or one each; none: 0.  Throws ParameterError that names `what` if the number does not fit.
Spectrum per_channel(const std::vector<Real>& values, int channels, const char* what);

/// Its hash as records tell it, 16 hexadecimal digits.
std::string hash_text(const BuiltMedium& medium);

std::string hash_text(const TrackerIdentity& tracker);

/// Builds a specification: the field, times its spectrum or one per channel.  Throws ParameterError or MissingData.
BuiltMedium build_medium(const MediumSpec& spec);

/// A majorant structure, and the wall time of building it.
struct BuiltMajorant {
  std::shared_ptr<const MajorantStructure> structure;
  double build_seconds = 0;
};

/// Throws ParameterError if the structure does not fit the medium.
BuiltMajorant build_majorant(const Component& spec, const BuiltMedium& medium);

/// Rays of a set, cut to a medium, in both frames.
struct BuiltRays {
  std::vector<Ray> world, local;
  int width = 0, height = 0;
};
BuiltRays build_rays(const Component& spec, const BuiltMedium& medium);

/// At most so many of the rays, evenly, and no picture then.
BuiltRays thinned(BuiltRays rays, std::size_t most);

/// Optical depth of every ray, per channel, with a bound on its error.
struct Reference {
  int channels = 1;
  std::vector<Real> depth, error;  ///< [ray * channels + c]
  std::string method;              ///< "closed_form", "exact_traversal" or "quadrature"

  Spectrum at(std::size_t ray) const {
    return Eigen::Map<const Spectrum>(&depth[ray * static_cast<std::size_t>(channels)], channels);
  }
};
Reference compute_reference(const BuiltMedium& medium, const BuiltRays& rays);

/// Distances on every ray, with the exact optical depth from the begin of the ray to each and a bound on its error.
struct Marks {
  std::size_t per_ray = 0;
  std::vector<Real> distance;      ///< [ray * per_ray + j], ascending
  std::vector<Real> depth, error;  ///< [(ray * per_ray + j) * channels + c]
};

/// For transmittance_profile: kProfileMarks equidistant marks up to the end of the ray.  For free_path: the kFreePathCells + 1
/// ends of cells in which a collision is about equally probable.
Marks compute_marks(const BuiltMedium& medium, const BuiltRays& rays, Quantity quantity);

/// Medium, majorant and rays of a cell, shared by all cells that have the same.
struct Scene {
  std::shared_ptr<const BuiltMedium> medium;
  std::shared_ptr<const BuiltMajorant> majorant;
  std::shared_ptr<const BuiltRays> rays;
  std::shared_ptr<const Reference> reference;
  std::shared_ptr<const Marks> marks;  ///< for quantities at distances along the ray; null otherwise
  bool bounding = true;                ///< the majorant bounds the extinction in every segment of every ray
  bool exceeds_bound = false;          ///< the extinction was seen above the majorant at a point of a ray

  /// Prepares a ray with everything that the kernel needs.
  void context(std::size_t ray, const Kernel& kernel, PreparedRay& out) const;
};

/// Whether the majorant bounds the extinction in every segment of every ray.
bool bounds_everywhere(const MajorantStructure& majorant, const BuiltRays& rays);

/// Whether the extinction exceeds the majorant at one of several points of each piece between the medium's knots and the ends of
/// segments.  Then the majorant is not a bound, whatever the samples see.
bool exceeds_somewhere(const BuiltMedium& medium, const MajorantStructure& majorant, const BuiltRays& rays);

/// Key of the random streams: the same for all estimators on a medium with one seed, unless the cell has `own_streams`.
std::uint64_t stream_key(const Cell& cell, const BuiltMedium& medium);

}  // namespace nullmark
