#pragma once

#include <memory>
#include <vector>

#include "harness/kernel/transport_scene.h"
#include "harness/sampling/scene.h"

namespace nullmark {

/// Surfaces of specifications; `channels` of radiance.  Throws ParameterError.
std::vector<Surface> build_surfaces(const std::vector<SurfaceSpec>& specs, int channels);

/// Rays ended at the first surface they meet.
BuiltRays cut_at(const std::vector<Surface>& surfaces, BuiltRays rays);

/// The scene of a specification.  Throws ParameterError where its parts do not fit the medium, MissingData where a field of
/// emission has no file.
TransportScene make_transport_scene(const MediumSpec& medium, const BuiltMedium& built,
                                    std::shared_ptr<const MajorantStructure> majorant, const TransportSpec& transport);

}  // namespace nullmark
